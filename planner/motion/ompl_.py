"""Joint-space planning by OMPL over one of our collision checkers.

A query is reproducible: its random numbers are seeded anew, and its budget is counted in checks of
the checker. The budget ends a planner through the condition's own `terminate`, called from the
edge check: a Python condition would be asked between, at a cost, and from other threads.
"""

import atexit
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from ompl import base, geometric, util

from planner.motion.checking import CollisionChecker

_PLANNERS: dict[str, Callable[[base.SpaceInformation], Any]] = {
    "RRTConnect": geometric.RRTConnect,
    "RRT": geometric.RRT,
    "best-of-n-RRT": geometric.RRT,
    "RRTstar": geometric.RRTstar,
    "InformedRRTstar": geometric.InformedRRTstar,
    "BITstar": geometric.BITstar,
    "AORRTC": geometric.AORRTC,
    "PRMstar": geometric.PRMstar,
}

PLANNERS = tuple(_PLANNERS)
"""Names that `PathSettings.planner` may have."""


@dataclass(frozen=True)
class PathSettings:
    """How paths are searched.

    planner: one of PLANNERS. goal_bias: share of samples that are the goal (planners that have it).
    restarts: how often the search begins, each time with an equal part of the budget, until a path is
    found; "best-of-n-RRT" uses them all and keeps the shortest path. step: longest edge of a
    tree in rad (planners that have a range).
    """

    planner: str = "RRTConnect"
    goal_bias: float = 0.05
    restarts: int = 3
    step: float = 1.2

    def __post_init__(self) -> None:
        if self.planner not in _PLANNERS:
            raise ValueError(f"unknown motion planner {self.planner!r}, known: {', '.join(PLANNERS)}")
        if self.restarts < 1:
            raise ValueError(f"motion planner's restarts {self.restarts}, at least 1 expected")


@dataclass(frozen=True)
class Query:
    """From start (7,) to any of the goals (7,), all free of collision; `limits` (2,7) bound the search; `seed` decides
    every random choice; `max_checks` configurations may be looked at."""

    start: np.ndarray
    goals: Sequence[np.ndarray]
    limits: np.ndarray
    seed: int
    max_checks: int


def plan_path(
    query: Query, checker: CollisionChecker, settings: PathSettings, is_hopeless: Callable[[], bool] | None = None
) -> np.ndarray | None:
    """Waypoints (n,7) of a collision-free polyline from the start to one of the goals, or None within the budget.

    is_hopeless is asked before the search begins again; if so, it doesn't.
    """
    util.setLogLevel(util.LogLevel.LOG_NONE)
    found: list[np.ndarray] = []
    for run in range(settings.restarts):
        if run > 0 and not found and is_hopeless is not None and is_hopeless():
            break
        path = _search(query, checker, settings, query.seed + run, query.max_checks // settings.restarts)
        if path is not None and settings.planner != "best-of-n-RRT":
            return path
        found += [] if path is None else [path]
    return min(found, key=path_length, default=None)


def path_length(path: np.ndarray) -> float:
    """Length in rad of a polyline (n,7), Euclidean over the joints."""
    steps = path[1:] - path[:-1]
    return float(np.sqrt((steps * steps).sum(axis=1)).sum())


class _Edges(base.MotionValidator):
    """Asks the checker about configurations and whole edges, and ends the search when its budget is spent."""

    def __init__(self, information: base.SpaceInformation) -> None:
        super().__init__(information)

    def begin(self, checker: CollisionChecker, max_checks: int, end: base.PlannerTerminationCondition) -> None:
        """From now on ask this checker, and terminate `end` once it has looked at so many configurations."""
        self._checker, self._end = checker, end
        self._last = checker.checks + max_checks

    def end(self) -> None:
        """Let go of them."""
        del self._checker, self._end

    def is_free(self, state: Any) -> bool:
        """May the arm be there?"""
        return not self._spent() and self._checker.is_free(np.array(state[0:7]))

    def checkMotion(self, first: Any, second: Any) -> bool:
        """May the arm move straight from one state to the other?"""
        return not self._spent() and self._checker.edge_is_free(first[0:7], second[0:7])

    def _spent(self) -> bool:
        if self._checker.checks < self._last:
            return False
        self._end.terminate()
        return True


class _Space(NamedTuple):
    """What OMPL searches, and who answers it there."""

    space: base.RealVectorStateSpace
    information: base.SpaceInformation
    edges: _Edges


@lru_cache(maxsize=16)
def _space(lower: tuple[float, ...], upper: tuple[float, ...]) -> _Space:
    """Made once for all queries: OMPL takes as long to set it up as to solve an easy one."""
    space = base.RealVectorStateSpace(len(lower))
    bounds = base.RealVectorBounds(len(lower))
    for k, (low, high) in enumerate(zip(lower, upper, strict=True)):
        bounds.setLow(k, low)
        bounds.setHigh(k, high)
    space.setBounds(bounds)
    information = base.SpaceInformation(space)
    edges = _Edges(information)
    information.setStateValidityChecker(edges.is_free)
    information.setMotionValidator(edges)
    information.setup()
    return _Space(space, information, edges)


# OMPL's bindings complain about all that is still there when Python ends.
atexit.register(_space.cache_clear)


def _search(
    query: Query, checker: CollisionChecker, settings: PathSettings, seed: int, max_checks: int
) -> np.ndarray | None:
    space, information, edges = _space(*map(tuple, query.limits.tolist()))
    util.RNG.setSeed(seed % (2**31 - 1) + 1)
    end = base.plannerNonTerminatingCondition()
    edges.begin(checker, max_checks, end)
    problem = base.ProblemDefinition(information)
    problem.addStartState(_state(space, query.start))
    goals = base.GoalStates(information)
    for goal in query.goals:
        goals.addState(_state(space, goal))
    problem.setGoal(goals)
    planner = _PLANNERS[settings.planner](information)
    if hasattr(planner, "setRange"):
        planner.setRange(settings.step)
    if hasattr(planner, "setGoalBias"):
        planner.setGoalBias(settings.goal_bias)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(end)
    edges.end()
    if not problem.hasExactSolution():
        return None
    solution: Any = problem.getSolutionPath()
    return _from_start(np.array([state[0:7] for state in solution.getStates()]), query.start, checker)


def _from_start(path: np.ndarray, start: np.ndarray, checker: CollisionChecker) -> np.ndarray | None:
    """The path (n,7) as it leads from the start: AORRTC may hand it over from the goal's end, and where the straight
    way is free it gives the goal twice."""
    if np.array_equal(path[0], start):
        return path
    if np.array_equal(path[-1], start):
        return path[::-1]
    return np.stack([start, path[-1]]) if checker.edge_is_free(start, path[-1]) else None


def _state(space: base.RealVectorStateSpace, q: np.ndarray) -> Any:
    state: Any = space.allocState()
    for k in range(7):
        state[k] = float(q[k])
    return state
