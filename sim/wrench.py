"""A wrench with its frame: force and torque about that frame's origin, in that frame's axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Wrench:
    """Force (3,) in N and torque (3,) in Nm, in the axes of one frame and about its origin."""

    force: np.ndarray
    torque: np.ndarray

    @property
    def vector(self) -> np.ndarray:
        """(6,) linear before angular, Pinocchio's order."""
        return np.concatenate([self.force, self.torque])


def felt_at_joint(reaction: Sequence[float], lever: Sequence[float]) -> Wrench:
    """What a sensor in a joint reads, in the joint's frame: the opposite of the `reaction`, forces before torques, on
    the link beyond it about a point `lever` (3,) m from the joint. PyBullet tells it so, about the centre of mass."""
    x, y, z = -reaction[0], -reaction[1], -reaction[2]
    a, b, c = lever
    torque = (b * z - c * y - reaction[3], c * x - a * z - reaction[4], a * y - b * x - reaction[5])
    return Wrench(np.array((x, y, z)), np.array(torque))
