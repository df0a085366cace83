"""What touches the hand: from the wrist sensor's wrench to the contact's, and when contact begins and ends."""

import math

import numpy as np
import pinocchio as pin
from numba import njit

from sim.robot import GRAVITY, RobotModel
from sim.wrench import Wrench
from skills.control.force import smooth_step
from skills.control.state import ArmState
from skills.control.vectors import cross, turn, turn_back

SMOOTHING = 0.02
"""Time constant in seconds of the smoothed wrench."""

TARING = 0.15
"""Seconds over which readings are averaged for a tare, from when it is asked for."""

TARE_NOISE = 1.0
"""Newtons of smoothed force at which averaging for a tare ends early: this is no error of the sensor."""

SENSOR_ERROR = (1.0, 0.3)
"""N and Nm that an untared sensor may be off by."""


STUCK = 0.02
"""Seconds of the very same reading, to the last bit, after which the sensor is taken for frozen: a live one varies."""


class ContactWrench:
    """Wrench that the world exerts on the tool, at G in W axes (6,): `raw`; `smooth`, low-passed; and `credible`, which
    is `raw` as far as it is more than the sensor's own error.

    The sensor also feels the weight and inertia of the hand and its load: both are taken off. The
    acceleration is the difference of measured velocities: one predicted by the model would miss what
    the contact itself does to the arm, up to half of the force in directions in which the arm is light.
    """

    def __init__(self, robot: RobotModel, period: float) -> None:
        self._hand = hand_inertia(robot)
        self._R_GE, self._p_GE = robot.X_EG.inverse().rotation, robot.X_EG.inverse().translation
        self._period = period
        self._last_v: np.ndarray | None = None
        self.carry(None)
        self._blend = 1.0 - np.exp(-period / SMOOTHING)
        self._bias_G = np.zeros(6)
        self._smooth_G = np.zeros(6)
        self._taring: _Mean | None = None
        self._told: tuple[float, ...] = ()
        self._stuck = 0.0
        self.raw, self.smooth, self.credible = np.zeros(6), np.zeros(6), np.zeros(6)
        self.is_silent = False

    def carry(self, load: pin.Inertia | None) -> None:
        """The hand holds `load` (in G) from now on, or nothing."""
        body = self._hand if load is None else self._hand + load
        self._body = (body.mass, body.lever.copy(), body.inertia.copy(), self._R_GE, self._p_GE)

    def tare(self) -> None:
        """Take what is felt now for the sensor's and the model's error, at once; and what is still felt on average
        over the next TARING seconds. Only in the air, nearly still."""
        self._bias_G = self._bias_G + self._smooth_G
        self._smooth_G = np.zeros(6)
        self._taring = _Mean(round(TARING / self._period))

    def update(self, state: ArmState, wrist: Wrench) -> None:
        """Read the sensor, once every period, the arm being in `state`. The first reading only prepares for the
        second. A reading that is not finite is left out, and the last one stays: `is_silent`, as when the sensor goes
        on telling the very same."""
        last, self._last_v = self._last_v, state.v
        if last is None:
            return
        told = (*wrist.force.tolist(), *wrist.torque.tolist())
        self._stuck = self._stuck + self._period if told == self._told else 0.0
        self._told = told
        contact, body, motion = np.empty(6), self._body, (state.J, state.drift, state.V, state.R)
        is_number = _contact_wrench(
            last, state.v, self._period, *motion, *body, wrist.force, wrist.torque, self._bias_G, contact
        )
        self.is_silent = not is_number or self._stuck > STUCK
        if not is_number:
            return
        if self._taring is not None:
            contact = self._go_on_taring(self._taring, contact)
        self.raw, self.smooth, self.credible = np.empty(6), np.empty(6), np.empty(6)
        _smooth(contact, self._blend, state.R, self._smooth_G, self.raw, self.smooth, self.credible)

    def _go_on_taring(self, mean: "_Mean", contact: np.ndarray) -> np.ndarray:
        force = self._smooth_G[:3]
        if force @ force > TARE_NOISE**2:
            self._taring = None
        elif mean.add(contact):
            self._taring = None
            self._bias_G = self._bias_G + mean.value
            self._smooth_G = self._smooth_G - mean.value
            return contact - mean.value
        return contact


class _Mean:
    """The mean of so many readings (6,)."""

    def __init__(self, count: int) -> None:
        self._count, self._so_far = count, 0
        self._sum = np.zeros(6)

    def add(self, reading: np.ndarray) -> bool:
        """Take in one more. Returns whether these were all."""
        self._sum += reading
        self._so_far += 1
        return self._so_far >= self._count

    @property
    def value(self) -> np.ndarray:
        return self._sum / self._so_far


class Touch:
    """Whether there is contact, from the normal force at each tick, debounced in both directions."""

    threshold = 1.0
    """Force in N taken for contact; below half of it contact ends."""

    onset = 0.006
    """Seconds that the force must be there."""

    release = 0.03
    """Seconds that it must be gone."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._contrary = 0.0
        self.closed = False

    def update(self, force: float) -> bool:
        """Take in the normal force in N (pressing is positive). Returns whether the state changed."""
        contrary = force < self.threshold / 2 if self.closed else force > self.threshold
        self._contrary = self._contrary + self._period if contrary else 0.0
        if self._contrary < (self.release if self.closed else self.onset) - 1e-9:
            return False
        self.closed = not self.closed
        self._contrary = 0.0
        return True


def hand_inertia(robot: RobotModel) -> pin.Inertia:
    """Inertia in G of everything the wrist sensor carries: the bodies that the URDF fixes to the last link."""
    model = robot.model
    tool = model.frames[robot.tcp_id]
    total = pin.Inertia.Zero()
    for frame in model.frames:
        if frame.parentJoint == tool.parentJoint and frame.inertia.mass > 0.0:
            total += tool.placement.actInv(frame.placement).act(frame.inertia)
    return total


@njit(cache=True)
def along(normal: np.ndarray, wrench: np.ndarray) -> float:
    """The part in N along `normal` (3,), a unit vector, of the force of a wrench (6,)."""
    return normal[0] * wrench[0] + normal[1] * wrench[1] + normal[2] * wrench[2]


def with_force_along(normal: np.ndarray, force: float, wrench: np.ndarray) -> np.ndarray:
    """The wrench (6,) with a force of so many N along `normal` (3,), a unit vector, in place of its own."""
    changed = np.empty(6)
    _put_along(normal, force, wrench, changed)
    return changed


@njit(cache=True)
def _put_along(normal, force, wrench, changed):
    missing = force - along(normal, wrench)
    for i in range(3):
        changed[i] = wrench[i] + normal[i] * missing
        changed[3 + i] = wrench[3 + i]


@njit(cache=True)
def _believe(raw, credible):
    """Nothing below half of SENSOR_ERROR, everything above it."""
    force = math.sqrt(raw[0] ** 2 + raw[1] ** 2 + raw[2] ** 2)
    torque = math.sqrt(raw[3] ** 2 + raw[4] ** 2 + raw[5] ** 2)
    share = smooth_step(2.0 * max(force / SENSOR_ERROR[0], torque / SENSOR_ERROR[1]) - 1.0)
    for i in range(6):
        credible[i] = share * raw[i]


@njit(cache=True)
def _smooth(contact, blend, R, smooth_G, raw, smooth, credible):
    """Blend the wrench `contact` (6,), in G, into `smooth_G`, and turn both into W's axes: `raw` and `smooth`."""
    for i in range(6):
        smooth_G[i] += blend * (contact[i] - smooth_G[i])
    for part in (0, 3):
        for i in range(3):
            raw[part + i] = smooth[part + i] = 0.0
            for j in range(3):
                raw[part + i] += R[i, j] * contact[part + j]
                smooth[part + i] += R[i, j] * smooth_G[part + j]
    _believe(raw, credible)


@njit(cache=True)
def _contact_wrench(
    v_before, v, period, J, drift, V, R, mass, lever, inertia, R_GE, p_GE, force, torque, bias_G, contact
):
    """What acts on the tool from outside (6,), about G in its axes: what the sensor feels (force, torque in E) less
    weight and inertia of the body beyond it, by Newton and Euler, and less its bias. False if it feels no number."""
    total = 0.0
    for i in range(3):
        total += force[i] + torque[i]
    if not math.isfinite(total):
        return False
    # Accelerations of G, linear before angular; gravity counts as an acceleration upwards.
    rates = np.empty(6)
    for k in range(6):
        rates[k] = drift[k]
        for j in range(7):
            rates[k] += J[k, j] * (v[j] - v_before[j]) / period
    rates[2] += GRAVITY
    lift, swing, spin = turn_back(R, rates[:3]), turn_back(R, rates[3:]), turn_back(R, V[3:])
    swung, spun = cross(swing, lever), cross(spin, cross(spin, lever))
    centre = (lift[0] + swung[0] + spun[0], lift[1] + swung[1] + spun[1], lift[2] + swung[2] + spun[2])
    rolling, gyration, thrown = turn(inertia, swing), cross(spin, turn(inertia, spin)), cross(lever, centre)
    push, twist = turn(R_GE, force), turn(R_GE, torque)
    pried = cross(p_GE, push)
    for i in range(3):
        contact[i] = push[i] + mass * centre[i] - bias_G[i]
        contact[3 + i] = twist[i] + pried[i] + rolling[i] + gyration[i] + mass * thrown[i] - bias_G[3 + i]
    return True
