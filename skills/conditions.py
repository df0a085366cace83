"""Questions that a skill's tree asks of the observed scene while it runs."""

from collections.abc import Callable

import numpy as np
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from planner.failure import EffectMissing, GraspSlipped, SceneChanged
from planner.task.facts import place_of
from sim.scene import Held, SceneState, is_on_floor, pose_distance
from skills.context import ActionRun, SkillContext
from skills.watching import Load

SLIP_DISTANCE = 0.02
SLIP_ANGLE = np.radians(20.0)
SUNK_FOR = 0.06
"""Seconds for which something must be seen deeper in the hand: poses are noisy, and this limit is near."""

EFFECT_TIME = 1.5
"""Simulated seconds that an effect may take to show (things fall, roll and come to rest)."""


class HandHolds(Behaviour):
    """Is it still in the hand, where it was when the guard began to look? `name` None: whatever is held then.

    turn: rad by which it may have turned there; sink: metres by which it may have gone deeper into the hand.
    """

    def __init__(
        self,
        name: str | None,
        run: ActionRun,
        context: SkillContext,
        turn: float = SLIP_ANGLE,
        sink: float = SLIP_DISTANCE,
    ) -> None:
        super().__init__("still held?" if name is None else f"{name} held?")
        self._expected = name
        self._run, self._context = run, context
        self._turn, self._sink = turn, sink
        self._grip: Held | None = None
        self._sunk_since: float | None = None

    def update(self) -> Status:
        held = self._context.scene.held
        name = self._expected or (self._grip.name if self._grip else None)
        if held is None or (name is not None and held.name != name):
            return self._slipped(f"{name or 'the tool'} left the hand")
        if self._grip is None or self._grip.name != held.name:
            self._grip = held
        distance, angle = pose_distance(self._grip.X_GO, held.X_GO)
        sunk = float(self._grip.X_GO.translation[2] - held.X_GO.translation[2])
        if distance > SLIP_DISTANCE or angle > self._turn or self._stays_sunk(sunk):
            return self._slipped(f"{held.name} slipped {distance * 1000:.0f} mm, {np.degrees(angle):.0f}° in the hand")
        return Status.SUCCESS

    def _stays_sunk(self, sunk: float) -> bool:
        now = self._context.observation.t
        if sunk <= self._sink:
            self._sunk_since = None
        elif self._sunk_since is None:
            self._sunk_since = now
        return self._sunk_since is not None and now - self._sunk_since >= SUNK_FOR

    def _slipped(self, reason: str) -> Status:
        sample = self._run.refinement.sample if self._run.refinement else None
        self._context.fail(GraspSlipped(self._run.action, reason, sample))
        self.feedback_message = reason
        self._grip = self._sunk_since = None
        return Status.FAILURE


class Unladen(Behaviour):
    """Has nothing come to stand on it since the guard began to look? If so, the fingers let go of it."""

    def __init__(self, name: str, run: ActionRun, context: SkillContext) -> None:
        super().__init__(f"nothing on {name}?")
        self._name = name
        self._run, self._context = run, context
        self._load: Load | None = None

    def terminate(self, new_status: Status) -> None:
        if new_status == Status.INVALID:
            self._load = None

    def update(self) -> Status:
        context = self._context
        if not context.is_watchful:
            return Status.SUCCESS
        if self._load is None:
            self._load = Load([self._name], context.scene)
        come = self._load.come(context.scene)
        if come is None:
            return Status.SUCCESS
        if context.phase is not None:
            context.grip.open_to(context.phase.opening)
        sample = self._run.refinement.sample if self._run.refinement else None
        context.fail(SceneChanged(self._run.action, come, sample))
        self.feedback_message = come
        return Status.FAILURE


class Achieved(Behaviour):
    """Did the action bring about what it was for? Things get a moment to come to rest."""

    def __init__(self, effect: Callable[[SceneState], bool], run: ActionRun, context: SkillContext) -> None:
        super().__init__("achieved?")
        self._effect = effect
        self._run, self._context = run, context
        self._since = 0.0

    def initialise(self) -> None:
        self._since = self._context.observation.t

    def update(self) -> Status:
        context, action = self._context, self._run.action
        if self._effect(context.scene):
            return Status.SUCCESS
        if context.observation.t - self._since < EFFECT_TIME:
            return Status.RUNNING
        name = action.args[0]
        sample = self._run.refinement.sample if self._run.refinement else None
        reason = f"{name} did not come to where it should, it is {_whereabouts(context.scene, name)}"
        context.fail(EffectMissing(action, reason, sample))
        self.feedback_message = reason
        return Status.FAILURE


def _whereabouts(scene: SceneState, name: str) -> str:
    if scene.held is not None and scene.held.name == name:
        return "in the hand"
    if name not in scene.poses:
        return "nowhere to be seen"
    place = place_of(scene, name)
    if place is None:
        return "on the floor" if is_on_floor(scene, name) else "in none of the known places"
    return "on the table" if place == "table" else f"in {place}"
