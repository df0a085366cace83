"""Limits on torque, position and velocity, as bounds on the joint accelerations.

Position and velocity bounds are viable in the sense of Del Prete, "Joint position and velocity
bounds in discrete-time acceleration/torque control of robot arms", 2018: whatever is chosen within
them, braking with the given deceleration keeps the limits afterwards, so they never contradict
each other.
"""

import math

import numpy as np
from numba import njit

from skills.control.state import ArmState

FREE = 1e5
"""Acceleration in rad/s² that stands for no bound."""

RETURN_RATE = 5.0
"""Speed per distance, 1/s, with which a joint found beyond its limit comes back."""


class JointLimits:
    """Limits q_min, q_max (7,) rad and v_max (7,) rad/s, kept with decelerations of at most `braking` (7,) rad/s²."""

    def __init__(
        self, q_min: np.ndarray, q_max: np.ndarray, v_max: np.ndarray, braking: np.ndarray, period: float
    ) -> None:
        self._limits = np.stack([q_min, q_max, v_max, braking])
        self._period = period

    def bounds(self, state: ArmState) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (7,) on q̈; lower never exceeds upper."""
        lower, upper = np.empty(7), np.empty(7)
        _fill_bounds(state.q, state.v, self._limits, self._period, lower, upper)
        return lower, upper


@njit(cache=True)
def _highest(room: float, v: float, v_max: float, braking: float, dt: float) -> float:
    """Highest acceleration towards a limit that is `room` rad ahead, at speed v towards it."""
    by_speed = (v_max - v) / dt
    # The speed after this step may still be braked to zero within the room that is then left:
    # (v + a dt)² = 2 braking (room − v dt − a dt²/2), solved for the larger a.
    half = v + braking * dt / 2
    square = half * half - v * v + 2 * braking * (room - v * dt)
    by_room = (math.sqrt(square) - half) / dt if square > 0.0 else (RETURN_RATE * min(room, 0.0) - v) / dt
    return min(max(min(by_speed, by_room), -braking), FREE)


@njit(cache=True)
def _fill_bounds(
    q: np.ndarray, v: np.ndarray, limits: np.ndarray, dt: float, lower: np.ndarray, upper: np.ndarray
) -> None:
    for i in range(len(q)):
        q_min, q_max, v_max, braking = limits[0, i], limits[1, i], limits[2, i], limits[3, i]
        upper[i] = _highest(q_max - q[i], v[i], v_max, braking, dt)
        lower[i] = min(-_highest(q[i] - q_min, -v[i], v_max, braking, dt), upper[i])


class TorqueLimits:
    """Torques within ±tau_max (7,) Nm. Aims a hair inside, so that the solver's tolerance never breaks them."""

    margin = 2e-3
    """Share of each limit that is kept free."""

    def __init__(self, tau_max: np.ndarray) -> None:
        self.tau_max = tau_max
        self._inside = tau_max * (1.0 - self.margin)
        self._scale = 1.0 / tau_max

    def rows(self, state: ArmState, feedforward: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """R (7,7) and bounds (7,) each of lower ≤ R q̈ ≤ upper, in shares of each joint's limit."""
        still = state.bias + feedforward
        scale = self._scale
        return state.M * scale[:, None], (-self._inside - still) * scale, (self._inside - still) * scale

    def broken(self, tau: np.ndarray) -> bool:
        """Whether any torque of tau (7,) lies beyond its limit."""
        return bool((np.abs(tau) > self.tau_max).any())

    def clip(self, tau: np.ndarray) -> np.ndarray:
        """Bring tau (7,) within the limits, joint by joint."""
        return np.clip(tau, -self._inside, self._inside)
