"""Straight legs through poses of the hand, in joint space."""

from collections.abc import Iterator, Sequence

import numpy as np
from pinocchio import SE3

from skills.skill import Toolkit

MAX_PATHS = 4
"""Joint paths (arm branches) of one set of poses that are tried, best joint margin first."""


def back_off(X_WG: SE3, distance: float) -> SE3:
    """The hand's pose `distance` metres back along its own approach direction."""
    return X_WG * SE3(np.eye(3), np.array([0.0, 0.0, -distance]))


def raised(X_WG: SE3, height: float) -> SE3:
    """The hand's pose `height` metres further up in W."""
    return shifted(X_WG, np.array([0.0, 0.0, height]))


def shifted(X_WG: SE3, offset: np.ndarray) -> SE3:
    """The hand's pose moved by `offset` (3,) metres in W."""
    return SE3(X_WG.rotation, X_WG.translation + offset)


def legs(toolkit: Toolkit, waypoints: Sequence[SE3]) -> Iterator[list[np.ndarray]]:
    """Joint paths through all waypoints, cut at them: one list of (n,7) legs for each arm branch, best first."""
    for path in toolkit.motion.lines(waypoints)[:MAX_PATHS]:
        yield _cut(toolkit, path, waypoints)


def _cut(toolkit: Toolkit, path: np.ndarray, waypoints: Sequence[SE3]) -> list[np.ndarray]:
    poses = [toolkit.robot.X_WG(q) for q in path]
    cuts = [0]
    for waypoint in waypoints[1:-1]:
        start = cuts[-1] + 1
        gaps = [_gap(X_WG, waypoint) for X_WG in poses[start:-1]]
        first_met = next((i for i, gap in enumerate(gaps) if gap < 1e-6), int(np.argmin(gaps)))
        cuts.append(start + first_met)
    cuts.append(len(path) - 1)
    return [path[a : b + 1] for a, b in zip(cuts[:-1], cuts[1:], strict=True)]


def _gap(X_WA: SE3, X_WB: SE3) -> float:
    return float(np.linalg.norm(X_WA.translation - X_WB.translation) + np.abs(X_WA.rotation - X_WB.rotation).max())
