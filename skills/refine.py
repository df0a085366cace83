"""The guards that plan: refine an action where it starts, and again when the scene no longer fits its motion."""

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from planner.failure import RefinementFailure, SceneChanged
from planner.motion.motion_planner import MotionPlanner
from planner.refinement import Refinement
from sim.scene import SceneState
from skills.contact_guard import ContactGuard
from skills.context import ActionRun, SkillContext
from skills.payload import load_of
from skills.watching import Watch

MAX_REPEATS = 5
"""How often one action is refined anew, at most, because something moved."""

PATIENCE = 1.0
"""Seconds after which the arm counts as stopped, wherever it is."""


class Refine(Behaviour):
    """Refines the action against the scene as observed, the samples known to work first.

    At the head of a memory-less sequence it goes on watching: when an object of the action or something
    in the rest of its path has moved, it stops the arm and refines again. Thinking takes simulated time;
    meanwhile the arm holds.
    """

    def __init__(self, run: ActionRun, context: SkillContext, motion: MotionPlanner) -> None:
        super().__init__("refine")
        self._run, self._context, self._motion = run, context, motion
        self._repeats = 0
        self._forget()

    def _forget(self) -> None:
        self._outcome: Refinement | RefinementFailure | None = None
        self._scene: SceneState | None = None
        self._stopping_since: float | None = None
        self._ready_at = 0.0
        self._watch: Watch | None = None
        self._borne = ""

    def terminate(self, new_status: Status) -> None:
        if new_status == Status.INVALID:
            self._repeats = 0
            self._forget()

    def update(self) -> Status:
        if not self._context.is_watchful:
            self._bear_what_is_held()
            return Status.SUCCESS
        if self._watch is not None:
            changed = self._what_changed(self._watch)
            if changed is None:
                return Status.SUCCESS
            if self._repeats == MAX_REPEATS:
                return self._fail(SceneChanged(self._run.action, f"{changed}, for the {MAX_REPEATS + 1}th time"))
            self._repeats += 1
            self._context.report("refined_again", action=str(self._run.action), reason=changed)
            self._forget()
        return self._think()

    def _think(self) -> Status:
        context, now = self._context, self._context.observation.t
        if self._outcome is None:
            if self._stopping_since is None:
                self._stopping_since = now
                if not context.controller.finished:
                    context.controller.hold()
            if not context.controller.finished and now - self._stopping_since < PATIENCE:
                return Status.RUNNING
            gone = [arg for arg in self._run.action.args if self._is_gone(arg)]
            if gone:
                return self._fail(SceneChanged(self._run.action, f"{gone[0]} is gone"))
            self._scene = context.scene
            self._outcome, cost = context.refine(self._run.action)
            self._ready_at = now + cost
        if now < self._ready_at:
            return Status.RUNNING
        if isinstance(self._outcome, RefinementFailure):
            return self._fail(self._outcome)
        assert self._scene is not None
        self._run.refinement = self._outcome
        self._watch = Watch(self._motion, self._outcome, self._scene)
        self._bear_what_is_held()
        return Status.SUCCESS

    def _is_gone(self, name: str) -> bool:
        scene = self._context.scene
        return name in scene.scenario.bodies and name not in scene.poses

    def _bear_what_is_held(self) -> None:
        held = self._context.scene.held
        if held is None:
            self._context.controller.clear_payload()
            self._borne = ""
        elif held.name != self._borne:
            self._context.controller.set_payload(*load_of(self._context.scene, held.name))
            self._borne = held.name

    def _what_changed(self, watch: Watch) -> str | None:
        context = self._context
        phase = self._run.running(context.phase)
        if phase is None:
            return None
        blocked = watch.path_blocked(context.scene, phase, context.controller.time_in_reference)
        return watch.object_shifted(context.scene) or (blocked.reason if blocked else None)

    def _fail(self, failure: RefinementFailure | SceneChanged) -> Status:
        self._context.fail(failure)
        self.feedback_message = failure.reason
        return Status.FAILURE


class PathFree(ContactGuard):
    """Is the rest of the running motion still free, and until contact what it is for still there?"""

    def __init__(self, run: ActionRun, context: SkillContext, motion: MotionPlanner) -> None:
        super().__init__("path free?", run, context)
        self._motion = motion
        self._watch: Watch | None = None

    def terminate(self, new_status: Status) -> None:
        if new_status == Status.INVALID:
            self._watch = None

    def what_changed(self, refinement: Refinement) -> str | None:
        context = self._context
        if self._watch is None:
            self._watch = Watch(self._motion, refinement, context.scene)
        phase = self._run.running(context.phase)
        if phase is None:
            return None
        blocked = self._watch.path_blocked(context.scene, phase, context.controller.time_in_reference)
        if blocked is not None:
            return blocked.reason
        is_coming = phase.kind == "touch" and not context.controller.contact
        return self._watch.object_shifted(context.scene) if is_coming else None
