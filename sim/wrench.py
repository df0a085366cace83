"""A wrench with its frame: force and torque about that frame's origin, in that frame's axes."""

from dataclasses import dataclass

import numpy as np
from pinocchio import SE3


@dataclass(frozen=True)
class Wrench:
    """Force (3,) in N and torque (3,) in Nm, in the axes of one frame and about its origin."""

    force: np.ndarray
    torque: np.ndarray

    @staticmethod
    def zero() -> "Wrench":
        return Wrench(np.zeros(3), np.zeros(3))

    @property
    def vector(self) -> np.ndarray:
        """(6,) linear before angular, Pinocchio's order."""
        return np.concatenate([self.force, self.torque])

    def seen_from(self, X_AB: SE3) -> "Wrench":
        """This wrench, given in B, expressed in A: X_AB is the pose of B in A."""
        force = X_AB.rotation @ self.force
        return Wrench(force, X_AB.rotation @ self.torque + np.cross(X_AB.translation, force))
