"""What acts on the arm and is not in its model: the generalised-momentum observer.

    r(t) = K (p(t) − ∫ (τ + Ṁ q̇ − h + r) dt),  p = M q̇  ⇒  ṙ = K (τ_ext − r)

De Luca, Mattone, "Sensorless robot collision detection and hybrid force/motion control", 2005, with
C(q, q̇)ᵀ q̇ − g written as Ṁ q̇ − h (M − 2C is skew). It needs no acceleration and no inverse of M.
"""

import numpy as np

GAIN = 60.0
"""K in 1/s: torques from outside are seen with a time constant of 17 ms."""

SLOW = 4.0
"""1/s: what changes more slowly than this counts as an error of the model rather than an event."""


class MomentumObserver:
    """Torques (7,) in Nm from outside the model, of which a share is known from the wrist sensor.

    `unmodelled` is what neither the model nor the sensor explains: joint friction, wrong masses, contact of the
    arm. `sudden` is the part of it that came up within the last quarter of a second.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._blend = 1.0 - np.exp(-GAIN * period)
        self._creep = 1.0 - np.exp(-SLOW * period)
        self._last: tuple[np.ndarray, np.ndarray] | None = None
        self.reset()

    def reset(self) -> None:
        """Forget everything: nothing acts from outside."""
        self._last = None
        self._all = np.zeros(7)
        self._sensed = np.zeros(7)
        self._lasting = np.zeros(7)
        self.unmodelled = np.zeros(7)
        self.sudden = np.zeros(7)

    def change_model(self) -> None:
        """M and h will come from another model: momentum is not compared across the change."""
        self._last = None

    def update(self, M: np.ndarray, bias: np.ndarray, v: np.ndarray, tau: np.ndarray, sensed: np.ndarray) -> None:
        """Take in one period: M (7,7), bias h (7,) and v (7,) now, the torques tau (7,) that acted since the last
        call, and the torques (7,) by which the wrist sensor explains outside forces."""
        last, self._last = self._last, (M, v)
        if last is None:
            return
        M_before, v_before = last
        # Over one period p changes by M̄ Δq̇ + ΔM q̇̄, and the second part is the integral of Ṁ q̇.
        gained = 0.5 * ((M + M_before) @ (v - v_before))
        outside = gained / self._period + bias - tau
        self._all += self._blend * (outside - self._all)
        self._sensed += self._blend * (sensed - self._sensed)
        self.unmodelled = self._all - self._sensed
        self._lasting += self._creep * (self.unmodelled - self._lasting)
        self.sudden = self.unmodelled - self._lasting
