"""How near the arm comes to what, at a configuration, along a path or on a motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pinocchio import SE3

from planner.failure import MotionFailure
from planner.motion.blame import blame
from planner.motion.collision import FastChecker, hand_hits, part_names
from planner.motion.exact import Contact, ExactChecker
from planner.motion.recent import Recent
from planner.motion.trajectory import Trajectory
from planner.motion.world import FREE_MARGIN, Margins, movables, obstacles
from planner.refinement import Pair, Work, pairs
from sim.robot import RobotModel
from sim.scene import SceneState

NOTHING: frozenset[Pair] = frozenset()

SLACK = 0.0005
"""Metres by which a pair that is near at the start may come nearer still."""

DEEPEST = -0.004
"""Distance in metres (negative: overlap) at which the arm may still start: things held or pressed give way a little."""


@dataclass(frozen=True)
class MotionSettings:
    """planner, goal_bias, restarts, step: see `PathSettings`. Margins in metres: of free moves as they are planned, of
    lines near contact, of timed trajectories."""

    planner: str = "RRTConnect"
    goal_bias: float = 0.05
    restarts: int = 4
    step: float = 1.2
    margin: float = FREE_MARGIN
    line_margin: float = 0.002
    audit_margin: float = 0.001


class Clearance:
    """Asks the fast collision model what is surely free, and the exact one what isn't.

    Counts in `work` configurations tested for collision, "checks" by the fast model and "exact_checks".
    """

    def __init__(self, robot: RobotModel, settings: MotionSettings | None = None, work: Work | None = None) -> None:
        self.robot = robot
        self.settings = MotionSettings() if settings is None else settings
        self.work = Work() if work is None else work
        self._limits = np.stack([robot.q_min, robot.q_max])
        self._recent_exact, self._recent_fast = Recent(ExactChecker), Recent(FastChecker)
        self._confirmed: tuple[SceneState, frozenset[Pair], Trajectory] | None = None

    def free(
        self, scene: SceneState, q: np.ndarray, allowed: frozenset[Pair] = NOTHING, margin: float | None = None
    ) -> bool:
        """Is q (7,) within the limits, and everything but the allowed pairs at least `margin` metres apart?"""
        margins = Margins(self.settings.margin if margin is None else margin, allowed)
        checker = self._exact(scene, margins)
        self.work.add("exact_checks")
        return checker.is_free(q)

    def hand_hits(
        self, scene: SceneState, X_WG: SE3, allowed: frozenset[Pair] = NOTHING, margin: float | None = None
    ) -> frozenset[str]:
        """Names of what hand, fingers or held body would come too near to with the gripper at X_WG, wherever the arm
        is. A cheap look before any inverse kinematics."""
        margins = Margins(self.settings.line_margin if margin is None else margin, allowed)
        self.work.add("checks")
        return hand_hits(self.robot, scene, X_WG, margins)

    def line_is_free(
        self, scene: SceneState, path: np.ndarray, allowed: frozenset[Pair] = NOTHING, margin: float | None = None
    ) -> MotionFailure | None:
        """None if the joint path (n,7) is free by the exact model, else what it hits.

        What touches at its start may stay as near, see `move`. Culprits are the movable bodies it hits, if it hits
        nothing else.
        """
        margins = Margins(self.settings.line_margin if margin is None else margin, allowed)
        contacts = self._contacts(scene, path, self._leaving(scene, path[0], margins))
        return blame("the line comes too near:", contacts, movables(scene)) if contacts else None

    def has_confirmed(self, scene: SceneState, trajectory: Trajectory, allowed: frozenset[Pair] = NOTHING) -> bool:
        """Is this the very motion that was confirmed last by the exact model, in this very scene?"""
        if self._confirmed is None:
            return False
        known_scene, known_allowed, known = self._confirmed
        return known is trajectory and known_scene is scene and known_allowed == allowed

    def audit(
        self,
        scene: SceneState,
        trajectory: Trajectory,
        allowed: frozenset[Pair] = NOTHING,
        margin: float | None = None,
        since: float = 0.0,
        only: frozenset[str] | None = None,
        deepest: float = -np.inf,
    ) -> MotionFailure | None:
        """None if what is left of the trajectory `since` seconds after its start is free by the exact model.

        What is near then already may stay as near, see `move`, unless it is nearer than `deepest` (m; negative:
        overlap). `only` these bodies are looked at (None: everything).
        """
        start = trajectory.at(since)[0]
        if only is not None:
            others = frozenset(obstacle.name for obstacle in obstacles(scene)) - only
            allowed = allowed | pairs(frozenset(part_names(self.robot, scene.held)), others)
        margins = Margins(self.settings.audit_margin if margin is None else margin, allowed)
        near = [contact for contact in self._near(scene, start, margins) if contact.distance >= deepest]
        left = trajectory.q[trajectory.times - trajectory.times[0] > since]
        return self._audit(scene, np.concatenate([start[None], left]), relaxed_by(margins, near))

    def _audit(self, scene: SceneState, q: np.ndarray, margins: Margins) -> MotionFailure | None:
        if np.any(q < self._limits[0]) or np.any(q > self._limits[1]):
            return MotionFailure("the motion passes a joint limit")
        contacts = self._contacts(scene, q, margins)
        return blame("the motion comes too near:", contacts, movables(scene)) if contacts else None

    def _near(self, scene: SceneState, q: np.ndarray, margins: Margins) -> list[Contact]:
        """Everything that is nearer than its margin at q (7,)."""
        self.work.add("exact_checks")
        return self._exact(scene, margins).contacts(q[None])

    def _leaving(self, scene: SceneState, start: np.ndarray, margins: Margins) -> Margins:
        """Margins of a motion that begins at `start` (7,): what is near there, but not deep in, may stay as near."""
        near = self._near(scene, start, margins)
        return relaxed_by(margins, [contact for contact in near if contact.distance >= DEEPEST])

    def _contacts(self, scene: SceneState, path: np.ndarray, margins: Margins) -> list[Contact]:
        """What the path (n,7) hits, up to the first thing that can't be moved aside."""
        checker = self._exact(scene, margins)
        dense = checker.densified(path)
        self.work.add("exact_checks", len(dense))
        return checker.contacts(dense, enough=movables(scene).isdisjoint)

    def _surely_free(self, scene: SceneState, q: np.ndarray, margins: Margins) -> bool:
        self.work.add("checks")
        return self._fast(scene, margins).is_free(q)

    def _fast(self, scene: SceneState, margins: Margins) -> FastChecker:
        return self._recent_fast.of(self.robot, scene, margins)

    def _exact(self, scene: SceneState, margins: Margins) -> ExactChecker:
        return self._recent_exact.of(self.robot, scene, margins)


def relaxed_by(margins: Margins, near: Sequence[Contact]) -> Margins:
    """The margins, but for pairs that are near: they may stay as near."""
    return replace(margins, relaxed={contact.pair: contact.distance - SLACK for contact in near})
