"""What touches the hand: from the wrist sensor's wrench to the contact's, and when contact begins and ends."""

import math

import numpy as np
import pinocchio as pin

from sim.robot import GRAVITY, RobotModel
from sim.wrench import Wrench
from skills.control.force import smooth_step

SMOOTHING = 0.02
"""Time constant in seconds of the smoothed wrench."""

TARING = 0.15
"""Seconds over which readings are averaged for a tare, from when it is asked for."""

TARE_NOISE = 1.0
"""Newtons of smoothed force at which averaging for a tare ends early: this is no error of the sensor."""

SENSOR_ERROR = (1.0, 0.3)
"""N and Nm that an untared sensor may be off by."""

_GRAVITY = np.array([0.0, 0.0, -GRAVITY])


class ContactWrench:
    """Wrench that the world exerts on the tool, at G in W axes (6,): `raw`, and `smooth` (low-passed).

    The sensor also feels the weight and inertia of the hand and its load: both are taken off. The
    acceleration is the difference of measured velocities: one predicted by the model would miss what
    the contact itself does to the arm, up to half of the force in directions in which the arm is light.
    """

    def __init__(self, robot: RobotModel, period: float) -> None:
        self._robot = robot
        self._data = robot.data()
        self._hand = hand_inertia(robot)
        self._beyond_sensor = self._hand
        self._period = period
        self._last_v: np.ndarray | None = None
        self._blend = 1.0 - np.exp(-period / SMOOTHING)
        self._bias_G = np.zeros(6)
        self._smooth_G = np.zeros(6)
        self._taring: _Mean | None = None
        self.raw = np.zeros(6)
        self.smooth = np.zeros(6)
        self.is_silent = False

    def carry(self, load: pin.Inertia | None) -> None:
        """The hand holds `load` (in G) from now on, or nothing."""
        self._beyond_sensor = self._hand if load is None else self._hand + load

    def tare(self) -> None:
        """Take what is felt now for the sensor's and the model's error, at once; and what is still felt on average
        over the next TARING seconds. Only in the air, nearly still."""
        self._bias_G = self._bias_G + self._smooth_G
        self._smooth_G = np.zeros(6)
        self._taring = _Mean(round(TARING / self._period))

    def update(self, q: np.ndarray, v: np.ndarray, wrist: Wrench) -> None:
        """Read the sensor at configuration q and velocity v (7,), once every period. The first reading
        only prepares for the second. A reading that is not finite is left out: `is_silent`, and the last one stays."""
        last, self._last_v = self._last_v, v
        if last is None:
            return
        self.is_silent = not math.isfinite(wrist.force.sum() + wrist.torque.sum())
        if self.is_silent:
            return
        a = (v - last) / self._period
        robot, data = self._robot, self._data
        pin.forwardKinematics(robot.model, data, q, v, a)
        rotation = pin.updateFramePlacement(robot.model, data, robot.tcp_id).rotation
        twist = pin.getFrameVelocity(robot.model, data, robot.tcp_id, pin.ReferenceFrame.LOCAL)
        acceleration = pin.getFrameAcceleration(robot.model, data, robot.tcp_id, pin.ReferenceFrame.LOCAL)
        acceleration.linear = acceleration.linear - rotation.T @ _GRAVITY
        body = self._beyond_sensor
        momentum_rate = body * acceleration + twist.cross(body * twist)
        felt = robot.X_EG.actInv(pin.Force(wrist.vector))
        contact = (felt + momentum_rate).vector - self._bias_G
        if self._taring is not None:
            contact = self._go_on_taring(self._taring, contact)
        self._smooth_G = self._smooth_G + self._blend * (contact - self._smooth_G)
        self.raw = _in_axes(rotation, contact)
        self.smooth = _in_axes(rotation, self._smooth_G)

    @property
    def credible(self) -> np.ndarray:
        """`raw` (6,) as far as it is more than the sensor's own error: nothing below half of SENSOR_ERROR."""
        force, torque = self.raw[:3], self.raw[3:]
        size = math.sqrt(max(force @ force / SENSOR_ERROR[0] ** 2, torque @ torque / SENSOR_ERROR[1] ** 2))
        return self.raw * smooth_step(2.0 * size - 1.0)

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


def _in_axes(rotation: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    return (wrench.reshape(2, 3) @ rotation.T).ravel()
