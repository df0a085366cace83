"""A drag as it is carried out: does the object come along, and is it pressed harder where it doesn't?"""

from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from planner.failure import DragSlipped
from planner.motion.timing import time_line
from planner.motion.trajectory import Trajectory
from planner.refinement import Refinement
from sim.scene import SceneState
from skills.context import ActionRun, SkillContext
from skills.control.force import RAMP_RATE
from skills.control.reference import Reference
from skills.motions import Slide
from skills.pressing import Pressing
from skills.towing import harder

SLIP = 0.004
"""Metres that the fingertips may slip on the object before it is pressed harder."""

MOST_SLIP = 0.035
"""Metres that they may slip in all: the object would end too far from where it was meant to."""

MOST_RAISES = 2
"""How often one drag is pressed harder: each time costs about a centimetre of the hand's reserve."""

BRAKING = 0.1
"""Seconds in which the hand comes to rest where it slips."""

STEADY = 0.15
"""Seconds after the force was ramped up before the hand moves on."""

KNOT = 0.02
"""Seconds between the configurations of what is left of a path."""


Predict = Callable[[SceneState, Refinement], SceneState]
"""The scene after a refined action, as a skill's own `predict` gives it."""


class Tow(Slide):
    """Follows the drag's path until the object has come to where `predict` has it, pressed as the sample says at
    first. Told to press harder it stops, does so, and goes on from there."""

    def __init__(self, name: str, run: ActionRun, context: SkillContext, predict: Predict) -> None:
        super().__init__(name, run, context)
        self._predict = predict

    def begin(self) -> None:
        refinement, scene = self._run.refinement, self._context.scene
        assert refinement is not None
        name = self._run.action.args[0]
        self.pressing: Pressing = refinement.sample.pressing
        self._rest: Trajectory | None = None
        self._resume_at = 0.0
        self._is_stopping = False
        self._p_WO_end: np.ndarray | None = None
        if name in scene.poses:
            self._p_WO_end = self._predict(scene, refinement).poses[name].translation
            way = self._p_WO_end - scene.poses[name].translation
            self._along = way / max(float(np.linalg.norm(way)), 1e-9)
        super().begin()

    @property
    def is_gathering(self) -> bool:
        """Does the hand stand still while the force rises?"""
        return self._rest is not None

    def press_harder(self) -> bool:
        """Stop, and press harder from now on. False if that would be more than the limit."""
        following = harder(self.pressing)
        if following is None:
            return False
        context = self._context
        path, stop = self._braking()
        rest = np.array([path.at(t)[0] for t in _times(stop, path.duration)])
        wait = BRAKING + (following.force - self.pressing.force) / RAMP_RATE + STEADY
        self.pressing = following
        self._rest = time_line(context.robot, rest, following.speed)
        self._resume_at = context.observation.t + wait
        self._press_along(Trajectory.standstill(rest[0], wait))
        context.report("pressed_harder", action=str(self._run.action), force=following.force)
        return True

    def update(self) -> Status:
        status = super().update()
        if status == Status.FAILURE or self._is_stopping:
            return status
        if self._rest is None:
            if status == Status.RUNNING and self._has_come():
                path, stop = self._braking()
                self._is_stopping = True
                self._press_along(Trajectory.standstill(path.at(stop)[0], BRAKING))
            return status
        if self._context.observation.t >= self._resume_at:
            self._press_along(self._rest)
            self._rest = None
            self._since = self._context.observation.t
        return Status.RUNNING

    def _has_come(self) -> bool:
        """Will the object be where it was to be when the hand has come to rest?"""
        X_WO = self._context.scene.poses.get(self._run.action.args[0])
        if X_WO is None or self._p_WO_end is None:
            return False
        left = float((self._p_WO_end - X_WO.translation) @ self._along)
        late = _lateness(self._context, self._run.action.args[0])
        return left <= self.pressing.speed * (BRAKING / 2 + late)

    def _braking(self) -> tuple[Trajectory, float]:
        """The path that is followed, and the time on it at which the hand can come to rest."""
        controller = self._context.controller
        path = controller.reference.trajectory if controller.reference is not None else self.phase.trajectory
        return path, min(controller.time_in_reference + BRAKING / 2, path.duration)

    def _press_along(self, trajectory: Trajectory) -> None:
        pressing, context = self.pressing, self._context
        stiffness = np.array(pressing.stiffness)
        context.controller.follow(
            Reference(trajectory, context.contact_mode, stiffness, pressing.force, damping=pressing.damping)
        )


class KeepPressing(Behaviour):
    """Writes into the sample how it was pressed in the end: what worked is tried first the next time."""

    def __init__(self, tow: Tow, run: ActionRun) -> None:
        super().__init__("keep how it was pressed")
        self._tow, self._run = tow, run

    def update(self) -> Status:
        refinement = self._run.refinement
        assert refinement is not None
        sample = replace(refinement.sample, pressing=self._tow.pressing)
        self._run.refinement = replace(refinement, sample=sample)
        return Status.SUCCESS


class TakenAlong(Behaviour):
    """Does the object come along with the fingertips? Where they slip, the drag is told to press harder, a bounded
    number of times; then it fails.

    Looked at while the drag's `tow` runs: a fingertip that stays where it came down on the object doesn't slip,
    however the object turns under it.
    """

    def __init__(self, tow: Tow, run: ActionRun, context: SkillContext) -> None:
        super().__init__("taken along?")
        self._tow, self._run, self._context = tow, run, context
        self._forget()

    def _forget(self) -> None:
        self._began: np.ndarray | None = None
        self._forgiven = 0.0
        self._raises = 0
        self._hand: deque[tuple[float, np.ndarray]] = deque()

    def terminate(self, new_status: Status) -> None:
        if new_status == Status.INVALID:
            self._forget()

    def update(self) -> Status:
        if self._tow.status != Status.RUNNING:
            self._forget()
            return Status.SUCCESS
        if self._run.action.args[0] not in self._context.scene.poses:
            return Status.SUCCESS
        tip = self._tip()
        if self._began is None:
            self._began = tip
        slip = float(np.linalg.norm(tip - self._began))
        if self._tow.is_gathering:
            self._forgiven = max(self._forgiven, slip)
        if slip > MOST_SLIP:
            return self._slipped(f"the fingertips slipped {slip * 1000:.0f} mm on it")
        if slip - self._forgiven > SLIP:
            self._forgiven = slip
            if self._raises == MOST_RAISES:
                return self._slipped(f"the fingertips slip on it, even at {self._tow.pressing.force:.0f} N")
            self._raises += 1
            if not self._tow.press_harder():
                return self._slipped("the fingertips slip on it at the greatest force allowed")
        return Status.SUCCESS

    def _tip(self) -> np.ndarray:
        """Where the fingertips are on the object (3,), in its frame, whatever their height; in metres."""
        context, name = self._context, self._run.action.args[0]
        X_WO = context.scene.poses[name]
        up_O, tip_O = X_WO.rotation[2], X_WO.actInv(self._hand_when_seen(name))
        return tip_O - float(up_O @ tip_O) * up_O

    def _hand_when_seen(self, name: str) -> np.ndarray:
        """Where the tool centre was (3,) in W when the object was seen as it is believed now."""
        context = self._context
        now = context.observation.t
        self._hand.append((now, context.robot.X_WG(context.observation.q).translation.copy()))
        then = now - _lateness(context, name)
        while len(self._hand) > 2 and self._hand[1][0] <= then:
            self._hand.popleft()
        (t_a, p_a), (t_b, p_b) = self._hand[0], self._hand[min(1, len(self._hand) - 1)]
        share = 0.0 if t_b <= t_a else min(max((then - t_a) / (t_b - t_a), 0.0), 1.0)
        return p_a + share * (p_b - p_a)

    def _slipped(self, reason: str) -> Status:
        action, refinement = self._run.action, self._run.refinement
        sample = refinement.sample if refinement else None
        self._context.fail(DragSlipped(action, f"{action.args[0]} lagged behind the hand: {reason}", sample))
        self.feedback_message = reason
        return Status.FAILURE


def _lateness(context: SkillContext, name: str) -> float:
    """Seconds since an object was seen as it is believed now."""
    now = context.observation.t
    return now - context.observation.seen_at.get(name, now)


def _times(start: float, end: float) -> np.ndarray:
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / KNOT)) + 1))
