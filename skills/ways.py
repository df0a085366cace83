"""Ways of the hand: a free motion to where its lines begin, the lines themselves, and how one passes into the other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pinocchio import SE3

from planner.failure import MotionFailure
from planner.motion.passing import passing
from planner.motion.timing import haste
from planner.motion.trajectory import Trajectory
from planner.refinement import Pair
from sim.scene import SceneState
from skills.carrying import MAX_ACCELERATION, acceleration, carried
from skills.skill import Toolkit, Unfit

MAX_PATHS = 4
"""Joint paths (arm branches) of one sample that are tried, best first."""

AMPLE = 0.2
"""Rad from every joint limit beyond which a path is as good as any other."""

OVERLAPS = (0.4, 0.2)
"""Seconds before the end of a free motion at which the line after it begins, the first that is free."""

MOST_OVERLAP = 1 / 3
"""Of either motion's duration."""

LEAST_OVERLAP = 0.05
"""Seconds below which it isn't worth while."""


def paths_through(toolkit: Toolkit, waypoints: Sequence[SE3], scene: SceneState) -> list[list[np.ndarray]]:
    """Joint paths through poses X_WG of the hand, cut at them into legs (n,7), best first.

    Those clear of the joint limits come first, among them those that begin near the arm and near
    its start posture: changes of posture on the way would tumble what is held.
    """
    robot, home = toolkit.robot, scene.scenario.robot.q0

    def rank(legs: list[np.ndarray]) -> tuple[bool, float]:
        path = np.concatenate(legs)
        margin = float(np.minimum(path - robot.q_min, robot.q_max - path).min())
        from_here, from_home = (float(np.max(np.abs(path[0] - q) / robot.v_max)) for q in (scene.q, home))
        return margin < AMPLE, from_here + from_home

    return sorted(toolkit.motion.legs(waypoints, home), key=rank)[:MAX_PATHS]


Legs = Sequence[np.ndarray]
"""A joint path cut into legs (n,7) at the hand's waypoints."""


@dataclass(frozen=True)
class Line:
    """A straight stretch of the hand near contact: joint path (n,7) in `scene` at `speed` (m/s), and what may touch.

    What lies beyond the first `checked` configurations is sought, not meant to be reached (the way
    down to a surface goes on below it), so it is not checked. `is_entry`: the free motion passes into this line
    without a stop, where that is free.
    """

    scene: SceneState
    path: np.ndarray
    speed: float
    allowed: frozenset[Pair]
    checked: int | None = None
    is_entry: bool = False


@dataclass(frozen=True)
class Way:
    """A free motion to where the first leg begins, and the lines as timed. Where the motion ends moving, the entry
    goes on from there."""

    reach: Trajectory
    lines: tuple[Trajectory, ...]


def find_way(
    toolkit: Toolkit,
    waypoints: Sequence[SE3],
    scene: SceneState,
    lines_of: Callable[[Legs], Sequence[Line]],
    allowed: frozenset[Pair] = frozenset(),
) -> "Way | MotionFailure | Unfit":
    """The first joint path through poses X_WG all of whose lines, and the free motion from scene.q, are free.

    `allowed` pairs may touch during the free motion, which is as slow as what is held asks for. Every line is
    confirmed by the exact model as timed.
    """
    motion = toolkit.motion
    failure: MotionFailure | None = None
    for legs in paths_through(toolkit, waypoints, scene):
        lines = lines_of(legs)
        checks = (motion.line_is_free(line.scene, line.path[: line.checked], line.allowed) for line in lines)
        failure = next((check for check in checks if check is not None), None)
        if failure:
            continue
        reach = motion.move(scene, [legs[0][0]], allowed)
        if isinstance(reach, MotionFailure):
            failure = reach
            continue
        timed = [motion.timed_line(line.scene, line.path, line.speed, line.allowed, line.checked) for line in lines]
        failure = next((line for line in timed if isinstance(line, MotionFailure)), None)
        if failure is None:
            reach = carried(toolkit.robot, reach, scene.held)
            done = [line for line in timed if isinstance(line, Trajectory)]
            for k, line in enumerate(lines):
                if line.is_entry:
                    reach, done[k] = entered(toolkit, reach, line, done[k], allowed)
            return Way(reach, tuple(done))
    return failure or Unfit("the arm can't follow the hand's path")


def entered(
    toolkit: Toolkit, reach: Trajectory, line: Line, timed: Trajectory, allowed: frozenset[Pair]
) -> tuple[Trajectory, Trajectory]:
    """The free motion and the line after it, without a stop between them if there is room to cut the corner: while
    the free motion lasts nothing but its own `allowed` pairs touch."""
    robot, motion = toolkit.robot, toolkit.motion
    longest = MOST_OVERLAP * min(reach.duration, timed.duration)
    for overlap in dict.fromkeys(min(seconds, longest) for seconds in OVERLAPS):
        if overlap < LEAST_OVERLAP:
            break
        head, entry = passing(reach, timed, overlap)
        if haste(entry, robot) > 1.0 or acceleration(robot, entry, line.scene.held) > MAX_ACCELERATION:
            continue
        corner = entry.until(overlap)
        if motion.audit(line.scene, corner, allowed) is None and motion.audit(line.scene, entry, line.allowed) is None:
            return head, entry
    return reach, timed
