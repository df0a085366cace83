"""How a motion begins where a sampling planner does badly: the hand is drawn straight back from among what hems it in,
and rises with what still stands on something."""

from collections.abc import Iterable, Iterator

import numpy as np
from pinocchio import SE3

from planner.motion.ik_numeric import track_numerically
from planner.motion.lines import interpolate
from sim.robot import RobotModel

HEMMED_IN = 0.015
"""Metres within which something stands that hems the arm in."""

WITHDRAWN = (0.12, 0.2, 0.06)
"""Metres by which the hand is drawn back, one after the other."""


RISES = (0.05, 0.02)
"""Metres by which the hand rises first with something that stands on what it stood on, one after the other."""


def lines_back(robot: RobotModel, q: np.ndarray) -> Iterator[np.ndarray]:
    """Joint paths (n,7) from q (7,) along which the gripper goes straight back, against z of its frame G."""
    X_WG = robot.X_WG(q)
    yield from _lines(robot, q, (X_WG * _shift(0.0, 0.0, -distance) for distance in WITHDRAWN))


def lines_up(robot: RobotModel, q: np.ndarray) -> Iterator[np.ndarray]:
    """Joint paths (n,7) from q (7,) along which the gripper goes straight up."""
    X_WG = robot.X_WG(q)
    yield from _lines(robot, q, (_shift(0.0, 0.0, rise) * X_WG for rise in RISES))


def _lines(robot: RobotModel, q: np.ndarray, ends: Iterable[SE3]) -> Iterator[np.ndarray]:
    for end in ends:
        line = track_numerically(robot, interpolate([robot.X_WG(q), end]), q)
        if line is not None:
            yield line


def _shift(x: float, y: float, z: float) -> SE3:
    return SE3(np.eye(3), np.array([x, y, z]))
