"""Weighing what was grasped: is it what the hand was meant to hold?"""

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from planner.failure import GraspMissed
from sim.plant import Observation
from skills.context import ActionRun, SkillContext
from skills.control.payload import estimate_payload

READINGS = 5
TOLERANCE = 0.06
"""Kilograms by which the weight may always differ."""

SHARE = 0.5
"""Share of the declared mass by which the weight may differ."""


class Weigh(Behaviour):
    """Estimates the load from a few readings of the wrist sensor, at rest, and compares it with what was expected."""

    def __init__(self, run: ActionRun, context: SkillContext) -> None:
        super().__init__("weigh")
        self._run, self._context = run, context
        self._readings: list[Observation] = []

    def initialise(self) -> None:
        self._readings = []

    def update(self) -> Status:
        self._readings.append(self._context.observation)
        if len(self._readings) < READINGS:
            return Status.RUNNING
        name = self._run.action.args[0]
        expected = self._context.scene.scenario.bodies[name].mass
        mass, _ = estimate_payload(self._context.robot, self._readings)
        if abs(mass - expected) <= max(TOLERANCE, SHARE * expected):
            return Status.SUCCESS
        reason = f"what was grasped weighs {mass * 1000:.0f} g, {name} should weigh {expected * 1000:.0f} g"
        sample = self._run.refinement.sample if self._run.refinement else None
        self._context.fail(GraspMissed(self._run.action, reason, sample))
        self.feedback_message = reason
        return Status.FAILURE
