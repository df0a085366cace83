"""Where things are, from eyes that may shake, lag or blink: noise is averaged, what is out of sight is remembered."""

from collections import deque
from statistics import median

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from sim.scene import pose_distance

JITTER, JITTER_TURN = 5e-4, np.radians(0.3)
"""Metres and rad between two looks at something at rest: more than that is noise or a move."""

SHAKY = 3
"""How many such differences among the last STEADY ones are noise: a move is one."""

STEADY = 5
WINDOW = 30
"""Looks that are averaged."""

LATEST = 3
"""Looks whose mean tells whether it lies elsewhere now."""

CERTAIN = 4.0
"""By how many of its standard deviations that mean must be off."""

MEDIAN_STEP = 2.18
"""Median distance of two points with standard deviation 1 in each direction."""

REMEMBERED = 1.5
"""Seconds for which something out of sight is believed to be where it was while nothing at all is seen."""

OVERLOOKED = 0.1
"""The same while other things are seen: eyes that work would see it, too."""


class Sighting:
    """The pose of one thing, in whatever frame it rests in, taken look by look."""

    def __init__(self) -> None:
        self._looks: deque[np.ndarray] = deque(maxlen=WINDOW)
        self._latest: SE3 | None = None
        self._jitters: deque[bool] = deque(maxlen=STEADY)

    def see(self, X: SE3, is_at_rest: bool) -> SE3:
        """Take in a look; the pose as it is believed now. Clean looks are believed as they are, at once."""
        last, self._latest = self._latest, X
        if last is None or not is_at_rest:
            self._looks.clear()
            self._jitters.clear()
            return X
        distance, turn = pose_distance(last, X)
        self._jitters.append(distance > JITTER or turn > JITTER_TURN)
        if sum(self._jitters) < SHAKY:
            self._looks.clear()
            return X
        self._looks.append(pin.SE3ToXYZQUAT(X))
        if self._lies_elsewhere():
            for _ in range(len(self._looks) - LATEST):
                self._looks.popleft()
        return _mean(np.array(self._looks))

    def _lies_elsewhere(self) -> bool:
        """Are the latest looks further from the earlier ones, or more turned, than noise explains?"""
        if len(self._looks) <= LATEST:
            return False
        looks = np.array(self._looks)
        return _is_off(looks[:, :3], JITTER) or _is_off(_turns(looks[:, 3:]), JITTER_TURN)


def _is_off(points: np.ndarray, jitter: float) -> bool:
    """Are the latest of some points (n,3) off the earlier ones by more than their noise and `jitter` explain?"""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    deviation = median(steps.tolist()) / MEDIAN_STEP
    off = float(np.linalg.norm(points[-LATEST:].mean(axis=0) - points[:-LATEST].mean(axis=0)))
    return off > CERTAIN * deviation * float(np.sqrt(1.0 / LATEST + 1.0 / (len(points) - LATEST))) + jitter


def _turns(quaternions: np.ndarray) -> np.ndarray:
    """Turns (n,3) in rad from the first of some quaternions xyzw (n,4), nearly: 2 sin(θ/2) about their axes."""
    (*v, w), V, W = quaternions[0], quaternions[:, :3], quaternions[:, 3]
    sines = w * V - W[:, None] * np.array(v) - np.cross(v, V)
    cosines = W * w + V @ np.array(v)
    return 2.0 * sines * np.where(cosines < 0.0, -1.0, 1.0)[:, None]


def _mean(looks: np.ndarray) -> SE3:
    """Mean of poses (n,7) that lie close together."""
    quaternions = looks[:, 3:]
    aligned = quaternions * np.where(quaternions @ quaternions[-1] < 0.0, -1.0, 1.0)[:, None]
    total = aligned.sum(axis=0)
    return pin.XYZQUATToSE3(np.concatenate([looks[:, :3].mean(axis=0), total / np.linalg.norm(total)]))
