"""How fast a held object may be carried without slipping in the hand."""

import numpy as np

from planner.motion.trajectory import Trajectory
from sim.robot import RobotModel
from sim.scene import Held

MAX_ACCELERATION = 2.0
"""m/s² of the held object's centre: friction at the pads must bring it about, on top of its weight."""

STEP = 0.02


def carried(robot: RobotModel, trajectory: Trajectory, held: Held | None) -> Trajectory:
    """The trajectory, slowed down as far as the acceleration of what the hand holds asks for."""
    peak = acceleration(robot, trajectory, held)
    return trajectory if peak <= MAX_ACCELERATION else trajectory.slowed(float(np.sqrt(peak / MAX_ACCELERATION)))


def acceleration(robot: RobotModel, trajectory: Trajectory, held: Held | None) -> float:
    """The largest acceleration in m/s² of the held object's centre, over STEP seconds; 0 with an empty hand."""
    if held is None or trajectory.duration <= 2 * STEP:
        return 0.0
    times = np.arange(0.0, trajectory.duration + STEP, STEP)
    centres = np.array([robot.X_WG(trajectory.at(t)[0]).act(held.X_GO.translation) for t in times])
    return float(np.linalg.norm(np.diff(centres, 2, axis=0), axis=1).max()) / STEP**2
