"""What a reference presses on: has it been touched, is it still there, and with what force is it pressed."""

from typing import Literal

from skills.control.contact import Touch
from skills.control.force import ForceLoop
from skills.control.reference import Reference

LOST_AFTER = 0.014
"""Seconds without contact, on top of its debouncing, after which a pressed reference has lost it."""

LOST_AFTER_TOUCH = 0.25
"""The same while touching down, when the tool may bounce. A regulated force is missed after UNBORNE_WHILE_LANDING."""

BORNE = 0.2
"""Share of a regulated force from which something bears it: what slides up between the fingers still rubs a little."""

LOST_LOAD, MOSTLY = 1.2, 0.8
"""Times the weight of what is held that must be felt, unless it is as much as this share of the force."""

UNBORNE_FOR = 0.04
"""Seconds without anything that bears it after which a pressed reference has lost contact."""

UNBORNE_WHILE_LANDING = 0.1
"""The same while the force is ramped up, and settles: a soft tool takes it up late."""

SETTLING = 0.1
"""Seconds that the force is left to settle after it was ramped up."""


class PressedContact:
    """Told at each tick what is felt along the reference's contact normal. `loop` regulates the force.

    is_pressed: the reference presses now. anchor: metres along the normal at which the tool was when it began to.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self.loop = ForceLoop(period)
        self._touch = Touch(period)
        self.is_pressed = self._lingers = False
        self.anchor = 0.0
        self._without_contact = self._unborne = 0.0

    def tare(self) -> None:
        """What is felt counts from zero again."""
        self._touch = Touch(self._period)

    @property
    def is_closed(self) -> bool:
        """Is the tool pressed on from outside along the normal?"""
        return self._touch.closed

    @property
    def has_settled(self) -> bool:
        """Has the force been ramped up, and left to settle?"""
        return self.loop.time_since_ramp >= SETTLING

    def begin(self, reference: Reference, felt: float, anchor: float, keeps_force: bool = False) -> None:
        """Press from now on, from the force (N) that is felt; keeps_force: from the force that is regulated."""
        self.is_pressed, self.anchor = True, anchor
        self._without_contact = self._unborne = 0.0
        if not keeps_force:
            self.loop.reset(min(max(felt, 0.0), reference.force))
        self.loop.aim(reference.force)

    def end(self) -> None:
        """Press no longer."""
        self.is_pressed = False

    def linger(self) -> bool:
        """Is something pressed on, or still there for a moment when it need no longer be pressed?"""
        self._lingers = self.is_pressed or (self._lingers and self.is_closed)
        return self._lingers

    def look(self, reference: Reference | None, felt: float, weight: float) -> Literal["touched", "lost"] | None:
        """What has become of the contact at this tick. felt: N along the normal; weight: N of what is held."""
        self._touch.update(felt)
        if reference is None or reference.force == 0.0:
            return None
        if not self.is_pressed:
            return "touched" if self._touch.closed else None
        self._without_contact = 0.0 if self._touch.closed else self._without_contact + self._period
        self._unborne = 0.0 if self._is_borne(reference, felt, weight) else self._unborne + self._period
        patience = LOST_AFTER_TOUCH if reference.until_contact else LOST_AFTER
        unborne_for = UNBORNE_FOR if self.has_settled else UNBORNE_WHILE_LANDING
        is_lost = self._without_contact > patience or self._unborne > unborne_for
        return "lost" if is_lost else None

    def _is_borne(self, reference: Reference, felt: float, weight: float) -> bool:
        """Does something bear the force that is regulated? A load that is lost seems to bear its weight."""
        if reference.mode != "hybrid":
            return True
        lost = abs(weight * float(reference.normal[2]))
        return felt >= max(BORNE * self.loop.wanted, min(LOST_LOAD * lost, MOSTLY * self.loop.wanted))
