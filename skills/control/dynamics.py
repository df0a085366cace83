"""What the controller needs of the arm's model at every tick, by Pinocchio."""

import numpy as np
import pinocchio as pin

from sim.robot import RobotModel
from skills.control.state import ArmState, Target

WORLD_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Dynamics:
    """The model of a robot with what it holds, and Pinocchio's room to work in."""

    def __init__(self, robot: RobotModel) -> None:
        self._model, self._data, self._tool = robot.model, robot.data(), robot.tcp_id
        self._no_acceleration = np.zeros(robot.model.nv)

    def state(self, q: np.ndarray, v: np.ndarray) -> ArmState:
        """The model evaluated at q, v (7,)."""
        model, data, tool = self._model, self._data, self._tool
        # Pinocchio hands out views of its data, which the next call overwrites.
        bias = pin.nonLinearEffects(model, data, q, v).copy()
        M = pin.crba(model, data, q).copy()
        J = np.ascontiguousarray(pin.computeFrameJacobian(model, data, q, tool, WORLD_AXES))
        pin.forwardKinematics(model, data, q, v, self._no_acceleration)
        pose = pin.updateFramePlacement(model, data, tool)
        drift = pin.getFrameClassicalAcceleration(model, data, tool, WORLD_AXES).vector
        return ArmState(q, v, M, bias, J, drift, pose.translation.copy(), _rotation(pose), J @ v)

    def target(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> Target:
        """The tool's motion when the joints are at q with velocity v and acceleration a (7,)."""
        model, data, tool = self._model, self._data, self._tool
        pin.forwardKinematics(model, data, q, v, a)
        pose = pin.updateFramePlacement(model, data, tool)
        V = pin.getFrameVelocity(model, data, tool, WORLD_AXES).vector
        A = pin.getFrameClassicalAcceleration(model, data, tool, WORLD_AXES).vector
        return Target(pose.translation.copy(), _rotation(pose), V, A)


def _rotation(pose: pin.SE3) -> np.ndarray:
    return np.ascontiguousarray(pose.rotation)
