"""Straight lines of the hand as joint paths: one arm branch followed all along, the elbow drifting evenly.

A branch is judged by the smallest distance from a joint limit anywhere on its path, not by where
it starts: the nearest start can run into a limit half way.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from planner.motion.ik import BRANCHES, ClosedFormIK, WristPoses

STEP = 0.01
"""Largest distance in metres between two poses of a path."""

TURN = np.radians(2.0)
"""Largest angle in rad between two poses of a path."""

MIN_MARGIN = 0.08
"""Least distance in rad from every joint limit along a path."""

MAX_JOINT_STEP = 0.12
"""Largest joint step in rad between two poses of a path: more means a singular stretch or a jump of branch."""

MAX_PATHS = 8

_MARGIN_CLASSES = (0.15, 0.25)
_SWIVEL_COST = 0.5
_DRIFT_COST = 0.5
"""Seconds of motion that an elbow one rad off "up", or moving by one rad, counts for in choosing among paths."""

_GRID_STEP = np.radians(10.0)
_GRID = np.arange(-18, 18) * _GRID_STEP
_DRIFTS = np.array([0, -4, 4, -8, 8])
"""Swivel drifts over a whole path, in grid steps."""

_ALIKE = 3.0
"""Grid steps below which the mean swivels of two paths count as the same posture."""

_COARSE = 4
"""Every so many poses the margins of all branches and swivels are computed, to choose from."""


@dataclass(frozen=True)
class CartesianPath:
    """Poses of the gripper along a polyline; `corners` are the indices of the waypoints it was made of.

    R_WG (n,3,3), p_WG (n,3). progress (n,): how far along each pose is, from 0 to 1, a turn counted at
    the rate of TURN to STEP.
    """

    R_WG: np.ndarray
    p_WG: np.ndarray
    corners: tuple[int, ...]
    progress: np.ndarray


def interpolate(waypoints: Sequence[SE3]) -> CartesianPath:
    """Poses along the polyline, at most STEP and TURN apart: positions linear, orientations at constant rate."""
    R, p, way, corners = [waypoints[0].rotation[None]], [waypoints[0].translation[None]], [np.zeros(1)], [0]
    for X_WA, X_WB in pairwise(waypoints):
        offset = X_WB.translation - X_WA.translation
        turn = pin.log3(X_WA.rotation.T @ X_WB.rotation)
        steps = max(float(np.linalg.norm(offset)) / STEP, float(np.linalg.norm(turn)) / TURN)
        fractions = np.linspace(0.0, 1.0, max(1, int(np.ceil(steps - 1e-9))) + 1)[1:]
        R.append(X_WA.rotation @ _turns(turn, fractions))
        p.append(X_WA.translation + offset * fractions[:, None])
        way.append(way[-1][-1] + steps * fractions)
        corners.append(corners[-1] + len(fractions))
    progress = np.concatenate(way)
    return CartesianPath(
        np.concatenate(R), np.concatenate(p), tuple(corners), progress / max(float(progress[-1]), 1e-12)
    )


def _turns(turn: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Rotation matrices (n,3,3) of parts (n,) of a rotation vector (3,), by Rodrigues' formula."""
    angle = float(np.linalg.norm(turn))
    K = pin.skew(turn / max(angle, 1e-12))
    angles = (angle * fractions)[:, None, None]
    return np.eye(3) + np.sin(angles) * K + (1.0 - np.cos(angles)) * (K @ K)


def track(
    ik: ClosedFormIK, path: CartesianPath, speed: np.ndarray, near: np.ndarray | None = None
) -> Iterator[np.ndarray]:
    """Joint paths (n,7) through all poses, best first, at most MAX_PATHS.

    Every joint stays MIN_MARGIN clear of its limits and moves at most MAX_JOINT_STEP from pose to
    pose. Paths with a larger worst margin come first (in classes up to 0.25 rad, beyond which more
    is no better); among equals postures that differ, then those soon reached from `near` (7,) at
    joint speeds `speed` (7,) and with the elbow high. None at all: the line can't be followed.
    """
    wrists = ik.wrist_poses(path.R_WG, path.p_WG)
    coarse = np.unique([*range(0, len(path.p_WG), _COARSE), *path.corners])
    margins = ik.margins(WristPoses(wrists.R[coarse], wrists.p[coarse]), _GRID)
    worst = _worst_margins(margins, path.progress[coarse])
    starts, changes, branches = np.nonzero(worst >= MIN_MARGIN)
    if len(starts) == 0:
        return
    rank = np.digitize(worst[starts, changes, branches], _MARGIN_CLASSES)
    drifts = _DRIFTS[changes]
    middles = (starts + drifts / 2) % len(_GRID)
    cost = _SWIVEL_COST * np.abs(_GRID[0] + middles * _GRID_STEP) + _DRIFT_COST * np.abs(drifts) * _GRID_STEP
    if near is not None:
        cost += _times_from(near, ik, wrists, speed)[starts, branches]
    for k in _varied(np.lexsort((cost, -rank)), rank, middles, branches):
        swivels = _GRID[starts[k]] + _GRID_STEP * drifts[k] * path.progress
        q = ik.follow(wrists, swivels, np.full(len(swivels), branches[k]))
        if ik.margin(q) >= MIN_MARGIN and np.abs(np.diff(q, axis=0)).max(initial=0.0) <= MAX_JOINT_STEP:
            yield q


def _times_from(near: np.ndarray, ik: ClosedFormIK, wrists: WristPoses, speed: np.ndarray) -> np.ndarray:
    """Seconds from `near` (7,) to the first pose, at every swivel of the grid in every branch: (s, 8)."""
    swivels, branches = np.repeat(_GRID, BRANCHES), np.tile(np.arange(BRANCHES), len(_GRID))
    first = WristPoses(np.repeat(wrists.R[:1], len(swivels), axis=0), np.repeat(wrists.p[:1], len(swivels), axis=0))
    times = np.max(np.abs(ik.follow(first, swivels, branches) - near) / speed, axis=1)
    return times.reshape(len(_GRID), BRANCHES)


def _varied(order: np.ndarray, rank: np.ndarray, middles: np.ndarray, branches: np.ndarray) -> list[int]:
    """The first MAX_PATHS of `order`, none twice in the same posture and branch, new postures before repeated ones."""
    kept: list[tuple[int, int, int]] = []
    left = order
    while len(left) > 0 and len(kept) < 2 * MAX_PATHS:
        k = int(left[0])
        repeats = int(np.count_nonzero(_gap(middles[[j for _, _, j in kept]], middles[k]) < _ALIKE))
        kept.append((repeats - BRANCHES * int(rank[k]), len(kept), k))
        left = left[(_gap(middles[left], middles[k]) >= _ALIKE) | (branches[left] != branches[k])]
    return [k for _, _, k in sorted(kept)][:MAX_PATHS]


def _gap(a: np.ndarray, b: float) -> np.ndarray:
    """Distance of swivels in grid steps, around the circle."""
    return np.abs((a - b + len(_GRID) / 2) % len(_GRID) - len(_GRID) / 2)


def _worst_margins(margins: np.ndarray, progress: np.ndarray) -> np.ndarray:
    """Smallest of margins (n, s, 8) along each path, for every start, drift and branch: (s, drifts, 8)."""
    swivels = len(_GRID)
    worst = np.empty((swivels, len(_DRIFTS), BRANCHES))
    for k, change in enumerate(_DRIFTS):
        offsets = np.rint(change * progress).astype(int)
        index = (np.arange(swivels) + offsets[:, None]) % swivels
        worst[:, k] = np.take_along_axis(margins, index[:, :, None], axis=1).min(axis=0)
    return worst
