"""What skills ask about motion: inverse kinematics, straight lines, collision-free moves, and their timing."""

from collections.abc import Callable, Collection, Iterable, Sequence
from copy import copy
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from pinocchio import SE3

from planner.failure import MotionFailure
from planner.motion.blame import blame
from planner.motion.checking import CollisionChecker
from planner.motion.clearance import DEEPEST, NOTHING, Clearance, MotionSettings, relaxed_by
from planner.motion.collision import FastChecker
from planner.motion.enclosed import LOOKS, EnclosedEnd, enclosed_end, walls_about
from planner.motion.exact import ExactChecker
from planner.motion.ik import ClosedFormIK
from planner.motion.ik_numeric import track_numerically
from planner.motion.lines import CartesianPath, interpolate, track
from planner.motion.ompl_ import PathSettings, Query, path_length, plan_path
from planner.motion.shortcut import shortened
from planner.motion.timing import time_line, time_path, time_path_with_stops
from planner.motion.trajectory import Trajectory
from planner.motion.withdrawing import HEMMED_IN, lines_back, lines_up
from planner.motion.world import Margins, movables
from planner.refinement import Pair, Work
from sim.robot import RobotModel
from sim.scene import SceneState

WEDGED = -0.015
"""Distance in metres (negative: overlap) at which the arm may still start by drawing the hand straight out: fingers
that something holds up stand otherwise than their opening tells."""

TOUCHING = 0.002
"""Metres within which what is held touches what it stands on, or leans on."""

FAR_ABOUT = 1.2
"""Times the straight way: where a path is longer, another is sought, and the shorter one taken."""

_CONTROL_SPACINGS = (0.3, 0.1)
_ATTEMPTS = 3


class Ends(NamedTuple):
    """The goals (7,) of a move that are free, and the margins to be kept on the way to them."""

    goals: list[np.ndarray]
    margins: Margins


class MotionPlanner(Clearance):
    """Plans motions of one robot. Every random choice follows from `seed` and the number of the query.

    Counts in `work` poses solved, "ik", on top of what `Clearance` counts.
    """

    def __init__(
        self, robot: RobotModel, seed: int = 0, settings: MotionSettings | None = None, work: Work | None = None
    ) -> None:
        super().__init__(robot, settings, work)
        s = self.settings
        self._path_settings = PathSettings(s.planner, s.goal_bias, s.restarts, s.step)
        self._seed, self._queries = seed, 0
        self._ik = ClosedFormIK(robot)

    def ik(self, X_WG: SE3) -> list[np.ndarray]:
        """Configurations (7,) that bring the gripper to X_WG, the furthest from the joint limits first."""
        self.work.add("ik")
        return list(self._ik.ik(X_WG))

    def lines(self, waypoints: Sequence[SE3], near: np.ndarray | None = None) -> list[np.ndarray]:
        """Joint paths (n,7) of the gripper along the polyline of poses X_WG, best first (see `lines.track`).

        `near` (7,): the configuration the arm will come from. Empty if the hand can't follow the polyline.
        """
        return self._track(interpolate(waypoints), near)

    def legs(self, waypoints: Sequence[SE3], near: np.ndarray | None = None) -> list[list[np.ndarray]]:
        """The same, each joint path cut at the waypoints into its legs (n,7)."""
        path = interpolate(waypoints)
        cuts = list(zip(path.corners[:-1], path.corners[1:], strict=True))
        return [[q[a : b + 1] for a, b in cuts] for q in self._track(path, near)]

    def line_from(self, q: np.ndarray, waypoints: Sequence[SE3]) -> np.ndarray | None:
        """One joint path (n,7) along the polyline of poses X_WG that goes on from q (7,), the arm being at the first.

        Found step by step (see `ik_numeric`), so near limits it may fail where `lines` finds another posture.
        """
        path = interpolate(waypoints)
        self.work.add("ik", len(path.p_WG))
        return track_numerically(self.robot, path, q)

    def timed_line(
        self,
        scene: SceneState,
        path: np.ndarray,
        tcp_speed: float,
        allowed: frozenset[Pair] = NOTHING,
        checked: int | None = None,
    ) -> Trajectory | MotionFailure:
        """Follow the joint path (n,7) of a line with the hand at tcp_speed (m/s), see `timing.time_line`.

        The motion as timed is confirmed by the exact model, up to the path's first `checked` configurations.
        """
        trajectory = time_line(self.robot, path, tcp_speed)
        q = trajectory.q
        if checked is not None and checked < len(path):
            q = q[: int(np.argmin(np.abs(q - path[checked - 1]).max(axis=1))) + 1]
        margins = self._leaving(scene, path[0], Margins(self.settings.audit_margin, allowed))
        failure = self._audit(scene, q, margins)
        if failure is None:
            self._confirmed = scene, allowed, trajectory
        return failure or trajectory

    def drawn_back(self, scene: SceneState, tcp_speed: float) -> Trajectory | None:
        """The hand drawn straight back from where it is at tcp_speed (m/s), as far as there is room; None if there is
        none."""
        for line in lines_back(self.robot, scene.q):
            self.work.add("ik", len(line))
            timed = self.timed_line(scene, line, tcp_speed) if self.line_is_free(scene, line) is None else None
            if isinstance(timed, Trajectory):
                return timed
        return None

    def move(
        self,
        scene: SceneState,
        q_goals: Sequence[np.ndarray],
        allowed: frozenset[Pair] = NOTHING,
        max_checks: int = 4000,
    ) -> Trajectory | MotionFailure:
        """A timed, audited, collision-free motion from scene.q to one of the goals (7,), or why there is none.

        Where the arm starts nearer to something than the margin (after a grasp, beside a bin's wall), that
        pair may stay as near all the way, and hardly nearer; where it finds no way out, the hand is first drawn
        straight back. What is held and touches something is first raised off it, if there is room. If there is no way
        with everything in place, but one without the movable bodies, those in that way are the culprits.
        """
        seed, ends = self._next_seed(), self.ends(scene, q_goals, allowed)
        if isinstance(ends, MotionFailure):
            return self._drawn_out(scene, q_goals, allowed, seed, max_checks) or ends
        fixed = scene.without(movables(scene))
        walled_in = cache(lambda: self._enclosed(fixed, ends, seed))
        enclosed = cache(lambda: walled_in() or (self._enclosed(scene, ends, seed) if movables(scene) else None))

        risen = self._risen(scene, q_goals, ends, seed, max_checks)
        trajectory = None if risen is None else self._timed(scene, risen, ends.margins)
        if trajectory is not None:
            return trajectory
        for attempt in range(_ATTEMPTS):
            path = self._polyline(scene, ends, seed + attempt, max_checks, lambda: enclosed() is not None)
            if path is None and not ((end := enclosed()) and end.which == "goal"):
                path = self._withdrawn(scene, q_goals, ends, seed, max_checks)
            if path is None:
                end = walled_in()
                return self._walled_in(fixed, ends, end, seed) if end else self._blocked(scene, ends, seed, max_checks)
            trajectory = self._timed(scene, path, ends.margins)
            if trajectory is not None:
                return trajectory
        return MotionFailure("no timed motion along the paths found keeps clear of everything")

    def way(
        self,
        scene: SceneState,
        q_goals: Sequence[np.ndarray],
        allowed: frozenset[Pair] = NOTHING,
        max_checks: int = 4000,
    ) -> np.ndarray | MotionFailure:
        """The polyline (n,7) that `move` begins with, shortened but not timed; nobody is sought who is in the way."""
        seed, ends = self._next_seed(), self.ends(scene, q_goals, allowed)
        if isinstance(ends, MotionFailure):
            return ends
        path = self._polyline(scene, ends, seed, max_checks, lambda: self._enclosed(scene, ends, seed) is not None)
        return MotionFailure(f"no path within {max_checks} checks") if path is None else path

    def ends(
        self, scene: SceneState, q_goals: Sequence[np.ndarray], allowed: frozenset[Pair] = NOTHING
    ) -> Ends | MotionFailure:
        """Which of the goals (7,) a move from scene.q may have, with which margins, or why there is none."""
        margins = Margins(self.settings.margin, allowed)
        # What the fast model calls free is free, and it is asked at once.
        near = [] if self._surely_free(scene, scene.q, margins) else self._near(scene, scene.q, margins)
        deep = [contact for contact in near if contact.distance < DEEPEST]
        if deep:
            return blame("the arm starts in collision:", deep, movables(scene))
        margins = relaxed_by(margins, near)
        goals = self._free_goals(scene, q_goals, margins)
        return goals if isinstance(goals, MotionFailure) else Ends(goals, margins)

    def _next_seed(self) -> int:
        self._queries += 1
        return int(np.random.SeedSequence([self._seed, self._queries]).generate_state(1)[0])

    def _track(self, path: CartesianPath, near: np.ndarray | None) -> list[np.ndarray]:
        self.work.add("ik", len(path.p_WG))
        return list(track(self._ik, path, self.robot.v_max, near))

    def _free_goals(
        self, scene: SceneState, q_goals: Sequence[np.ndarray], margins: Margins
    ) -> list[np.ndarray] | MotionFailure:
        within = [q for q in q_goals if np.all(q >= self._limits[0]) and np.all(q <= self._limits[1])]
        if not within:
            return MotionFailure("every goal lies beyond a joint limit" if len(q_goals) else "no goal was given")
        hits = [[] if self._surely_free(scene, q, margins) else self._contacts(scene, q[None], margins) for q in within]
        goals = [q for q, contacts in zip(within, hits, strict=True) if not contacts]
        if goals:
            return goals
        failures = [blame("the goal is in collision:", contacts, movables(scene)) for contacts in hits]
        return min(failures, key=lambda failure: len(failure.culprits) or np.inf)

    def _polyline(
        self, scene: SceneState, ends: Ends, seed: int, max_checks: int, is_hopeless: Callable[[], bool] | None = None
    ) -> np.ndarray | None:
        checker, reached = self._checker(scene, ends)
        before = checker.checks
        path = next((np.stack([scene.q, q]) for q in reached if checker.edge_is_free(scene.q, q)), None)
        if path is None:
            query = Query(scene.q, reached, self._limits, seed, max_checks)
            path = self._shortened(query, checker, is_hopeless)
            if path is not None and path_length(path) > FAR_ABOUT * np.linalg.norm(path[-1] - path[0]):
                restarts = self._path_settings.restarts
                again = replace(query, seed=seed + restarts, max_checks=max_checks // restarts)
                other = self._shortened(again, checker)
                path = path if other is None else min(path, other, key=path_length)
        self.work.add("checks" if isinstance(checker, FastChecker) else "exact_checks", checker.checks - before)
        return path

    def _drawn_out(
        self, scene: SceneState, q_goals: Sequence[np.ndarray], allowed: frozenset[Pair], seed: int, max_checks: int
    ) -> Trajectory | None:
        """A motion that first draws the hand straight back out of what it overlaps; None if it overlaps nothing, or too
        much, or there is no such motion."""
        margins = Margins(self.settings.margin, allowed)
        near = [] if self._surely_free(scene, scene.q, margins) else self._near(scene, scene.q, margins)
        if not WEDGED <= min((contact.distance for contact in near), default=0.0) < DEEPEST:
            return None
        margins = relaxed_by(margins, near)
        path = self._from_line(scene, lines_back(self.robot, scene.q), q_goals, margins, seed, max_checks)
        return None if path is None else self._timed(scene, path, margins)

    def _withdrawn(
        self, scene: SceneState, q_goals: Sequence[np.ndarray], ends: Ends, seed: int, max_checks: int
    ) -> np.ndarray | None:
        """A path that draws the hand straight back first, from among what hems it in; None if nothing does."""
        if not self._near(scene, scene.q, Margins(HEMMED_IN, ends.margins.allowed)):
            return None
        return self._from_line(scene, lines_back(self.robot, scene.q), q_goals, ends.margins, seed, max_checks)

    def _risen(
        self, scene: SceneState, q_goals: Sequence[np.ndarray], ends: Ends, seed: int, max_checks: int
    ) -> np.ndarray | None:
        """A path that first raises what is held off what it touches, and keeps clear of that from there on; None if it
        touches nothing, or there is no such path."""
        held = frozenset({scene.held.name} if scene.held is not None else ())
        touching = [pair for pair, distance in ends.margins.relaxed.items() if pair & held and distance < TOUCHING]
        if not touching:
            return None
        lines = lines_up(self.robot, scene.q)
        return self._from_line(scene, lines, q_goals, ends.margins, seed, max_checks, clear_of=touching)

    def _from_line(
        self,
        scene: SceneState,
        lines: Iterable[np.ndarray],
        q_goals: Sequence[np.ndarray],
        margins: Margins,
        seed: int,
        max_checks: int,
        clear_of: Collection[Pair] = (),
    ) -> np.ndarray | None:
        """A path that begins with one of the lines (n,7) and from its end on keeps the usual margins, off `clear_of`
        at any rate; None if there is none."""
        for line in lines:
            self.work.add("ik", len(line))
            if self._contacts(scene, line, margins):
                continue
            after = replace(scene, q=line[-1])
            onward = self.ends(after, q_goals, margins.allowed)
            if isinstance(onward, MotionFailure) or not onward.margins.relaxed.keys().isdisjoint(clear_of):
                continue
            path = self._polyline(after, onward, seed, max_checks)
            if path is not None:
                return np.concatenate([line, path[1:]])
        return None

    def _shortened(
        self, query: Query, checker: CollisionChecker, is_hopeless: Callable[[], bool] | None = None
    ) -> np.ndarray | None:
        """A path, made shorter."""
        path = plan_path(query, checker, self._path_settings, is_hopeless)
        return None if path is None else shortened(path, checker)

    def _checker(self, scene: SceneState, ends: Ends) -> tuple[CollisionChecker, list[np.ndarray]]:
        """The fast model with the goals it accepts; the exact one if the fast refuses the start or every goal."""
        fast = self._fast(scene, ends.margins)
        accepted = [q for q in ends.goals if fast.is_free(q)]
        if accepted and fast.is_free(scene.q):
            return fast, accepted
        return ExactChecker(self.robot, scene, ends.margins), ends.goals

    def _blocked(self, scene: SceneState, ends: Ends, seed: int, max_checks: int) -> Trajectory | MotionFailure:
        """Who is in the way, once no path was found: a motion after all if the way without the movables hits none."""
        reason = f"no path within {max_checks} checks"
        movable = movables(scene)
        path = self._polyline(scene.without(movable), ends, seed, max_checks) if movable else None
        if path is None:
            return MotionFailure(f"{reason}, whatever is moved aside")
        contacts = self._contacts(scene, path, ends.margins)
        if contacts:
            return blame(f"{reason}; the way without movable bodies hits", contacts, movable)
        return self._timed(scene, path, ends.margins) or MotionFailure(reason)

    def _walled_in(self, scene: SceneState, ends: Ends, end: EnclosedEnd, seed: int) -> MotionFailure:
        """What there is no way out of, at the start or at every goal."""
        self.work.add("exact_checks", LOOKS)
        walls = walls_about(self._exact(scene, ends.margins), end.q, self._limits, seed)
        return MotionFailure(f"the {end.which} is walled in by {', '.join(walls) or 'the arm itself'}")

    def _enclosed(self, scene: SceneState, ends: Ends, seed: int) -> EnclosedEnd | None:
        """See `enclosed_end`."""
        checker, reached = self._checker(scene, ends)
        # A copy, because whoever searches with this model counts its checks.
        own, before = copy(checker), checker.checks
        end = enclosed_end(own, Query(scene.q, reached, self._limits, seed, 0))
        self.work.add("checks", own.checks - before)
        return end

    def _timed(self, scene: SceneState, path: np.ndarray, margins: Margins) -> Trajectory | None:
        margins = replace(margins, free=self.settings.audit_margin)
        timings = [lambda spacing=spacing: time_path(self.robot, path, spacing) for spacing in _CONTROL_SPACINGS]
        for timing in (*timings, lambda: time_path_with_stops(self.robot, path)):
            trajectory = timing()
            if self._audit(scene, trajectory.q, margins) is None:
                self._confirmed = scene, margins.allowed, trajectory
                return trajectory
        return None
