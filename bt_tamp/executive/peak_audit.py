"""Keeps the largest true force with which the arm and what it holds met anything."""

import math
from collections.abc import Sequence

from sim.contact import Contact
from sim.robot import RobotModel
from skills.context import SkillContext


class PeakAudit:
    """Reads the engine's truth; it judges, and nothing that acts reads it. `peak`: N, the net force of one thing: what
    both fingers squeeze pushes back as much on one as on the other."""

    def __init__(self, robot: RobotModel) -> None:
        self._links = frozenset(robot.links)
        self.peak = 0.0

    def look(self, contacts: Sequence[Contact], context: SkillContext) -> None:
        """Take in the contacts of this instant."""
        held = context.scene.held
        mine = self._links if held is None else self._links | {held.name}
        forces: dict[str, list[float]] = {}
        for contact in contacts:
            if (contact.first in mine) == (contact.second in mine) or {contact.first, contact.second} == _BASE:
                continue
            other, sign = (contact.second, 1.0) if contact.first in mine else (contact.first, -1.0)
            net = forces.setdefault(other, [0.0, 0.0, 0.0])
            for axis, part in enumerate(contact.force.tolist()):
                net[axis] += sign * part
        for net in forces.values():
            self.peak = max(self.peak, math.hypot(*net))


_BASE = {"pedestal", "link_0"}
"""The robot stands on it."""
