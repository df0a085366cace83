"""Finds ways of the hand, and how the free motion passes into the line after it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pinocchio import SE3

from planner.failure import MotionFailure
from planner.motion.answers import Asked, believed
from planner.motion.motion_planner import MotionPlanner
from planner.motion.passing import passing
from planner.motion.timing import haste
from planner.motion.trajectory import Trajectory
from planner.refinement import Pair
from sim.scene import SceneState
from skills.carrying import MAX_ACCELERATION, acceleration, carried
from skills.skill import Toolkit, Unfit
from skills.ways import Legs, Line, Way

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


def find_way(
    toolkit: Toolkit,
    waypoints: Sequence[SE3],
    scene: SceneState,
    lines_of: Callable[[Legs], Sequence[Line]],
    allowed: frozenset[Pair] = frozenset(),
) -> Way | MotionFailure | Unfit:
    """The first joint path through poses X_WG all of whose lines, and the free motion from scene.q, are free; one that
    is known already comes first.

    `allowed` pairs may touch during the free motion, which is as slow as what is held asks for. Every line is
    confirmed by the exact model as timed.
    """
    motion, known = toolkit.motion, toolkit.known
    again = known.find(motion, waypoints, scene, lines_of, allowed)
    if again is not None:
        return again
    failure: MotionFailure | None = None
    for legs in paths_through(toolkit, waypoints, scene):
        lines = lines_of(legs)
        checks = (motion.line_is_free(line.scene, line.path[: line.checked], line.allowed) for line in lines)
        failure = next((check for check in checks if check is not None), None)
        if failure:
            continue
        goals = [legs[0][0]]
        reach = believed(motion, motion.move(scene, goals, allowed), Asked(scene, scene.q, goals, allowed))
        if isinstance(reach, MotionFailure):
            failure = reach
            continue
        timed = [_timed(motion, line) for line in lines]
        failure = next((line for line in timed if isinstance(line, MotionFailure)), None)
        if failure is None:
            reach = carried(toolkit.robot, reach, scene.held)
            done = [line for line in timed if isinstance(line, Trajectory)]
            corner = 0.0
            for k, line in enumerate(lines):
                if line.is_entry:
                    reach, done[k], corner = entered(toolkit, scene, Entry(reach, line, done[k], allowed))
            way = Way(tuple(waypoints), scene, allowed, tuple(legs), tuple(lines), reach, tuple(done), corner)
            known.keep(way)
            return way
    return failure or Unfit("the arm can't follow the hand's path")


def _timed(motion: MotionPlanner, line: Line) -> Trajectory | MotionFailure:
    until = None if line.checked is None else line.path[line.checked - 1]
    answer = motion.timed_line(line.scene, line.path, line.speed, line.allowed, line.checked)
    return believed(motion, answer, Asked(line.scene, line.path[0], [line.path[-1]], line.allowed, until))


@dataclass(frozen=True)
class Entry:
    """A free motion, during which `allowed` pairs may touch, and the line after it, as timed."""

    reach: Trajectory
    line: Line
    timed: Trajectory
    allowed: frozenset[Pair]


def entered(toolkit: Toolkit, scene: SceneState, entry: Entry) -> tuple[Trajectory, Trajectory, float]:
    """The free motion and the line after it, without a stop between them if there is room to cut the corner, and the
    seconds of the line for which it is cut. Until then nothing but the free motion's own `allowed` pairs touch."""
    robot, motion, line = toolkit.robot, toolkit.motion, entry.line
    longest = MOST_OVERLAP * min(entry.reach.duration, entry.timed.duration)
    for overlap in dict.fromkeys(min(seconds, longest) for seconds in OVERLAPS):
        if overlap < LEAST_OVERLAP:
            break
        head, timed = passing(entry.reach, entry.timed, overlap)
        if haste(timed, robot) > 1.0 or acceleration(robot, timed, line.scene.held) > MAX_ACCELERATION:
            continue
        corner = motion.audit(scene, timed.until(overlap), entry.allowed)
        if corner is None and motion.audit(line.scene, timed, line.allowed) is None:
            return head, timed, overlap
    return entry.reach, entry.timed, 0.0
