"""Limits as parts that can be put together: bounds on the joint accelerations, and rows over them.

A bound narrows lower ≤ q̈ ≤ upper in place. Position and velocity bounds are viable in the sense of Del
Prete, "Joint position and velocity bounds in discrete-time acceleration/torque control of robot arms",
2018: whatever is chosen within them, braking with the given deceleration keeps the limits afterwards. As none
of them asks for more than that deceleration, they never contradict each other, in whatever order they narrow.
"""

import math
from typing import NamedTuple, Protocol

import numpy as np
from numba import njit

from skills.control.state import ArmState

FREE = 1e5
"""Acceleration in rad/s² (or m/s²) that stands for no bound."""

RETURN_RATE = 5.0
"""Speed per distance, 1/s, with which a joint found beyond its limit comes back."""


class Bound(Protocol):
    """A limit on every joint by itself."""

    def narrow(self, state: ArmState, lower: np.ndarray, upper: np.ndarray) -> None:
        """Narrow the bounds (7,) on q̈ in place."""
        ...


class Block(NamedTuple):
    """Limits lower ≤ R q̈ ≤ upper with R (m,7) and bounds (m,), to be filled row by row."""

    R: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


class Row(Protocol):
    """A limit on one combination of joint accelerations."""

    def fill(self, state: ArmState, block: Block, row: int) -> None:
        """Write that row of the block."""
        ...


class AccelerationLimit:
    """No joint accelerates by more than a_max (7,) rad/s²."""

    def __init__(self, a_max: np.ndarray) -> None:
        self._a_max = a_max

    def narrow(self, state: ArmState, lower: np.ndarray, upper: np.ndarray) -> None:
        _narrow(self._a_max, lower, upper)


class VelocityLimit:
    """No joint moves faster than v_max (7,) rad/s, kept with at most `braking` (7,) rad/s²."""

    def __init__(self, v_max: np.ndarray, braking: np.ndarray, period: float) -> None:
        self._limits = np.stack([v_max, braking])
        self._period = period

    def narrow(self, state: ArmState, lower: np.ndarray, upper: np.ndarray) -> None:
        _narrow_by_speed(state.v, self._limits, self._period, lower, upper)


class PositionLimit:
    """Every joint stays between q_min and q_max (7,) rad, kept with at most `braking` (7,) rad/s²."""

    def __init__(self, q_min: np.ndarray, q_max: np.ndarray, braking: np.ndarray, period: float) -> None:
        self._limits = np.stack([q_min, q_max, braking])
        self._period = period

    def narrow(self, state: ArmState, lower: np.ndarray, upper: np.ndarray) -> None:
        _narrow_by_room(state.q, state.v, self._limits, self._period, lower, upper)


class TorqueLimits:
    """Torques within ±tau_max (7,) Nm. Aims a hair inside, so that the solver's tolerance never breaks them."""

    margin = 2e-3
    """Share of each limit that is kept free."""

    def __init__(self, tau_max: np.ndarray) -> None:
        self.tau_max = tau_max
        self._inside = tau_max * (1.0 - self.margin)
        self._scale = 1.0 / tau_max

    def fill(self, state: ArmState, feedforward: np.ndarray, block: Block) -> None:
        """Write the first seven rows of the block: the torques M q̈ + h + f, in shares of each joint's limit."""
        _torque_rows(state.M, state.bias, feedforward, self._inside, self._scale, *block)

    def broken(self, tau: np.ndarray) -> bool:
        """Whether any torque of tau (7,) lies beyond its limit."""
        return _any_beyond(tau, self.tau_max)

    def clip(self, tau: np.ndarray) -> np.ndarray:
        """Bring tau (7,) within the limits, joint by joint."""
        return np.clip(tau, -self._inside, self._inside)


class ApproachLimit(NamedTuple):
    """The tool comes no faster than `speed` m/s against `normal` (3,), a unit vector in W.

    Kept by nᵀ(J q̈ + J̇ q̇) ≥ −(speed + nᵀ v) / HORIZON: an excess fades, the way a barrier function does it
    (Ames et al., "Control barrier functions: theory and applications", 2019).
    """

    normal: np.ndarray
    speed: float

    def fill(self, state: ArmState, block: Block, row: int) -> None:
        _approach_row(self.normal, self.speed, state.V, state.J, state.drift, *block, row)


APPROACH_HORIZON = 0.01
"""Seconds within which an excess of approach speed shall fade."""


@njit(cache=True)
def _narrow(a_max: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
    for i in range(len(a_max)):
        lower[i] = max(lower[i], -a_max[i])
        upper[i] = min(upper[i], a_max[i])


@njit(cache=True)
def _torque_rows(
    M: np.ndarray,
    bias: np.ndarray,
    feedforward: np.ndarray,
    inside: np.ndarray,
    scale: np.ndarray,
    R: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
) -> None:
    for i in range(len(bias)):
        still = bias[i] + feedforward[i]
        lower[i], upper[i] = (-inside[i] - still) * scale[i], (inside[i] - still) * scale[i]
        for j in range(len(bias)):
            R[i, j] = M[i, j] * scale[i]


@njit(cache=True)
def _any_beyond(values: np.ndarray, limits: np.ndarray) -> bool:
    excess = 0.0
    for i in range(len(values)):
        excess = max(excess, abs(values[i]) - limits[i])
    return excess > 0.0


@njit(cache=True)
def _approach_row(
    n: np.ndarray,
    speed: float,
    V: np.ndarray,
    J: np.ndarray,
    drift: np.ndarray,
    R: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    row: int,
) -> None:
    v = n[0] * V[0] + n[1] * V[1] + n[2] * V[2]
    a = n[0] * drift[0] + n[1] * drift[1] + n[2] * drift[2]
    lower[row], upper[row] = -(speed + v) / APPROACH_HORIZON - a, FREE
    for j in range(7):
        R[row, j] = n[0] * J[0, j] + n[1] * J[1, j] + n[2] * J[2, j]


@njit(cache=True)
def _narrow_by_speed(v: np.ndarray, limits: np.ndarray, dt: float, lower: np.ndarray, upper: np.ndarray) -> None:
    for i in range(len(v)):
        v_max, braking = limits[0, i], limits[1, i]
        upper[i] = min(upper[i], max((v_max - v[i]) / dt, -braking))
        lower[i] = max(lower[i], min((-v_max - v[i]) / dt, braking))


@njit(cache=True)
def _highest(room: float, v: float, braking: float, dt: float) -> float:
    """Highest acceleration towards a limit that is `room` rad ahead, at speed v towards it."""
    # The speed after this step may still be braked to zero within the room that is then left:
    # (v + a dt)² = 2 braking (room − v dt − a dt²/2), solved for the larger a.
    half = v + braking * dt / 2
    square = half * half - v * v + 2 * braking * (room - v * dt)
    highest = (math.sqrt(square) - half) / dt if square > 0.0 else (RETURN_RATE * min(room, 0.0) - v) / dt
    return max(highest, -braking)


@njit(cache=True)
def _narrow_by_room(
    q: np.ndarray, v: np.ndarray, limits: np.ndarray, dt: float, lower: np.ndarray, upper: np.ndarray
) -> None:
    for i in range(len(q)):
        q_min, q_max, braking = limits[0, i], limits[1, i], limits[2, i]
        upper[i] = min(upper[i], _highest(q_max - q[i], v[i], braking, dt))
        lower[i] = min(max(lower[i], -_highest(q[i] - q_min, -v[i], braking, dt)), upper[i])
