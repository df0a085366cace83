"""True points of contact, as the engine tells them."""

from typing import Any, NamedTuple

import numpy as np

NORMAL_FORCE = 9
"""Where an entry of `getContactPoints` has the normal force."""


class Contact(NamedTuple):
    """A true contact point between two named things, as the engine tells it (`getContactPoints`)."""

    first: str
    second: str
    point: tuple[Any, ...]

    @property
    def normal_force(self) -> float:
        """N, pressing is positive."""
        return self.point[NORMAL_FORCE]

    @property
    def lift(self) -> float:
        """N of `force` along z of W."""
        point = self.point
        return point[7][2] * point[NORMAL_FORCE] + point[11][2] * point[10] + point[13][2] * point[12]

    @property
    def position(self) -> np.ndarray:
        """(3,) in W, on the second."""
        return np.array(self.point[6])

    @property
    def force(self) -> np.ndarray:
        """(3,) in N on the first, in W, friction included."""
        normal, across, along = self.point[7], self.point[11], self.point[13]
        forces = self.point[NORMAL_FORCE], self.point[10], self.point[12]
        return np.array(forces) @ np.array((normal, across, along))
