"""Watches the true contacts of the arm and what it holds, and keeps those that the running phase did not declare."""

from collections.abc import Sequence
from dataclasses import replace

from bt_tamp.report.result import UnintendedContact
from scenarios.scenario import Scenario
from sim.bullet import Contact
from sim.robot import RobotModel
from skills.context import SkillContext

THRESHOLD = 1.0
"""Newtons above which a contact counts."""

GAP = 0.2
"""Seconds after which the same pair touching again counts anew."""


class ContactAudit:
    """Reads the engine's truth; it judges, and nothing that acts reads it."""

    def __init__(self, robot: RobotModel, scenario: Scenario) -> None:
        self._links = frozenset(robot.links)
        self._fingers = robot.finger_links
        self.found: list[UnintendedContact] = []
        self._latest: dict[frozenset[str], tuple[int, float]] = {}

    def involves_robot(self, contact: Contact, context: SkillContext) -> bool:
        """Does the contact touch the arm, the hand or what is held?"""
        held = context.scene.held
        own = self._links | ({held.name} if held else frozenset())
        return (contact.first in own) != (contact.second in own) or bool({contact.first, contact.second} & self._links)

    def look(self, t: float, contacts: Sequence[Contact], context: SkillContext, action: str) -> None:
        """Take in the contacts at time t (s), summed for each pair of names."""
        held = context.scene.held
        allowed = context.allowed | (
            frozenset(frozenset((finger, held.name)) for finger in self._fingers) if held else frozenset()
        )
        forces: dict[tuple[str, str], float] = {}
        for contact in contacts:
            pair = frozenset((contact.first, contact.second))
            if not self.involves_robot(contact, context) or pair in allowed:
                continue
            if pair <= self._links or ("pedestal" in pair and "link_0" in pair):
                continue
            key = (contact.first, contact.second)
            forces[key] = forces.get(key, 0.0) + contact.normal_force
        for (first, second), force in forces.items():
            if force > THRESHOLD:
                self._keep(t, first, second, force, action, context)

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
