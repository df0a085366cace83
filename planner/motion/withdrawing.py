"""Drawing the hand straight back from among what hems it in: a slot that a sampling planner seldom finds."""

from collections.abc import Iterator

import numpy as np
from pinocchio import SE3

from planner.motion.ik_numeric import track_numerically
from planner.motion.lines import interpolate
from sim.robot import RobotModel

HEMMED_IN = 0.015
"""Metres within which something stands that hems the arm in."""

WITHDRAWN = (0.12, 0.2, 0.06)
"""Metres by which the hand is drawn back, one after the other."""


def lines_back(robot: RobotModel, q: np.ndarray) -> Iterator[np.ndarray]:
    """Joint paths (n,7) from q (7,) along which the gripper goes straight back, against z of its frame G."""
    X_WG = robot.X_WG(q)
    for distance in WITHDRAWN:
        back = X_WG * SE3(np.eye(3), np.array([0.0, 0.0, -distance]))
        line = track_numerically(robot, interpolate([X_WG, back]), q)
        if line is not None:
            yield line
