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
    if held is None or trajectory.duration <= 2 * STEP:
        return trajectory
    times = np.arange(0.0, trajectory.duration + STEP, STEP)
    centres = np.array([robot.X_WG(trajectory.at(t)[0]).act(held.X_GO.translation) for t in times])
    acceleration = np.linalg.norm(np.diff(centres, 2, axis=0), axis=1).max() / STEP**2
    return trajectory.slowed(max(1.0, float(np.sqrt(acceleration / MAX_ACCELERATION))))
