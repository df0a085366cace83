"""Leaves that move: each follows one phase of the refined action and says how it went.

They set what the controller and the fingers follow, then watch. None of them plans.
"""

from abc import abstractmethod

import numpy as np
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Sequence

from planner.failure import ArmStopped, ContactLost, ExecutionFailure, ForceExceeded, GraspMissed, PathBlocked
from planner.refinement import Phase
from sim.plant import Observation
from skills.context import ActionRun, SkillContext
from skills.control.reference import Reference
from skills.payload import load_of

OVERTIME = 3.0
"""Seconds that a motion may take beyond its trajectory before it counts as failed."""

OFF_PATH = 0.055
"""Metres by which a joint that lags may displace the hand: from there on a free motion counts as blocked. A wrist that
rubs with 3 Nm lags by 0.1 rad when it turns round, which displaces the hand less than 0.06 rad of the shoulder do."""

MAX_CONTACT_FORCE = 60.0
STILL = 0.002
"""Finger speed in m/s below which the fingers have come to rest."""

SETTLE = 0.15
RELEASE_TIME = 2.0
CLOSE_TIME = 3.0
"""Seconds after which the fingers count as closed, even if they never came to rest."""

READINGS = 8
"""Looks at the wrist sensor with which it is weighed what the hand holds, and that it holds nothing."""


def sequence(name: str, *children: Behaviour) -> Behaviour:
    """Children one after the other; those done are not ticked again."""
    return Sequence(name, memory=True, children=list(children))


def guarded(name: str, condition: Behaviour, body: Behaviour) -> Behaviour:
    """`body`, as long as `condition` holds: it is looked at again at every tick."""
    return Sequence(name, memory=False, children=[condition, body])


class PhaseLeaf(Behaviour):
    """A leaf that carries out one phase."""

    def __init__(self, name: str, run: ActionRun, context: SkillContext) -> None:
        super().__init__(name)
        self._run, self._context = run, context
        self._since = 0.0

    @property
    def phase(self) -> Phase:
        """What was refined for this leaf."""
        return self._run.phase(self.name)

    def initialise(self) -> None:
        context = self._context
        self._since = context.observation.t
        context.phase = self.phase
        context.allowed = self.phase.allowed
        context.report("phase", action=str(self._run.action), phase=self.name)
        self.begin()

    @abstractmethod
    def begin(self) -> None:
        """Set what is followed from now on."""

    @abstractmethod
    def watch(self) -> Status:
        """How it goes, at every tick."""

    def update(self) -> Status:
        stop = self._context.controller.stopped
        return self.watch() if stop is None else self.refuse(ArmStopped, str(stop))

    def terminate(self, new_status: Status) -> None:
        self._context.phase = None
        if new_status == Status.INVALID:
            self._context.controller.hold()

    @property
    def elapsed(self) -> float:
        """Simulated seconds since the phase began."""
        return self._context.observation.t - self._since

    def refuse(self, kind: type[ExecutionFailure], reason: str) -> Status:
        """Fail for a reason, told to whoever replans."""
        refinement = self._run.refinement
        sample = refinement.sample if refinement else None
        self._context.fail(kind(self._run.action, reason, sample))
        self.feedback_message = reason
        return Status.FAILURE

    def too_forceful(self) -> bool:
        """Is the contact force beyond the limit?"""
        return self._context.controller.contact_force > MAX_CONTACT_FORCE


class Follow(PhaseLeaf):
    """Follows a trajectory in joint space, and passes into the next where it ends moving."""

    def begin(self) -> None:
        phase = self.phase
        if phase.held is None:
            self._context.grip.open_to(phase.opening)
        self._context.controller.follow(Reference(phase.trajectory, then=self._run.onward(phase)))

    def watch(self) -> Status:
        controller = self._context.controller
        if controller.passed or controller.finished:
            return Status.SUCCESS
        off = controller.tracking_error.hand
        if off > OFF_PATH:
            return self.refuse(PathBlocked, f"the arm was held {100 * off:.0f} cm off its path")
        if self.elapsed > self.phase.trajectory.duration + OVERTIME:
            return self.refuse(PathBlocked, "the arm did not reach the end of its path")
        return Status.RUNNING


class FollowIfAny(Follow):
    """The same, of a phase that is not refined unless it is needed."""

    def initialise(self) -> None:
        if self._run.has(self.name):
            super().initialise()

    def update(self) -> Status:
        return super().update() if self._run.has(self.name) else Status.SUCCESS


class Open(PhaseLeaf):
    """Brings the fingers to the phase's opening; what was held is let go."""

    def begin(self) -> None:
        self._context.controller.hold()
        self._context.grip.open_to(self.phase.opening)

    def watch(self) -> Status:
        observation = self._context.observation
        if abs(observation.opening - self.phase.opening) < 0.003:
            self._context.controller.clear_payload()
            return Status.SUCCESS
        if self.elapsed > RELEASE_TIME:
            return self.refuse(PathBlocked, f"the fingers stopped at {observation.opening * 1000:.0f} mm")
        return Status.RUNNING


class Close(PhaseLeaf):
    """Closes the fingers until the object resists, and takes its weight into the arm's model.

    readings: the first few observations, when nothing is held yet.
    """

    def begin(self) -> None:
        self._context.controller.hold()
        self._context.grip.close(self.phase.grip)
        self._still_since: float | None = None
        self.readings: list[Observation] = []

    def watch(self) -> Status:
        context = self._context
        observation = context.observation
        if len(self.readings) < READINGS:
            self.readings.append(observation)
        if abs(observation.opening_velocity) > STILL or self.elapsed < SETTLE:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = observation.t
        is_still = self._still_since is not None and observation.t - self._still_since >= SETTLE
        if not is_still and self.elapsed < CLOSE_TIME:
            return Status.RUNNING
        name = self._run.action.args[0]
        if context.scene.held is None or context.scene.held.name != name:
            return self.refuse(
                GraspMissed, f"the fingers closed to {observation.opening * 1000:z.0f} mm without {name}"
            )
        context.controller.set_payload(*load_of(context.scene, name))
        return Status.SUCCESS


class Touch(PhaseLeaf):
    """Lowers until contact, then builds up the force."""

    def begin(self) -> None:
        context, phase = self._context, self.phase
        context.controller.tare()
        if phase.held is None:
            context.grip.open_to(phase.opening)
        context.controller.follow(pressing(phase, context, until_contact=True))

    def watch(self) -> Status:
        controller = self._context.controller
        if self.too_forceful():
            return self.refuse(ForceExceeded, f"{controller.contact_force:.0f} N at touchdown")
        if controller.contact_lost:
            return self.refuse(ContactLost, "contact was lost again at touchdown")
        if controller.finished:
            if controller.contact:
                return Status.SUCCESS
            return self.refuse(ContactLost, "no contact was found")
        if self.elapsed > self.phase.trajectory.duration + OVERTIME:
            return self.refuse(ContactLost, "no steady contact was found")
        return Status.RUNNING


class Slide(PhaseLeaf):
    """Follows a trajectory in the plane of contact, pressed with the phase's force."""

    def begin(self) -> None:
        self._context.controller.follow(pressing(self.phase, self._context))

    def watch(self) -> Status:
        controller = self._context.controller
        if self.too_forceful():
            return self.refuse(ForceExceeded, f"{controller.contact_force:.0f} N while sliding")
        if controller.contact_lost:
            return self.refuse(ContactLost, "contact was lost while sliding")
        if controller.finished:
            return Status.SUCCESS
        if self.elapsed > self.phase.trajectory.duration + OVERTIME:
            return self.refuse(PathBlocked, "the stroke did not come to its end")
        return Status.RUNNING


def pressing(phase: Phase, context: SkillContext, until_contact: bool = False) -> Reference:
    """The reference of a phase that presses down on what lies below."""
    press = phase.press
    if press is None:
        raise ValueError(f"phase {phase.name!r} says no force to press with")
    return Reference(
        phase.trajectory,
        context.contact_mode,
        np.array(press.stiffness),
        press.force,
        until_contact=until_contact,
        damping=press.damping,
    )
