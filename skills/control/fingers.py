"""Is what is felt along the fingers' way their own doing? One that meets something fixed pushes the hand off."""

MOVING = 0.005
"""Metres per second of opening from which the fingers move."""

SETTLING = 0.3
"""Seconds after which fingers that have moved count as at rest."""

PRESSING = 10.0
"""Newtons along their way from which they still press on what they met."""


class FingerWork:
    """Told tick after tick; `goes_on`: the fingers move, did so just now, or still press along their way."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._still = SETTLING
        self.goes_on = False

    def update(self, speed: float, force: float) -> None:
        """Take in one tick: the speed of the opening in m/s and the force on the hand along the fingers' way in N."""
        self._still = 0.0 if abs(speed) > MOVING else self._still + self._period
        self.goes_on = self._still < SETTLING or (self.goes_on and abs(force) > PRESSING)
