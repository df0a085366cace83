"""Whether what a motion planner answers is a motion: whichever is wired in, its word alone is not taken."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.failure import MotionFailure
from planner.motion.clearance import DEEPEST
from planner.motion.motion_planner import MotionPlanner
from planner.motion.timing import haste
from planner.motion.trajectory import Trajectory
from planner.refinement import Pair
from sim.scene import SceneState

SAME = 1e-4
"""Rad or rad/s by which a motion may begin and end elsewhere than asked, or not at rest."""

HURRY = 1e-6
"""Part of the joints' velocity and acceleration limits by which rounding may pass them."""

BETWEEN = 8
"""Spots at which each piece of an unknown motion is looked at: between its knots it may bulge."""


@dataclass(frozen=True)
class Asked:
    """A motion in `scene` from `start` (7,) to one of the goals (7,), in which `allowed` pairs may touch; it is to be
    free up to where it passes `until` (7,), None: all the way."""

    scene: SceneState
    start: np.ndarray
    goals: Sequence[np.ndarray]
    allowed: frozenset[Pair]
    until: np.ndarray | None = None


def believed(motion: MotionPlanner, answer: Any, asked: Asked) -> Trajectory | MotionFailure:
    """The planner's answer if it is a motion such as was asked for, or a failure; else a failure that says so.

    What the exact model has confirmed just now isn't looked at by it again.
    """
    if isinstance(answer, MotionFailure):
        return answer
    wrong = _flaw(motion, answer, asked)
    return answer if wrong is None else MotionFailure(f"the motion planner's answer is no motion: {wrong}")


def _flaw(motion: MotionPlanner, answer: Any, asked: Asked) -> str | None:
    if not isinstance(answer, Trajectory):
        return f"it is of type {type(answer).__name__}"
    if not all(np.isfinite(array).all() for array in (answer.times, answer.q, answer.v)):
        return "its numbers are not finite"
    if np.abs(answer.start - asked.start).max() > SAME:
        return "it does not begin where the arm is"
    if min((np.abs(answer.end - goal).max() for goal in asked.goals), default=np.inf) > SAME:
        return "it does not end at a goal"
    if np.abs(answer.v[[0, -1]]).max() > SAME:
        return "it does not begin and end at rest"
    if haste(answer, motion.robot) > 1.0 + HURRY:
        return "it is faster than the joints"
    if motion.has_confirmed(asked.scene, answer, asked.allowed):
        return None
    failure = motion.audit(asked.scene, _sampled(answer, asked.until), asked.allowed, deepest=DEEPEST)
    return None if failure is None else failure.reason


def _sampled(trajectory: Trajectory, until: np.ndarray | None) -> Trajectory:
    """The same motion with more knots, up to where it comes nearest to `until`."""
    if len(trajectory.times) < 2:
        return trajectory
    since = trajectory.times - trajectory.times[0]
    shares = np.arange(BETWEEN) / BETWEEN
    times = np.append((since[:-1, None] + np.diff(since)[:, None] * shares).ravel(), since[-1])
    q, v, _ = (np.array(rows) for rows in zip(*(trajectory.at(float(t)) for t in times), strict=True))
    last = len(times) if until is None else int(np.argmin(np.abs(q - until).max(axis=1))) + 1
    return Trajectory(times[:last], q[:last], v[:last])
