"""What a way of the hand is, and a memory for ways, so that an action planned again costs only what has changed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pinocchio import SE3

from planner.motion.clearance import DEEPEST
from planner.motion.motion_planner import MotionPlanner
from planner.motion.trajectory import Trajectory
from planner.refinement import Pair
from sim.scene import SceneState, pose_distance

SAME = 1e-4
"""Metres or rad by which two poses, configurations (in any joint) or openings may differ and count as the same: a tenth
of the margin that timed motions keep."""

MOST = 200
"""Ways that are remembered, the latest."""


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
    """A free motion to where the first leg begins, and the lines as timed. Where the motion ends moving, the line that
    is its entry goes on from there, and cuts the corner for `corner` seconds.

    It leads through poses X_WG in `scene` along the legs, and `allowed` pairs may touch during the free motion.
    """

    waypoints: tuple[SE3, ...]
    scene: SceneState
    allowed: frozenset[Pair]
    legs: tuple[np.ndarray, ...]
    lines: tuple[Line, ...]
    reach: Trajectory
    timed: tuple[Trajectory, ...]
    corner: float = 0.0


class KnownWays:
    """The ways found last. One that is sought again, with the arm and the hand as they were, is taken again if what has
    moved since, or is new, is nowhere in its way by the exact model."""

    def __init__(self) -> None:
        self._ways: list[Way] = []

    def keep(self, way: Way) -> None:
        """Remember a way, and forget the oldest."""
        self._ways = [way, *self._ways[: MOST - 1]]

    def find(
        self,
        motion: MotionPlanner,
        waypoints: Sequence[SE3],
        scene: SceneState,
        lines_of: Callable[[Legs], Sequence[Line]],
        allowed: frozenset[Pair],
    ) -> Way | None:
        """A way found earlier that still is one, for what `find_way` is asked for."""
        for way in self._ways:
            if not _is_same_hand(way.scene, scene) or not _are_same(way.waypoints, waypoints) or way.allowed != allowed:
                continue
            lines = tuple(lines_of(way.legs))
            if list(map(_manner, lines)) != list(map(_manner, way.lines)):
                continue
            moved = _moved(way.scene, scene)
            if moved is not None and (not moved or _is_free(motion, way, scene, lines, moved)):
                return way
        return None


def _is_free(motion: MotionPlanner, way: Way, scene: SceneState, lines: Sequence[Line], moved: frozenset[str]) -> bool:
    """Is nothing of what has moved in the way?"""
    if motion.audit(scene, way.reach, way.allowed, only=moved, deepest=DEEPEST) is not None:
        return False
    for line, timed in zip(lines, way.timed, strict=True):
        if line.is_entry and way.corner and motion.audit(scene, timed.until(way.corner), way.allowed, only=moved):
            return False
        if line.checked is None:
            failure = motion.audit(line.scene, timed, line.allowed, only=moved, deepest=DEEPEST)
        else:
            failure = motion.line_is_free(line.scene, line.path[: line.checked], line.allowed)
        if failure is not None:
            return False
    return True


def _is_same_hand(before: SceneState, now: SceneState) -> bool:
    """Is the arm where it was, with the hand as open, holding the same in the same way?"""
    if np.abs(before.q - now.q).max() > SAME or abs(before.opening - now.opening) > SAME:
        return False
    if before.held is None or now.held is None:
        return before.held is now.held
    return before.held.name == now.held.name and _are_same([before.held.X_GO], [now.held.X_GO])


def _are_same(before: Sequence[SE3], now: Sequence[SE3]) -> bool:
    return len(before) == len(now) and all(max(pose_distance(*both)) <= SAME for both in zip(before, now, strict=True))


def _manner(line: Line) -> tuple[int, float, frozenset[Pair], int | None, bool]:
    """What is asked of a line, but for its surroundings."""
    return len(line.path), line.speed, line.allowed, line.checked, line.is_entry


def _moved(before: SceneState, now: SceneState) -> frozenset[str] | None:
    """Names of what is elsewhere now, or new; None if that is not all that has changed."""
    then, here = before.scenario, now.scenario
    if then.table is not here.table or then.fixtures is not here.fixtures or then.robot is not here.robot:
        return None
    held = now.held.name if now.held else ""
    bodies = {
        n
        for n, X in now.poses.items()
        if n != held and (n not in before.poses or not _are_same([before.poses[n]], [X]))
    }
    regions = {n for n, region in here.regions.items() if then.regions.get(n) is not region}
    return frozenset(bodies | regions)
