"""Software that fails, wired in at the seams of the real: a solver, a motion planner, a task planner.

Each calls `strike` whenever it fails.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from planner.failure import MotionFailure
from planner.motion.clearance import NOTHING
from planner.motion.motion_planner import MotionPlanner
from planner.motion.trajectory import Trajectory
from planner.refinement import Pair
from planner.task.planner import TaskPlanner
from planner.task.symbols import NoTaskPlan, TaskPlan
from sim.scene import SceneState
from skills.control.osqp_ import Problem, Workspace
from skills.control.torque_qp import SPARE_ROWS


class FailingSolver:
    """OSQP, of whose answers those in `spells` (first call, number of calls) say `status` and mean nothing."""

    def __init__(self, status: str, spells: tuple[tuple[int, int], ...], strike: Callable[[], None]) -> None:
        self._real = Workspace(7, 7 + SPARE_ROWS)
        self._status, self._spells, self._calls = status, spells, 0
        self._strike = strike

    def solve(self, problem: Problem) -> tuple[np.ndarray, str]:
        x, status = self._real.solve(problem)
        self._calls += 1
        if any(first <= self._calls < first + number for first, number in self._spells):
            self._strike()
            return np.full_like(x, np.nan), self._status
        return x, status


class ExhaustedMotionPlanner(MotionPlanner):
    """The motion planner, out of budget in every so many of its queries."""

    every = 4

    def __init__(self, *args: Any, strike: Callable[[], None], **settings: Any) -> None:
        super().__init__(*args, **settings)
        self._asked, self._strike = 0, strike

    def move(
        self,
        scene: SceneState,
        q_goals: "list[np.ndarray] | tuple[np.ndarray, ...] | Any",
        allowed: frozenset[Pair] = NOTHING,
        max_checks: int = 4000,
    ) -> Trajectory | MotionFailure:
        self._asked += 1
        if self._asked % self.every == 0:
            self._strike()
            return MotionFailure(f"no path within {max_checks} checks")
        return super().move(scene, q_goals, allowed, max_checks)


class FailingTaskPlanner:
    """A task planner that crashes, runs out of budget or talks nonsense in every second of its first answers."""

    def __init__(self, real: TaskPlanner, strike: Callable[[], None], first: int = 6) -> None:
        self._real, self._first, self._asked = real, first, 0
        self._strike = strike

    def solve(self, domain_text: str, problem_text: str, max_expansions: int) -> TaskPlan | NoTaskPlan:
        self._asked += 1
        found = self._real.solve(domain_text, problem_text, max_expansions)
        if self._asked > self._first or self._asked % 2 == 0:
            return found
        self._strike()
        if self._asked % 6 == 1:
            raise MemoryError("out of memory on purpose")
        if self._asked % 6 == 3 and isinstance(found, TaskPlan):
            return replace(found, steps=found.steps[1:])
        return NoTaskPlan(False, max_expansions)
