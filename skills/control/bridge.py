"""Bumpless change of law: what the torque would jump by is added back and fades."""

import numpy as np

from skills.control.force import smooth_step

FADING = 0.1
"""Seconds until the old law's torque has gone."""


class Bridge:
    """A torque offset (7,) in Nm that decays smoothly to zero."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._jump = np.zeros(7)
        self._time = FADING

    def span(self, jump: np.ndarray) -> None:
        """Begin with the offset `jump` (7,), old torque minus new."""
        self._jump = jump
        self._time = 0.0

    def drop(self) -> None:
        """No offset any more."""
        self._time = FADING

    def advance(self) -> np.ndarray:
        """The offset (7,) after one more period."""
        self._time += self._period
        if self._time >= FADING:
            return _NOTHING
        return self._jump * (1.0 - smooth_step(self._time / FADING))


_NOTHING = np.zeros(7)
