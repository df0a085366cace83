"""The paper's hybrid force–position control: a PD law for the pose, a force along z that nobody measures.

    τ = Jᵀ F_d + g(q),  F_d = (PD on x and y, −f along z; PD on the orientation)

Section IV of the paper, after Tedrake, "Robotic Manipulation", on direct force control. It gives no gains and
says that tuning them was hard; these are stiff enough to lead the sponge and damp the unloaded hand.
It lives here because only a comparison needs it.
"""

import numpy as np
import pinocchio as pin

from planner.motion.trajectory import Trajectory
from sim.plant import Observation
from sim.robot import RobotModel
from skills.control.dynamics import Dynamics
from skills.control.tasks import pose_error

STIFFNESS = np.array([1000.0, 1000.0, 0.0, 50.0, 50.0, 50.0])
DAMPING = np.array([60.0, 60.0, 60.0, 1.5, 1.5, 1.5])
"""N s/m and Nm s/rad."""

POSTURE_DAMPING = 1.0
"""Nm s/rad in the joints: the law itself leaves the elbow free."""


class OpenLoopHybrid:
    """Presses with `force` N along −z of W while the tool follows a trajectory in x, y and orientation."""

    def __init__(self, robot: RobotModel, trajectory: Trajectory, force: float, start: float) -> None:
        self._robot, self._data, self._dynamics = robot, robot.data(), Dynamics(robot)
        self._trajectory, self._start = trajectory, start
        self._push = np.array([0.0, 0.0, -force, 0.0, 0.0, 0.0])

    def update(self, observation: Observation) -> np.ndarray:
        """Torques (7,) in Nm for the next period."""
        q, v = observation.q, observation.v
        target = self._dynamics.target(*self._trajectory.at(observation.t - self._start))
        state = self._dynamics.state(q, v)
        gravity = pin.computeGeneralizedGravity(self._robot.model, self._data, q)
        wrench = STIFFNESS * pose_error(target, state) + DAMPING * (target.V - state.V) + self._push
        wrench[2] = self._push[2] - DAMPING[2] * state.V[2]
        return state.J.T @ wrench + gravity - POSTURE_DAMPING * v
