"""What acts on the arm and is not in its model: the generalised-momentum observer.

    r(t) = K (p(t) − ∫ (τ + Ṁ q̇ − h + r) dt),  p = M q̇  ⇒  ṙ = K (τ_ext − r)

De Luca, Mattone, "Sensorless robot collision detection and hybrid force/motion control", 2005, with
C(q, q̇)ᵀ q̇ − g written as Ṁ q̇ − h (M − 2C is skew). It needs no acceleration and no inverse of M.
"""

import numpy as np
from numba import njit

GAIN = 60.0
"""K in 1/s: torques from outside are seen with a time constant of 17 ms."""

PROMPT = 250.0
"""The same in 1/s of what is to be answered at once; it is noisier."""

COMPENSATED = 0.25
"""Share of each joint's torque that may go into what the model lacks."""

COMPENSATION_RATE = 150.0
"""Nm/s at which that may change: joint friction turns round within 20 ms."""

SLOW = 4.0
"""1/s: what changes more slowly than this counts as an error of the model rather than an event."""


class MomentumObserver:
    """Torques (7,) in Nm from outside the model, of which a share is known from the wrist sensor.

    `unmodelled` is what neither the model nor the sensor explains: joint friction, wrong masses, contact of the
    arm. `sudden` is the part of it that came up within the last quarter of a second, `prompt` the same as `unmodelled`,
    seen within 4 ms.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._blend = 1.0 - np.exp(-GAIN * period)
        self._creep = 1.0 - np.exp(-SLOW * period)
        self._jump = 1.0 - np.exp(-PROMPT * period)
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        self.reset()

    def reset(self) -> None:
        """Forget everything: nothing acts from outside."""
        self._last = None
        self._filtered = np.zeros((3, 7))
        self.unmodelled = np.zeros(7)
        self.sudden = np.zeros(7)
        self.prompt = np.zeros(7)

    def change_model(self) -> None:
        """M and h will come from another model: momentum is not compared across the change."""
        self._last = None

    def update(self, M: np.ndarray, bias: np.ndarray, v: np.ndarray, tau: np.ndarray, sensed: np.ndarray) -> None:
        """Take in one period: M (7,7), bias h (7,) and v (7,) now, the torques tau (7,) that acted since the last
        call, and the torques (7,) by which the wrist sensor explains outside forces."""
        last, self._last = self._last, (M, bias, v)
        if last is None:
            return
        self.unmodelled, self.sudden = np.empty(7), np.empty(7)
        rates = (self._period, self._blend, self._creep, self._jump)
        found = (self.unmodelled, self.sudden, self.prompt)
        _observe(*last, M, bias, v, tau, sensed, *rates, self._filtered, *found)


class Compensation:
    """Torques (7,) in Nm taken for the model's errors, `torque` now. They change slowly enough for an impact, which the
    observer and the sensor see at slightly different times, to make no step."""

    def __init__(self, tau_max: np.ndarray, period: float) -> None:
        self._bound = COMPENSATED * tau_max
        self._step = COMPENSATION_RATE * period
        self.torque = np.zeros(7)

    def advance(self, wanted: np.ndarray) -> np.ndarray:
        """The torques (7,) after one more period, in which `wanted` (7,) was what the model lacks."""
        _creep(wanted, self._bound, self._step, self.torque)
        return self.torque


@njit(cache=True)
def _creep(wanted: np.ndarray, bound: np.ndarray, most: float, value: np.ndarray) -> None:
    """Move `value` (7,) by at most `most` towards `wanted`, which counts up to `bound`."""
    for i in range(len(value)):
        goal = min(max(wanted[i], -bound[i]), bound[i])
        value[i] += min(max(goal - value[i], -most), most)


@njit(cache=True)
def _observe(
    M_before,
    bias_before,
    v_before,
    M,
    bias,
    v,
    tau,
    sensed,
    period,
    blend,
    creep,
    jump,
    filtered,
    unmodelled,
    sudden,
    prompt,
):
    everything, from_sensor, lasting = filtered
    for i in range(len(v)):
        # Over one period p changes by M̄ Δq̇ + ΔM q̇̄, and the second part is the integral of Ṁ q̇.
        gained = 0.0
        for j in range(len(v)):
            gained += 0.5 * (M[i, j] + M_before[i, j]) * (v[j] - v_before[j])
        outside = gained / period + 0.5 * (bias[i] + bias_before[i]) - tau[i]
        everything[i] += blend * (outside - everything[i])
        from_sensor[i] += blend * (sensed[i] - from_sensor[i])
        unmodelled[i] = everything[i] - from_sensor[i]
        lasting[i] += creep * (unmodelled[i] - lasting[i])
        sudden[i] = unmodelled[i] - lasting[i]
        prompt[i] += jump * (outside - sensed[i] - prompt[i])
