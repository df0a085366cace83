"""What the leaves of a skill's tree see and act on while it runs."""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from planner.failure import Failure, RefinementFailure
from planner.motion.trajectory import Trajectory
from planner.refinement import Phase, Refinement
from planner.task.symbols import GroundAction
from sim.plant import GripCommand, Observation
from sim.robot import Gripper, RobotModel
from sim.scene import SceneState
from skills.control.controller import ArmController
from skills.control.reference import Mode

CLOSING_SPEED = 0.08
OPENING_GAIN = 12.0


class GripDriver:
    """Turns "open to a width" and "close with a force" into finger commands."""

    def __init__(self, gripper: Gripper) -> None:
        self._gripper = gripper
        self._target: float | None = gripper.stroke
        self._force = 0.0

    @property
    def is_closing(self) -> bool:
        """Are the fingers told to press?"""
        return self._target is None

    @property
    def force(self) -> float:
        """Newtons with which each finger presses, 0 unless told to."""
        return self._force if self.is_closing else 0.0

    def open_to(self, opening: float) -> None:
        """Bring the fingers `opening` metres apart and keep them there."""
        self._target = min(max(float(opening), 0.0), self._gripper.stroke)

    def close(self, force: float) -> None:
        """Close until an object resists, and go on pressing with `force` N each."""
        self._target, self._force = None, force

    def command(self, observation: Observation) -> GripCommand:
        """The finger command for this tick."""
        if self._target is None:
            return GripCommand(-CLOSING_SPEED, self._force)
        error = self._target - observation.opening
        limit = self._gripper.max_speed / 2
        return GripCommand(min(max(OPENING_GAIN * error, -limit), limit), self._gripper.max_force)


@dataclass
class ActionRun:
    """One action of the plan in force: what was refined for it, replaced when the action starts."""

    action: GroundAction
    refinement: Refinement | None = None

    def phase(self, name: str) -> Phase:
        """The refined phase of that name. Raises LookupError before refinement and for unknown names."""
        phases = self.refinement.phases if self.refinement else ()
        for phase in phases:
            if phase.name == name:
                return phase
        raise LookupError(f"{self.action} has no phase {name!r}, known: {[phase.name for phase in phases]}")

    def has(self, name: str) -> bool:
        """Is there a refined phase of that name?"""
        return self.refinement is not None and any(phase.name == name for phase in self.refinement.phases)

    def onward(self, phase: Phase) -> Trajectory | None:
        """What a phase's trajectory passes into without a stop: the next phase's, if it ends moving."""
        phases = self.refinement.phases if self.refinement and phase.trajectory.ends_moving else ()
        return next((after.trajectory for one, after in pairwise(phases) if one is phase), None)

    def running(self, phase: Phase | None) -> Phase | None:
        """`phase` if it is one of this action's as refined last, else None."""
        phases = self.refinement.phases if self.refinement else ()
        return phase if any(phase is one for one in phases) else None


def _ignore(kind: str, **data: Any) -> None:
    """Drop an event."""


@dataclass
class SkillContext:
    """Shared by all leaves; the executive brings `observation` and `scene` up to date before each tick of the tree.

    refine: an action's motion in the present scene, and the simulated seconds that finding it costs.
    phase, allowed: what runs now, and the contacts it declares. is_watchful: motions are watched while they run, and
    actions worked out again where they start; else they are carried out as planned, whatever is seen.
    """

    robot: RobotModel
    controller: ArmController
    grip: GripDriver
    observation: Observation
    scene: SceneState
    refine: Callable[[GroundAction], tuple[Refinement | RefinementFailure, float]]
    contact_mode: Mode = "hybrid"
    is_watchful: bool = True
    report: Callable[..., None] = _ignore
    failure: Failure | None = None
    phase: Phase | None = None
    allowed: frozenset[frozenset[str]] = field(default_factory=frozenset)

    def fail(self, failure: Failure) -> None:
        """Remember why the running action failed, and tell it at once; the first reason counts."""
        if self.failure is None:
            self.failure = failure
            self.report("action_failed", action=str(failure.action), failure=failure.kind, reason=failure.reason)
