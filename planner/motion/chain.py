"""The robot's chain as tables for compiled code, and its forward kinematics for many configurations at once.

A placement is 12 numbers: the rotation row by row, then the origin.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from pinocchio import SE3

from planner.motion.kernels import place_all_links
from sim.robot import RobotModel


class Chain(NamedTuple):
    """Placements of the joints in the previous link, joints (7,12), and of link 0 in W, base (12,)."""

    joints: np.ndarray
    base: np.ndarray


@lru_cache(maxsize=16)
def chain(robot: RobotModel) -> Chain:
    """The robot's chain. Raises ValueError unless it is seven revolute joints about z."""
    if any(joint.shortname() != "JointModelRZ" for joint in robot.model.joints[1:]) or robot.model.nq != 7:
        raise ValueError(f"robot {robot.name!r}: seven revolute joints about z expected")
    # Pinocchio places the first joint in W.
    first, *others = robot.model.jointPlacements[1:]
    joints = np.array([placement(X) for X in (robot.X_WB.inverse() * first, *others)])
    return Chain(joints, placement(robot.X_WB))


def placement(X: SE3) -> np.ndarray:
    """The 12 numbers of a pose."""
    return np.concatenate([X.rotation.ravel(), X.translation])


def place_links(robot: RobotModel, q: np.ndarray) -> np.ndarray:
    """Placements (n,8,12) of links 0 to 7 in W at q (n,7)."""
    joints, base = chain(robot)
    return place_all_links(np.array(q, dtype=float), base, joints)


def tcp_path(robot: RobotModel, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (n,3,3) and positions (n,3) of the gripper frame in W at q (n,7)."""
    last = place_links(robot, q)[:, 7]
    R, p = last[:, :9].reshape(-1, 3, 3), last[:, 9:]
    X_7G = robot.model.frames[robot.tcp_id].placement
    return R @ X_7G.rotation, p + R @ X_7G.translation
