"""Measures the true force with which the arm pressed, for the report: mean and spread over each motion in contact."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bt_tamp.report.result import PressedMotion
from sim.contact import Contact
from sim.robot import RobotModel
from skills.context import SkillContext

SETTLED = 0.5
"""Seconds after touchdown, or after another force is wanted, from which the force is judged."""


@dataclass
class _Motion:
    action: str
    target: float
    touched_at: float | None = None
    forces: tuple[float, ...] = ()


class ForceAudit:
    """Reads the engine's truth; it judges, and nothing that acts reads it."""

    def __init__(self, robot: RobotModel) -> None:
        self._hand = robot.hand_links
        self._now: _Motion | None = None
        self._found: list[PressedMotion] = []

    @property
    def found(self) -> tuple[PressedMotion, ...]:
        """Every motion in contact so far, in order of time; one that was pressed harder on the way counts as two."""
        self._close()
        return tuple(self._found)

    def look(self, t: float, contacts: Sequence[Contact], context: SkillContext, action: str) -> None:
        """Take in the contacts at time t (s)."""
        phase = context.phase
        if phase is None or phase.press is None or phase.kind not in ("touch", "slide"):
            self._close()
            return
        reference = context.controller.reference
        wanted = (reference.force if reference else 0.0) or phase.press.force
        if self._now is None or (self._now.action, self._now.target) != (action, wanted):
            self._close()
            self._now = _Motion(action, wanted)
        if self._now.touched_at is None and context.controller.contact:
            self._now.touched_at = t
        if self._now.touched_at is None or t < self._now.touched_at + SETTLED:
            return
        held = context.scene.held
        tool = self._hand | ({held.name} if held else frozenset())
        self._now.forces += (_upward(contacts, tool),)

    def _close(self) -> None:
        motion, self._now = self._now, None
        if motion is None or not motion.forces:
            return
        forces = np.array(motion.forces)
        spread = float(np.sqrt(np.mean((forces - motion.target) ** 2)))
        self._found.append(
            PressedMotion(motion.action, motion.target, float(forces.mean()), spread, float(forces.max()))
        )


def _upward(contacts: Sequence[Contact], tool: frozenset[str]) -> float:
    """Vertical force in N of the world on hand and tool."""
    up = 0.0
    for contact in contacts:
        if (contact.first in tool) != (contact.second in tool):
            up += contact.lift if contact.first in tool else -contact.lift
    return up
