"""The arm at one instant, everything the tasks and limits need of the model, and where its tool should be."""

from typing import NamedTuple

import numpy as np
from numba import njit


class ArmState(NamedTuple):
    """Model quantities at configuration q and velocity v (7,).

    M (7,7) joint inertia; bias (7,) Coriolis and gravity torques. At the tool centre G, in W axes:
    J (6,7), drift (6,) = J̇ v (classical), p (3,), R (3,3), V (6,).
    """

    q: np.ndarray
    v: np.ndarray
    M: np.ndarray
    bias: np.ndarray
    J: np.ndarray
    drift: np.ndarray
    p: np.ndarray
    R: np.ndarray
    V: np.ndarray

    @property
    def mobility(self) -> np.ndarray:
        """J M⁻¹ Jᵀ (6,6), the inverse of the task-space inertia Λ."""
        return self.J @ np.linalg.solve(self.M, self.J.T)

    def torques_of(self, wrench: np.ndarray) -> np.ndarray:
        """Jᵀ F: the joint torques (7,) in Nm of a wrench F (6,) on the tool, at G in W axes."""
        tau = np.empty(7)
        _fill_torques(self.J, wrench, tau)
        return tau


class Target(NamedTuple):
    """A pose to follow: p (3,) and R (3,3) in W, velocity V (6,) and acceleration A (6,) in W axes."""

    p: np.ndarray
    R: np.ndarray
    V: np.ndarray
    A: np.ndarray


@njit(cache=True)
def _fill_torques(J: np.ndarray, wrench: np.ndarray, tau: np.ndarray) -> None:
    for i in range(len(tau)):
        tau[i] = 0.0
        for k in range(len(wrench)):
            tau[i] += J[k, i] * wrench[k]
