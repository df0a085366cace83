"""Closed-loop force along one direction: F = f_d + K_i ∫ (f_d − f) dt on the measured force f."""

from numba import njit

INTEGRAL_GAIN = 4.0
"""K_i in 1/s."""

RAMP_RATE = 40.0
"""Newtons per second at which the wanted force moves to a new value, on average."""

SHORTEST_RAMP, LONGEST_RAMP = 0.15, 0.35
"""Seconds."""


@njit(cache=True)
def smooth_step(s: float) -> float:
    """0 for s ≤ 0, 1 for s ≥ 1, and a cubic with level ends between."""
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


class ForceLoop:
    """The force to press with, ramped to its target; `command` in N, `wanted` (ramped) in N."""

    def __init__(self, period: float) -> None:
        self._period = period
        self.reset(0.0)

    def reset(self, force: float) -> None:
        """Start over at contact, from the force in N that is measured there."""
        self._from = self._to = self.wanted = self.command = force
        self._time = 0.0
        self._ramp = SHORTEST_RAMP
        self._integral = 0.0

    def aim(self, force: float) -> None:
        """Ramp the wanted force to `force` N, from where it is now."""
        if force == self._to:
            return
        self._from, self._to = self.wanted, force
        self._time = 0.0
        self._ramp = min(max(SHORTEST_RAMP, abs(force - self._from) / RAMP_RATE), LONGEST_RAMP)

    @property
    def time(self) -> float:
        """Seconds since the ramp to the present target began."""
        return self._time

    @property
    def time_since_ramp(self) -> float:
        """Seconds since the wanted force arrived at its target; negative before."""
        return self._time - self._ramp

    def update(self, measured: float) -> float:
        """Take in the measured force in N and return the force to command."""
        self._time += self._period
        self.wanted = self._from + (self._to - self._from) * smooth_step(self._time / self._ramp)
        step = INTEGRAL_GAIN * self._period * (self.wanted - measured)
        # What the loop may add is bounded, so that a lost contact or a stuck tool winds nothing up.
        authority = max(self.wanted, 2.0)
        self._integral = min(max(self._integral + step, -authority), authority)
        self.command = self.wanted + self._integral
        return self.command
