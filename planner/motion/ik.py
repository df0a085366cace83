"""Closed-form inverse kinematics of an arm with spherical shoulder, elbow and spherical wrist.

The wrist's position fixes the elbow's angle, and leaves the elbow a circle about the line from
shoulder to wrist: its place there is the swivel angle, 0 with the elbow uppermost. Shoulder and
wrist then follow as two sets of z-y-z angles. Each of the three groups has a twin (first angle
half a turn on, second negated, third half a turn on) in which every link stands turned about its
own axis, hence eight branches.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from pinocchio import SE3

from sim.robot import RobotModel

BRANCHES = 8
SWIVELS = np.radians(np.arange(-180.0, 180.0, 15.0))
"""Swivel angles tried when none are asked for."""


class WristPoses(NamedTuple):
    """Where the wrist has to be, in the robot's base: rotations R (k,3,3) and positions p (k,3)."""

    R: np.ndarray
    p: np.ndarray


class ClosedFormIK:
    """All configurations of one robot that bring the gripper to a pose. Raises ValueError for another kind of arm."""

    def __init__(self, robot: RobotModel) -> None:
        X_BW = robot.X_WB.inverse()
        neutral = np.zeros(7)
        poses = robot.link_poses(neutral, 0.0)
        X_BL = [X_BW * poses[link] for link in robot.links[1:8]]
        self._signs, self._lengths = _dimensions(robot.name, X_BL)
        self._limits = np.stack([robot.q_min, robot.q_max])
        self._X_BW = X_BW
        self._X_Gw = (X_BW * robot.X_WG(neutral)).actInv(SE3(np.eye(3), X_BL[5].translation))

    def ik(self, X_WG: SE3, swivels: np.ndarray = SWIVELS) -> np.ndarray:
        """Configurations (n,7) within the joint limits at the given swivel angles (rad), largest margin first."""
        wrist = self.wrist_poses(X_WG.rotation[None], X_WG.translation[None])
        margins = self.margins(wrist, swivels)[0]
        order = np.argsort(-margins, axis=None, kind="stable")[: int(np.count_nonzero(margins >= 0.0))]
        chosen, branches = np.unravel_index(order, margins.shape)
        repeated = WristPoses(np.repeat(wrist.R, len(order), axis=0), np.repeat(wrist.p, len(order), axis=0))
        return self.follow(repeated, np.asarray(swivels)[chosen], branches)

    def wrist_poses(self, R_WG: np.ndarray, p_WG: np.ndarray) -> WristPoses:
        """Wrist poses for gripper poses: rotations R_WG (k,3,3) and positions p_WG (k,3)."""
        R_BW, R_BG = self._X_BW.rotation, self._X_BW.rotation @ R_WG
        p_BG = p_WG @ R_BW.T + self._X_BW.translation
        return WristPoses(R_BG @ self._X_Gw.rotation, p_BG + R_BG @ self._X_Gw.translation)

    def margins(self, wrists: WristPoses, swivels: np.ndarray) -> np.ndarray:
        """Distance in rad from the nearest joint limit, negative beyond it, −inf out of reach: (k, s, 8) for k poses,
        s swivel angles, and each branch."""
        found = np.empty((len(wrists.p), len(swivels), BRANCHES))
        _fill_margins(*wrists, np.array(swivels, dtype=float), self._lengths, self._signs, self._limits, found)
        return found

    def follow(self, wrists: WristPoses, swivels: np.ndarray, branches: np.ndarray) -> np.ndarray:
        """One configuration for each pose: (k,7), for swivel angles (k,) and branches (k,). NaN out of reach."""
        found = np.empty((len(wrists.p), 7))
        angles, numbers = np.array(swivels, dtype=float), np.array(branches, dtype=np.int64)
        _fill_solutions(*wrists, angles, numbers, self._lengths, self._signs, found)
        return found

    def margin(self, q: np.ndarray) -> float:
        """Smallest distance in rad of configurations q (…,7) from a joint limit, negative beyond it, −inf for NaN."""
        nearest = float(np.minimum(q - self._limits[0], self._limits[1] - q).min())
        return -np.inf if np.isnan(nearest) else nearest


def _dimensions(name: str, X_BL: list[SE3]) -> tuple[np.ndarray, np.ndarray]:
    """Senses of the joints (7,) about z, y, z, y, z, y, z and (base to shoulder, upper arm, forearm) in metres."""
    signs = np.zeros(7)
    for k, X in enumerate(X_BL):
        axis = X.rotation[:, 2]
        signs[k] = axis[2 if k % 2 == 0 else 1]
    heights = np.array([X.translation[2] for X in X_BL])
    off_axis = max(float(np.abs(X.translation[:2]).max()) for X in X_BL)
    if off_axis > 1e-9 or not np.allclose(np.abs(signs), 1.0, atol=1e-9):
        raise ValueError(f"robot {name!r}: joint axes z, y, z, y, z, y, z along one line at q = 0 expected")
    return np.round(signs), np.array([heights[1], heights[3] - heights[1], heights[5] - heights[3]])


@njit(cache=True)
def _wrap(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


@njit(cache=True)
def _zyz(m02, m12, m22, m20, m21, m00, m10):
    """Angles (a, b ≥ 0, c) with Rz(a) Ry(b) Rz(c) = M, from some of M's entries; a = 0 where b is 0 or π."""
    sine = np.hypot(m02, m12)
    if sine < 1e-9:
        sense = 1.0 if m22 > 0 else -1.0
        return 0.0, np.arctan2(0.0, m22), np.arctan2(m10, sense * m00)
    return np.arctan2(m12, m02), np.arctan2(sine, m22), np.arctan2(m21, -m20)


@njit(cache=True)
def _solve(R, p, swivel, lengths, a):
    """Write the angles a (7,) about z, y, z, y, z, y, z of the first branch; False out of reach."""
    wx, wy, wz = p[0], p[1], p[2] - lengths[0]
    upper, fore = lengths[1], lengths[2]
    reach = np.sqrt(wx * wx + wy * wy + wz * wz)
    cosine = (reach * reach - upper * upper - fore * fore) / (2 * upper * fore)
    if reach < 1e-9 or abs(cosine) > 1.0 + 1e-9:
        return False
    cosine = min(1.0, max(-1.0, cosine))
    sine = np.sqrt(1.0 - cosine * cosine)
    wx, wy, wz = wx / reach, wy / reach, wz / reach
    # Height of the elbow's circle along the line to the wrist, and its radius, as parts of the upper arm.
    along, across = (upper + fore * cosine) / reach, fore * sine / reach
    # Reference direction e: straight up, square to the line to the wrist; f = w × e.
    if abs(wz) < 1.0 - 1e-9:
        ex, ey, ez = -wz * wx, -wz * wy, 1.0 - wz * wz
    else:
        ex, ey, ez = 1.0 - wx * wx, -wx * wy, -wx * wz
    norm = np.sqrt(ex * ex + ey * ey + ez * ez)
    ex, ey, ez = ex / norm, ey / norm, ez / norm
    fx, fy, fz = wy * ez - wz * ey, wz * ex - wx * ez, wx * ey - wy * ex
    c, s = np.cos(swivel), np.sin(swivel)
    ox, oy, oz = c * ex + s * fx, c * ey + s * fy, c * ez + s * fz
    # Upper arm along u; x points to the side to which the forearm bends; y = u × x.
    ux, uy, uz = along * wx + across * ox, along * wy + across * oy, along * wz + across * oz
    xx, xy, xz = across * wx - along * ox, across * wy - along * oy, across * wz - along * oz
    yx, yy, yz = uy * xz - uz * xy, uz * xx - ux * xz, ux * xy - uy * xx
    # Forearm along v, after the elbow; g completes its frame with y.
    vx, vy, vz = cosine * ux + sine * xx, cosine * uy + sine * xy, cosine * uz + sine * xz
    gx, gy, gz = cosine * xx - sine * ux, cosine * xy - sine * uy, cosine * xz - sine * uz
    a[0], a[1], a[2] = _zyz(ux, uy, uz, xz, yz, xx, xy)
    a[3] = np.arctan2(sine, cosine)
    a[4], a[5], a[6] = _zyz(
        gx * R[0, 2] + gy * R[1, 2] + gz * R[2, 2],
        yx * R[0, 2] + yy * R[1, 2] + yz * R[2, 2],
        vx * R[0, 2] + vy * R[1, 2] + vz * R[2, 2],
        vx * R[0, 0] + vy * R[1, 0] + vz * R[2, 0],
        vx * R[0, 1] + vy * R[1, 1] + vz * R[2, 1],
        gx * R[0, 0] + gy * R[1, 0] + gz * R[2, 0],
        yx * R[0, 0] + yy * R[1, 0] + yz * R[2, 0],
    )
    return True


@njit(cache=True)
def _branch(a, branch, signs, q):
    """Write the configuration q (7,) of a branch (bits: shoulder, elbow, wrist) from the first branch's angles."""
    shoulder, elbow, wrist = branch & 1, (branch >> 1) & 1, (branch >> 2) & 1
    q[0] = signs[0] * _wrap(a[0] + np.pi * shoulder)
    q[1] = signs[1] * a[1] * (1 - 2 * shoulder)
    q[2] = signs[2] * _wrap(a[2] + np.pi * (shoulder + elbow))
    q[3] = signs[3] * a[3] * (1 - 2 * elbow)
    q[4] = signs[4] * _wrap(a[4] + np.pi * (elbow + wrist))
    q[5] = signs[5] * a[5] * (1 - 2 * wrist)
    q[6] = signs[6] * _wrap(a[6] + np.pi * wrist)


@njit(cache=True)
def _fill_margins(R, p, swivels, lengths, signs, limits, found):
    a, q = np.empty(7), np.empty(7)
    for k in range(p.shape[0]):
        for s in range(swivels.shape[0]):
            reachable = _solve(R[k], p[k], swivels[s], lengths, a)
            for branch in range(8):
                margin = np.inf if reachable else -np.inf
                if reachable:
                    _branch(a, branch, signs, q)
                    for i in range(7):
                        margin = min(margin, q[i] - limits[0, i], limits[1, i] - q[i])
                found[k, s, branch] = margin


@njit(cache=True)
def _fill_solutions(R, p, swivels, branches, lengths, signs, found):
    a = np.empty(7)
    for k in range(p.shape[0]):
        if _solve(R[k], p[k], swivels[k], lengths, a):
            _branch(a, branches[k], signs, found[k])
        else:
            for i in range(7):
                found[k, i] = np.nan
