"""Taking the arm out of contact, straight up, before it stands and thinks."""

import numpy as np
import pinocchio as pin
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from planner.motion.trajectory import Trajectory
from sim.robot import RobotModel
from skills.context import SkillContext
from skills.control.reference import Reference

HEIGHT = 0.05
DURATION = 1.0
PATIENCE = 2.0
"""Seconds after which the arm counts as stopped, wherever it is."""

PUSHED = 0.3
"""Seconds for which an arm that was stopped by a push bears only what it bore before, then all that weighs on it."""

STEPS = 25
DAMPING = 1e-3


class LiftOff(Behaviour):
    """Lifts the tool 5 cm if it is in contact; otherwise stops the arm. Done when it stands still."""

    def __init__(self, context: SkillContext) -> None:
        super().__init__("lift off")
        self._context = context
        self._since = 0.0
        self._has_begun = False

    def initialise(self) -> None:
        self._since, self._has_begun = self._context.observation.t, False
        if self._context.scene.held is None:  # What was lost on the way weighs on nothing any more.
            self._context.controller.clear_payload()

    def _begin(self) -> None:
        context = self._context
        self._has_begun = True
        if context.controller.contact:
            trajectory = straight_up(context.robot, context.observation.q, HEIGHT, DURATION)
            context.controller.follow(Reference(trajectory))
            context.report("lifting_off")
        else:
            context.controller.hold()

    def update(self) -> Status:
        controller, waited = self._context.controller, self._context.observation.t - self._since
        if not self._has_begun:
            # What is stopped in the tick that puts the plan out of force tells the arm to hold, after this.
            if waited > 0.0:
                self._begin()
            return Status.RUNNING
        if controller.stopped is not None and waited > PUSHED:
            controller.acknowledge()
        return Status.SUCCESS if controller.finished or waited > PATIENCE else Status.RUNNING


def straight_up(robot: RobotModel, q: np.ndarray, height: float, duration: float) -> Trajectory:
    """Raise the tool `height` metres from configuration q (7,) with its orientation kept, in `duration` seconds.

    Damped differential inverse kinematics, clipped to the joint limits; the timing is a quintic.
    """
    data = robot.data()
    s = np.linspace(0.0, 1.0, STEPS)
    heights = height * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    path = [np.array(q, dtype=float)]
    for rise in np.diff(heights):
        J = pin.computeFrameJacobian(robot.model, data, path[-1], robot.tcp_id, pin.LOCAL_WORLD_ALIGNED)
        twist = np.array([0.0, 0.0, rise, 0.0, 0.0, 0.0])
        step = J.T @ np.linalg.solve(J @ J.T + DAMPING**2 * np.eye(6), twist)
        path.append(np.clip(path[-1] + step, robot.q_min, robot.q_max))
    times = s * duration
    knots = np.array(path)
    v = np.gradient(knots, times, axis=0)
    v[0] = v[-1] = 0.0
    return Trajectory(times, knots, v)
