"""The arm's one controller: position, impedance and force laws on one torque QP, without bumps between them."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numba import njit

from planner.motion.trajectory import Trajectory
from sim.plant import Observation
from sim.robot import GRAVITY, RobotModel
from skills.control.bracing import Brace
from skills.control.bridge import Bridge
from skills.control.contact import ContactWrench, along, with_force_along
from skills.control.cushion import cushion
from skills.control.dynamics import Dynamics
from skills.control.fingers import FingerWork
from skills.control.laws import Law, comply, lowered, press, seek, track
from skills.control.momentum import Compensation, MomentumObserver
from skills.control.osqp_ import Solver
from skills.control.pressed import PressedContact
from skills.control.reference import Course, Reference, near_contact
from skills.control.safety import Collision, ForceTooHigh, Guard, SafetyLimits, Stop
from skills.control.state import ArmState
from skills.control.tasks import pose_error
from skills.control.torque_qp import TorqueQP, nobody

AT_REST = 0.02
"""Joint speed in rad/s below which the arm counts as at rest."""

ARRIVED = 0.03
"""Joint error in rad below which position mode counts as arrived."""

HAND_RADIUS = 0.2
"""Metres around the tool centre that hand and held things take up."""

APPROACH_SPEED = 0.02
"""Metres per second at which a reference until contact meets a surface: a stiff one answers with a force of
speed · √(stiffness · moved mass), 5 N for the sponge."""

STOPPING = 2.0
"""Times the acceleration of planned motions with which the arm may brake when it is told to hold. What is held doesn't
slip: from 1.1 rad/s, neither books nor wedges moved in the hand by 0.5 mm or 0.5°."""


@dataclass(frozen=True)
class TrackingError:
    """How far the arm is from its reference now: the tool's position in metres (without the pressed
    direction) and rotation in rad, the largest joint error in rad, and the most by which any one joint's error
    displaces the hand with what it holds, in metres."""

    position: float
    rotation: float
    joint: float
    hand: float


class ArmController:
    """Turns observations into joint torques, one call of `update` every `period` seconds.

    What it follows is set by `follow` and `hold`, which take effect at the next `update`. It holds
    at first. Losing contact while pressed, it holds and says so in `contact_lost`. When a safety limit is about
    to be passed or something unexpected pushes, it comes to rest, holds and says why in `stopped`, until that is
    acknowledged or it is told what to follow next. `lap` is called with the name of each part of an update that has
    just been done.
    """

    def __init__(
        self,
        robot: RobotModel,
        period: float = 0.002,
        safety: SafetyLimits | None = None,
        solver: Solver | None = None,
    ) -> None:
        self._unloaded = self._robot = robot
        self._period = period
        self._dynamics = Dynamics(robot)
        self.lap: Callable[[str], None] = nobody
        self._qp = TorqueQP(robot, period, lambda part: self.lap(part), solver)
        self._observer = MomentumObserver(period)
        safety = safety or SafetyLimits(speed=robot.tcp_speed_max)
        self._guard = Guard(safety, robot.tau_max, period)
        self._brace = Brace(robot, safety.collision, period)
        self._compensation = Compensation(robot.tau_max, period)
        self._wrench = ContactWrench(robot, period)
        self._contact = PressedContact(period)
        self._bridge = Bridge(period)
        self._reference: Reference | None = None
        self._pending: Reference | None = None
        self._hold_pending = True
        self._law_changed = False
        self._course = Course(Trajectory.standstill(np.zeros(7)))
        self._state: ArmState | None = None
        self._tau: np.ndarray | None = None
        self._lingers = False
        self._finger_work = FingerWork(period)
        self._weight = 0.0
        self._slowed = 1.0
        self._unexplained: np.ndarray | None = None
        self.contact_lost = False
        self.stopped: Stop | None = None

    def follow(self, reference: Reference) -> None:
        """Start following `reference`."""
        self._pending, self._hold_pending = reference, False
        self.contact_lost = False
        self.stopped = None
        self._unexplained = None
        self._guard.reset()

    def hold(self) -> None:
        """Stop smoothly and stay, in position mode. Calling it again changes nothing."""
        if self._pending is None and self._reference is None:
            return
        self._pending, self._hold_pending = None, True

    def acknowledge(self) -> None:
        """Take note of a stop: hold where the arm is now, bearing whatever weighs on it."""
        if self.stopped is not None:
            self.stopped = self._unexplained = None
            self._guard.reset()
            self._hold_pending = True

    def set_payload(self, mass: float, com_G: np.ndarray, inertia_G: np.ndarray) -> None:
        """A rigid load is in the hand: mass in kg, centre com_G (3,) in m, inertia (3,3) in kg m² about it, in G."""
        load = pin.Inertia(mass, np.asarray(com_G, dtype=float), np.asarray(inertia_G, dtype=float))
        self._weight = mass * GRAVITY
        self._use(self._unloaded.with_payload(mass, load.lever, load.inertia), load)

    def clear_payload(self) -> None:
        """The hand is empty again. Calling it again changes nothing."""
        if self._robot is not self._unloaded:
            self._weight = 0.0
            self._use(self._unloaded, None)

    def _use(self, robot: RobotModel, load: pin.Inertia | None) -> None:
        self._robot, self._dynamics = robot, Dynamics(robot)
        self._wrench.carry(load)
        self._observer.change_model()
        self._law_changed = True

    def tare(self) -> None:
        """Take what the wrist sensor feels for its error. In the air, nearly still, before each touch."""
        self._wrench.tare()
        self._contact.tare()

    @property
    def reference(self) -> Reference | None:
        """What is followed, or will be at the next update; None while holding."""
        return self._pending if self._pending is not None or self._hold_pending else self._reference

    @property
    def time_in_reference(self) -> float:
        """Seconds along the trajectory; stands still once a reference until contact has touched."""
        return 0.0 if self._pending is not None else self._course.time / self._slowed

    @property
    def finished(self) -> bool:
        """Whether the trajectory's time is over, with that of what it passes into, and the arm at rest (in position
        mode: there), or, until contact, the force has been ramped up and settled. Never once `stopped`."""
        state = self._state
        if state is None or self._pending is not None or self._hold_pending or self.stopped is not None:
            return False
        if self._reference is not None and self._reference.until_contact and self._contact.is_pressed:
            return self._contact.has_settled
        if not self._course.over or np.abs(state.v).max() > AT_REST:
            return False
        in_position = self._reference is None or self._reference.mode == "position"
        return not in_position or self.tracking_error.joint < ARRIVED

    @property
    def passed(self) -> bool:
        """Whether the trajectory's time is over, the arm passing into what comes `then`."""
        reference = self._reference
        if reference is None or reference.then is None or self._pending is not None or self._hold_pending:
            return False
        return self._course.time >= reference.trajectory.duration

    @property
    def contact(self) -> bool:
        """Whether the tool is pressed on from outside along the contact frame's z axis."""
        return self._contact.is_closed

    @property
    def contact_force(self) -> float:
        """Smoothed normal force in N along the contact frame's z axis; pressing is positive."""
        return along(self._normal, self._wrench.smooth)

    @property
    def felt(self) -> float:
        """Force in N on the hand from outside, in whatever direction, as felt just now."""
        x, y, z = self._wrench.raw[:3].tolist()
        return math.sqrt(x * x + y * y + z * z)

    @property
    def is_struck(self) -> bool:
        """Does anything that isn't expected act on the arm, or has just acted?"""
        return self._brace.is_struck

    @property
    def is_still(self) -> bool:
        """Is the arm at rest?"""
        return self._state is not None and float(np.abs(self._state.v).max()) < AT_REST

    @property
    def tracking_error(self) -> TrackingError:
        if self._state is None:
            return TrackingError(0.0, 0.0, 0.0, 0.0)
        q, v, a = self._course.now()
        error = pose_error(self._dynamics.target(q, v, a), self._state)
        if self._contact.is_pressed:
            error[:3] -= self._normal * (self._normal @ error[:3])
        joints = np.abs(q - self._state.q)
        hand = joints * (np.linalg.norm(self._state.J[:3], axis=0) + HAND_RADIUS)
        position, rotation = float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))
        return TrackingError(position, rotation, float(joints.max()), float(hand.max()))

    @property
    def collision(self) -> Collision | None:
        """The unexpected contact that the arm stopped for, if it did."""
        return self.stopped if isinstance(self.stopped, Collision) else None

    @property
    def unmodelled(self) -> np.ndarray:
        """Torques (7,) in Nm that neither the model nor the wrist sensor explains: friction, wrong masses, contact."""
        return self._observer.unmodelled

    @property
    def model(self) -> RobotModel:
        """The arm with what it is believed to hold."""
        return self._robot

    @property
    def fallbacks(self) -> int:
        """Ticks on which the QP was not solved."""
        return self._qp.fallbacks

    @property
    def torque_limit_violations(self) -> int:
        """Ticks on which the QP's own output broke a torque limit."""
        return self._qp.torque_limit_violations

    @property
    def _normal(self) -> np.ndarray:
        return _UP if self._reference is None else self._reference.normal

    def update(self, observation: Observation) -> np.ndarray:
        """Torques (7,) in Nm for the next period."""
        state = self._dynamics.state(observation.q, observation.v)
        self._state = state
        self.lap("model")
        self._wrench.update(state, observation.wrist)
        felt = state.torques_of(_NO_WRENCH if self._wrench.is_silent else self._wrench.credible)
        self._observer.update(state.M, state.bias, state.v, observation.tau, felt)
        if self._pending is not None:
            self._begin(self._pending, state)
        elif self._hold_pending:
            self._begin_hold(state)
        self._watch_contact(state)
        self._finger_work.update(observation.opening_velocity, along(state.R[:, 1], self._wrench.raw))
        self._watch_safety(state)
        if self._law_changed:
            self._bridge.drop()
        self.lap("state")
        law = self._law()
        feedforward = self._feedforward(state, law.wrench)
        self.lap("law")
        solution = self._qp.solve(state, law.tasks, feedforward, law.limits)
        self._course.advance(self._period)
        tau = solution.tau
        if self._law_changed and self._tau is not None:
            self._bridge.span(self._tau - tau)
            tau = self._tau
        self._law_changed = False
        self._tau = tau
        self.lap("command")
        return tau.copy()

    def _begin(self, reference: Reference, state: ArmState) -> None:
        before = self._reference
        is_next = before is not None and before.then is not None and before.then is reference.trajectory
        if before is not None and is_next and reference.mode == "position":
            self._reference, self._pending = reference, None
            self._course = self._course.passed(reference.course, before.trajectory.duration)
            return
        was_regulated = self._contact.is_pressed and before is not None and before.mode == "hybrid"
        self._reference, self._pending = reference, None
        self._slowed, trajectory = 1.0, reference.course
        if reference.until_contact:
            self._slowed = near_contact(self._dynamics, reference, APPROACH_SPEED)
            trajectory = trajectory.slowed(self._slowed)
        self._course = Course.joined(trajectory, state.q, state.v, self._robot.a_max)
        self._law_changed = True
        self._contact.end()
        if reference.force > 0.0 and not reference.until_contact:
            self._press(reference, state, keeps_force=was_regulated and reference.mode == "hybrid")

    def _begin_hold(self, state: ArmState) -> None:
        self._reference, self._hold_pending = None, False
        self._course = Course.stop(state.q, state.v, STOPPING * self._robot.a_max)
        self._law_changed = True
        self._contact.end()

    def _stop(self, reason: Stop, state: ArmState) -> None:
        self.stopped = reason
        self._begin_hold(state)
        if isinstance(reason, Collision | ForceTooHigh):
            # Hold here, as stiffly as ever; but what came up suddenly is borne by no compensation.
            self._course = Course(Trajectory.standstill(state.q))
            self._unexplained = self._observer.unmodelled - self._observer.sudden

    def _watch_safety(self, state: ArmState) -> None:
        if self.stopped is not None:
            return
        guard, reference = self._guard, self._reference
        tau = _NO_TORQUE if self._tau is None else self._tau
        self._lingers = self._contact.linger()
        reason = guard.look(state.V, self._wrench.raw, self._observer.sudden, tau, self._lingers)
        if reason is None and reference is not None and reference.force > 0.0:
            reason = guard.sensor(self._wrench.is_silent)
        if reason is not None:
            self._stop(reason, state)

    def _press(self, reference: Reference, state: ArmState, keeps_force: bool = False) -> None:
        felt = along(reference.normal, self._wrench.raw)
        self._contact.begin(reference, felt, float(reference.normal @ state.p), keeps_force)

    def _watch_contact(self, state: ArmState) -> None:
        reference = self._reference
        change = self._contact.look(reference, along(self._normal, self._wrench.raw), self._weight)
        if change == "touched" and reference is not None:
            self._course.freeze()
            self._press(reference, state)
        elif change == "lost":
            self.contact_lost = True
            self._begin_hold(state)

    def _law(self) -> Law:
        """What is asked for at this instant."""
        reference, joints, contact = self._reference, self._course.now(), self._contact
        if reference is None or reference.mode == "position":
            return track(joints)
        if reference.mode == "hybrid" and not contact.is_pressed:
            return seek(joints, reference)
        target = self._dynamics.target(*joints)
        if reference.mode == "hybrid":
            return press(joints, target, reference, self._wrench, contact.loop)
        if contact.is_pressed:
            contact.loop.update(contact.loop.wanted)
            target = lowered(target, reference, contact.loop.wanted, contact.anchor)
        return comply(joints, target, reference, self._period)

    def _feedforward(self, state: ArmState, wrench: np.ndarray) -> np.ndarray:
        """Torques (7,) on top of the model's: what bridges a change of law, bears the wrench, makes up for errors."""
        lacking = self._observer.unmodelled if self._unexplained is None else self._unexplained
        feedforward = state.torques_of(wrench)
        _sum_up(self._bridge.advance(), self._compensation.advance(lacking), feedforward)
        if self._unexplained is not None:
            feedforward += cushion(state, self._robot)
        feedforward += self._bracing(state)
        return feedforward

    def _bracing(self, state: ArmState) -> np.ndarray:
        """Torques (7,) against whoever pushes the arm."""
        q, v, _ = self._course.now()
        return self._brace.bear(state, self._push(state), self._observer.prompt - self._compensation.torque, (q, v))

    def _push(self, state: ArmState) -> np.ndarray:
        """The wrench (6,) on the hand that is neither wanted nor borne by the law, nor the fingers' own doing."""
        reference, felt = self._reference, self._wrench
        if felt.is_silent:
            return _NO_WRENCH
        if reference is not None and reference.mode != "position":
            if reference.mode == "impedance":
                return _NO_WRENCH
            unborne = felt.credible - felt.smooth if self._contact.is_pressed else felt.credible
            return with_force_along(reference.normal, 0.0, unborne)
        if self._lingers and not self._brace.is_struck:
            # What was pressed on gives back what the pressing put into it.
            return _NO_WRENCH
        return with_force_along(state.R[:, 1], 0.0, felt.credible) if self._finger_work.goes_on else felt.credible


_UP = np.array([0.0, 0.0, 1.0])
_NO_TORQUE = np.zeros(7)
_NO_WRENCH = np.zeros(6)


@njit(cache=True)
def _sum_up(bridge: np.ndarray, lacking: np.ndarray, torques: np.ndarray) -> None:
    """From the torques (7,) of a wrench on the tool to those that balance it."""
    for i in range(len(torques)):
        torques[i] = bridge[i] - torques[i] - lacking[i]
