"""Watches the true contacts of the arm and what it holds, and keeps those that the running phase did not declare."""

from collections.abc import Sequence
from dataclasses import replace

from bt_tamp.report.result import UnintendedContact
from sim.contact import Contact
from sim.robot import RobotModel
from skills.context import SkillContext

THRESHOLD = 1.0
"""Newtons above which a contact counts."""

GAP = 0.2
"""Seconds after which the same pair touching again counts anew."""


class ContactAudit:
    """Reads the engine's truth; it judges, and nothing that acts reads it."""

    def __init__(self, robot: RobotModel) -> None:
        self._links = frozenset(robot.links)
        self._fingers = robot.finger_links
        self.found: list[UnintendedContact] = []
        self._latest: dict[frozenset[str], tuple[int, float]] = {}

    def of_robot(self, contacts: Sequence[Contact], context: SkillContext) -> list[Contact]:
        """Those of the contacts that touch the arm, the hand or what is held."""
        held = context.scene.held.name if context.scene.held else None
        links = self._links
        return [
            contact
            for contact in contacts
            if contact.first in links or contact.second in links or (contact.first == held) != (contact.second == held)
        ]

    def look(self, t: float, contacts: Sequence[Contact], context: SkillContext, action: str) -> None:
        """Take in the contacts at time t (s), summed for each pair of names."""
        forces: dict[tuple[str, str], float] = {}
        for contact in self.of_robot(contacts, context):
            key = (contact.first, contact.second)
            forces[key] = forces.get(key, 0.0) + contact.normal_force
        for (first, second), force in forces.items():
            if force > THRESHOLD and not self._is_meant(frozenset((first, second)), context):
                self._keep(t, first, second, force, action, context)

    def _is_meant(self, pair: frozenset[str], context: SkillContext) -> bool:
        held = context.scene.held
        if pair in context.allowed or pair <= self._links or pair == {"pedestal", "link_0"}:
            return True
        return held is not None and held.name in pair and bool(pair & self._fingers)

    def _keep(self, t: float, first: str, second: str, force: float, action: str, context: SkillContext) -> None:
        pair = frozenset((first, second))
        index, last = self._latest.get(pair, (-1, -1.0))
        if index >= 0 and t - last < GAP:
            self.found[index] = replace(self.found[index], force_n=max(force, self.found[index].force_n))
        else:
            index = len(self.found)
            phase = context.phase.name if context.phase else ""
            self.found.append(UnintendedContact(t, first, second, force, action, phase))
        self._latest[pair] = (index, t)
