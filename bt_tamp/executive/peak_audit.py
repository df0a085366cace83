"""Keeps the largest true force with which the arm and what it holds met anything."""

import math
from collections.abc import Sequence

import numpy as np

from sim.contact import Contact
from sim.plant import Observation
from sim.robot import RobotModel

SLIPPING = 0.2
"""m/s by which a body moves otherwise than the hand once it slips from it."""

FALLING = 0.02
"""Seconds of slipping after which the hand holds it no longer: with what force it lands then isn't the arm's doing. A
blow that tears something from the hand counts, for it slips only from then on."""

LANDING = 0.1
"""Seconds after which what slipped and moves along with the hand again is held again: landing, it stands still at
once."""


class PeakAudit:
    """Reads the engine's truth; it judges, and nothing that acts reads it. `peak`: N, the net force of one thing: what
    both fingers squeeze pushes back as much on one as on the other."""

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self._links = frozenset(robot.links)
        self.peak = 0.0
        self._slips_since: float | None = None
        self._slipped_at = -LANDING

    def look(self, contacts: Sequence[Contact], truth: Observation, held: str | None) -> None:
        """Take in the contacts of this instant. held: what the hand is believed to hold."""
        mine = self._links if held is None or self._slips(held, truth) else self._links | {held}
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

    def _slips(self, name: str, truth: Observation) -> bool:
        if name not in truth.poses:
            return True
        V_WG = self._robot.V_WG(truth.q, truth.v)
        lever = truth.poses[name].translation - self._robot.X_WG(truth.q).translation
        relative = truth.velocities[name][:3] - V_WG[:3] - np.cross(V_WG[3:], lever)
        if math.hypot(*relative.tolist()) > SLIPPING:
            self._slips_since = truth.t if self._slips_since is None else self._slips_since
            self._slipped_at = truth.t
        elif truth.t - self._slipped_at >= LANDING:
            self._slips_since = None
        return self._slips_since is not None and truth.t - self._slips_since >= FALLING


_BASE = {"pedestal", "link_0"}
"""The robot stands on it."""
