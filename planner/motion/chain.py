"""The robot's chain as tables for compiled code, and its forward kinematics for many configurations at once.

A placement is 12 numbers: the rotation row by row, then the origin.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
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


def tcp_speeds(robot: RobotModel, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Speeds (n,) of the gripper frame's origin in m/s at q (n,7) with the joint velocities v (n,7)."""
    return _tcp_speeds(place_links(robot, q), robot.model.frames[robot.tcp_id].placement.translation, v)


@njit(cache=True)
def _tcp_speeds(X, p_7G, v):
    """X (n,8,12): placements of the links, each of which turns about its own z."""
    speeds = np.empty(len(X))
    for k in range(len(X)):
        last = X[k, 7]
        V = np.zeros(3)
        for j in range(7):
            link = X[k, j + 1]
            x = last[9] + last[0] * p_7G[0] + last[1] * p_7G[1] + last[2] * p_7G[2] - link[9]
            y = last[10] + last[3] * p_7G[0] + last[4] * p_7G[1] + last[5] * p_7G[2] - link[10]
            z = last[11] + last[6] * p_7G[0] + last[7] * p_7G[1] + last[8] * p_7G[2] - link[11]
            V[0] += v[k, j] * (link[5] * z - link[8] * y)
            V[1] += v[k, j] * (link[8] * x - link[2] * z)
            V[2] += v[k, j] * (link[2] * y - link[5] * x)
        speeds[k] = np.sqrt(V[0] ** 2 + V[1] ** 2 + V[2] ** 2)
    return speeds


def tcp_path(robot: RobotModel, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (n,3,3) and positions (n,3) of the gripper frame in W at q (n,7)."""
    last = place_links(robot, q)[:, 7]
    R, p = last[:, :9].reshape(-1, 3, 3), last[:, 9:]
    X_7G = robot.model.frames[robot.tcp_id].placement
    return R @ X_7G.rotation, p + R @ X_7G.translation
