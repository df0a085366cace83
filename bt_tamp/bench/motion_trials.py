"""One query of `bench motion` solved in several ways: by every planner through OMPL, as the machine does it, wholly
compiled, and by the `pybullet-planning` package."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bt_tamp.bench.compiled_rrt import plan_compiled
from bt_tamp.bench.motion_queries import MotionQuery
from planner.failure import MotionFailure
from planner.motion.clearance import MotionSettings
from planner.motion.collision import JOINT_STEP, FastChecker, part_names, self_collision_pairs
from planner.motion.motion_planner import Ends, MotionPlanner
from planner.motion.ompl_ import PathSettings, Query, path_length, plan_path
from planner.motion.shortcut import shortened
from planner.motion.world import Margins, obstacles
from sim.robot import RobotModel
from sim.scene import SceneState

MAX_CHECKS = 4000
"""Configurations that a search may look at, as many as a skill's; planners that better their path use them all."""

STEP = MotionSettings().step


@dataclass(frozen=True)
class Trial:
    """One search: CPU seconds, of finding and of shortening, and the path's length in rad before and after (NaN: no
    path)."""

    planner: str
    found_s: float
    short_s: float
    length: float
    short: float

    @property
    def is_found(self) -> bool:
        return not math.isnan(self.length)


@dataclass(frozen=True)
class Move:
    """As the machine does it: CPU seconds of the shortened path from nothing, and of the whole motion, timed and
    audited; length of the motion in rad; does the exact model find it free once more?"""

    way_s: float
    move_s: float
    length: float
    is_free: bool


class Arena:
    """A query with its collision model. `ends` is None if the query is hopeless as it stands."""

    def __init__(self, query: MotionQuery) -> None:
        self.query, self.scene = query, query.scene
        placed = query.scene.scenario.robot
        self.robot = RobotModel(placed.model, placed.X_WB)
        self._limits = np.stack([self.robot.q_min, self.robot.q_max])
        found = MotionPlanner(self.robot).ends(query.scene, [query.goal], query.allowed)
        self.ends: Ends | None = None if isinstance(found, MotionFailure) else found

    @property
    def margins(self) -> Margins:
        """What is kept between robot and scene. Raises ValueError for a hopeless query."""
        if self.ends is None:
            raise ValueError(f"{self.query.name}: start or goal collides")
        return self.ends.margins

    def checker(self) -> FastChecker:
        """A fresh fast model."""
        return FastChecker(self.robot, self.scene, self.margins)

    def is_solvable(self) -> bool:
        """Are start and goal free by the fast model, with which all plan?"""
        return self.ends is not None and all(self.checker().is_free(q) for q in (self.scene.q, self.query.goal))

    def is_straight(self) -> bool:
        """Is the straight edge free?"""
        return self.checker().edge_is_free(self.scene.q, self.query.goal)

    def question(self, seed: int, max_checks: int = MAX_CHECKS) -> Query:
        """The query for a planner."""
        return Query(self.scene.q, [self.query.goal], self._limits, seed, max_checks)


def search(arena: Arena, planner: str, seed: int) -> Trial:
    """One planner through OMPL, no straight edge tried before."""
    checker = arena.checker()
    settings = PathSettings(planner, restarts=5 if planner == "best-of-n-RRT" else 1)
    started = time.thread_time()
    path = plan_path(arena.question(seed), checker, settings)
    found = time.thread_time()
    if path is None:
        return Trial(planner, found - started, 0.0, math.nan, math.nan)
    short = shortened(path, checker)
    return Trial(planner, found - started, time.thread_time() - found, path_length(path), path_length(short))


def compiled(arena: Arena, seed: int) -> Trial:
    """Bidirectional RRT and shortcuts in compiled code: what no more than Python and OMPL could be saved."""
    checker = arena.checker()
    started = time.thread_time()
    path = plan_compiled(checker, arena.question(seed), STEP)
    spent = time.thread_time() - started
    if path is None:
        return Trial("compiled", spent, 0.0, math.nan, math.nan)
    return Trial("compiled", spent, 0.0, path_length(path.found), path_length(path.short))


def move(arena: Arena, seed: int) -> Move:
    """As a skill asks for it while a plan is refined: one thing has been moved since the query before."""
    query, planner = arena.query, MotionPlanner(arena.robot, seed)
    started = time.thread_time()
    planner.way(_anew(query.scene), [query.goal], query.allowed)
    way_s = time.thread_time() - started
    # The same query number, so the same path.
    planner = MotionPlanner(arena.robot, seed)
    started = time.thread_time()
    outcome = planner.move(_anew(query.scene), [query.goal], query.allowed)
    move_s = time.thread_time() - started
    if isinstance(outcome, MotionFailure):
        return Move(way_s, move_s, math.nan, False)
    audit = MotionPlanner(arena.robot).audit(query.scene, outcome, query.allowed)
    return Move(way_s, move_s, outcome.length, audit is None)


def _anew(scene: SceneState) -> SceneState:
    """The same scene, the first thing in it put where it is: what was known of it is not known of this one."""
    if not scene.poses:
        return replace(scene)
    name, X_WO = next(iter(scene.poses.items()))
    return scene.moved(name, X_WO.copy())


class _Until:
    """A collision model that counts as spent after so many seconds of CPU time."""

    def __init__(self, inner: FastChecker, seconds: float) -> None:
        self._inner, self._end = inner, time.thread_time() + seconds

    @property
    def checks(self) -> int:
        return self._inner.checks if time.thread_time() < self._end else 2**60

    def is_free(self, q: np.ndarray) -> bool:
        """See `CollisionChecker`."""
        return self._inner.is_free(q)

    def edge_is_free(self, qa: np.ndarray, qb: np.ndarray) -> bool:
        """See `CollisionChecker`."""
        return self._inner.edge_is_free(qa, qb)


def best_length(arena: Arena, seconds: float) -> float:
    """Length in rad of the best path that AORRTC finds in so many CPU seconds; of the straight edge if it is free."""
    if arena.is_straight():
        return path_length(np.stack([arena.scene.q, arena.query.goal]))
    checker = _Until(arena.checker(), seconds)
    path = plan_path(arena.question(0, 2**40), checker, PathSettings("AORRTC", restarts=1))
    return math.nan if path is None else path_length(path)


def watched(arena: Arena) -> Iterator[tuple[str, str, float]]:
    """The pairs that the fast model looks at, with their margins in metres."""
    parts = part_names(arena.robot, arena.scene.held)
    names = tuple(dict.fromkeys(obstacle.name for obstacle in obstacles(arena.scene)))
    table = arena.margins.table(parts, names)
    for i, part in enumerate(parts[1:], 1):
        yield from ((part, name, float(table[i, k])) for k, name in enumerate(names) if table[i, k] > -np.inf)
    own = self_collision_pairs(parts)
    for pair, margin in zip(own, arena.margins.within_robot([frozenset(pair) for pair in own]), strict=True):
        if margin > -np.inf:
            yield *pair, float(margin)


def by_pybullet(arena: Arena, seeds: range) -> list[Trial]:
    """The `pybullet-planning` package with the same URDF, pairs, margins and resolution. Raises ImportError."""
    from sim.pybullet_planning_ import PybulletPlanning

    engine = PybulletPlanning(arena.scene, arena.robot, watched(arena), JOINT_STEP)
    trials = []
    try:
        for seed in seeds:
            started = time.thread_time()
            path = engine.plan(arena.scene.q, arena.query.goal, seed)
            length = math.nan if path is None else path_length(path)
            trials.append(Trial("pybullet-planning", time.thread_time() - started, 0.0, length, length))
    finally:
        engine.close()
    return trials
