"""Weighing what was grasped: is it what the hand was meant to hold?"""

from dataclasses import replace

import numpy as np
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from planner.failure import GraspMissed
from sim.plant import Observation
from sim.wrench import Wrench
from skills.context import ActionRun, SkillContext
from skills.control.payload import estimate_payload, wrist_error
from skills.motions import READINGS, Close

TOLERANCE = 0.06
"""Kilograms by which the weight may always differ."""

SHARE = 0.5
"""Share of the declared mass by which the weight may differ."""


class Weigh(Behaviour):
    """Estimates the load from a few readings of the wrist sensor, at rest, and compares it with what was expected.

    What the sensor read before the fingers had closed is its error. What a silent sensor can't weigh is taken for what
    it should be.
    """

    def __init__(self, run: ActionRun, context: SkillContext, close: Close) -> None:
        super().__init__("weigh")
        self._run, self._context, self._close = run, context, close
        self._readings: list[Observation] = []

    def initialise(self) -> None:
        self._readings = []

    def update(self) -> Status:
        self._readings.append(self._context.observation)
        if len(self._readings) < READINGS:
            return Status.RUNNING
        empty = self._close.readings
        if not all(np.isfinite(reading.wrist.vector).all() for reading in (*empty, *self._readings)):
            self.feedback_message = "the wrist sensor says nothing"
            return Status.SUCCESS
        robot = self._context.robot
        error = wrist_error(robot, empty)
        name = self._run.action.args[0]
        expected = self._context.scene.scenario.bodies[name].mass
        mass, _ = estimate_payload(robot, [_without(reading, error) for reading in self._readings])
        if abs(mass - expected) <= max(TOLERANCE, SHARE * expected):
            return Status.SUCCESS
        reason = f"what was grasped weighs {mass * 1000:.0f} g, {name} should weigh {expected * 1000:.0f} g"
        sample = self._run.refinement.sample if self._run.refinement else None
        self._context.fail(GraspMissed(self._run.action, reason, sample))
        self.feedback_message = reason
        return Status.FAILURE


def _without(reading: Observation, error: Wrench) -> Observation:
    wrist = reading.wrist
    return replace(reading, wrist=Wrench(wrist.force - error.force, wrist.torque - error.torque))
