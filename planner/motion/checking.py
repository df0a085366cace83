"""What planners ask of a collision model."""

from typing import Protocol

import numpy as np


class CollisionChecker(Protocol):
    """One scene, one robot, one set of margins."""

    @property
    def checks(self) -> int:
        """How many configurations were looked at."""
        ...

    def is_free(self, q: np.ndarray) -> bool:
        """Is q (7,) within the joint limits and free of collision?"""
        ...

    def edge_is_free(self, qa: np.ndarray, qb: np.ndarray) -> bool:
        """Is the straight joint-space edge from qa (known to be free) to qb free?"""
        ...
