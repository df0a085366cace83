"""The arm's dynamics at one instant, everything the tasks and limits need of the model."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sim.robot import RobotModel

WORLD_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True, slots=True)
class ArmState:
    """Model quantities at configuration q and velocity v (7,).

    M (7,7) joint inertia; bias (7,) Coriolis and gravity torques. At the tool centre G, in W axes:
    J (6,7), drift (6,) = J̇ v (classical), p (3,), R (3,3), V (6,).
    """

    q: np.ndarray
    v: np.ndarray
    M: np.ndarray
    bias: np.ndarray
    J: np.ndarray
    drift: np.ndarray
    p: np.ndarray
    R: np.ndarray
    V: np.ndarray

    @property
    def mobility(self) -> np.ndarray:
        """J M⁻¹ Jᵀ (6,6), the inverse of the task-space inertia Λ."""
        return self.J @ np.linalg.solve(self.M, self.J.T)


@dataclass(frozen=True, slots=True)
class Target:
    """A pose to follow: p (3,) and R (3,3) in W, velocity V (6,) and acceleration A (6,) in W axes."""

    p: np.ndarray
    R: np.ndarray
    V: np.ndarray
    A: np.ndarray


_AT_REST = np.zeros(7)


def measure(robot: RobotModel, data: pin.Data, q: np.ndarray, v: np.ndarray) -> ArmState:
    """Evaluate the model at q, v (7,). `data` is overwritten."""
    model, tool = robot.model, robot.tcp_id
    bias = pin.nonLinearEffects(model, data, q, v)
    M = pin.crba(model, data, q)
    J = np.ascontiguousarray(pin.computeFrameJacobian(model, data, q, tool, WORLD_AXES))
    pin.forwardKinematics(model, data, q, v, _AT_REST)
    pose = pin.updateFramePlacement(model, data, tool)
    return ArmState(
        q=q,
        v=v,
        M=M.copy(),
        bias=bias.copy(),
        J=J,
        drift=pin.getFrameClassicalAcceleration(model, data, tool, WORLD_AXES).vector,
        p=pose.translation.copy(),
        R=pose.rotation.copy(),
        V=J @ v,
    )


def target_at(robot: RobotModel, data: pin.Data, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> Target:
    """The tool's motion when the joints are at q with velocity v and acceleration a (7,). `data` is overwritten."""
    model, tool = robot.model, robot.tcp_id
    pin.forwardKinematics(model, data, q, v, a)
    pose = pin.updateFramePlacement(model, data, tool)
    return Target(
        p=pose.translation.copy(),
        R=pose.rotation.copy(),
        V=pin.getFrameVelocity(model, data, tool, WORLD_AXES).vector,
        A=pin.getFrameClassicalAcceleration(model, data, tool, WORLD_AXES).vector,
    )
