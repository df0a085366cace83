"""Passing from one motion into the next without coming to rest between them.

The second begins `overlap` seconds before the first has ended, and what is left of the first is added to it
until then: the corner between them is cut. Both being piecewise cubic, so is their sum.
"""

from itertools import pairwise

import numpy as np

from planner.motion.trajectory import SAME, Trajectory


def passing(first: Trajectory, second: Trajectory, overlap: float) -> tuple[Trajectory, Trajectory]:
    """The first motion cut `overlap` seconds before its end, and the second with the rest of the first added.

    The second begins at rest where the first ends at rest. Raises ValueError unless 0 < overlap < both durations.
    """
    if not 0.0 < overlap < min(first.duration, second.duration):
        raise ValueError(
            f"motions of {first.duration:.2f} s and {second.duration:.2f} s can't overlap by {overlap:.2f} s"
        )
    cut = first.duration - overlap
    before, since = first.times - first.times[0], second.times - second.times[0]
    times = _merged(np.concatenate([since, before[before > cut + SAME] - cut]))
    rest = [first.at(cut + t) for t in times]
    then = [second.at(t) for t in times]
    q = np.array([a[0] - first.end + b[0] for a, b in zip(rest, then, strict=True)])
    v = np.array([a[1] + b[1] for a, b in zip(rest, then, strict=True)])
    return first.until(cut), Trajectory(times, q, v)


def _merged(times: np.ndarray) -> np.ndarray:
    """The same times in order, those alike only once."""
    times = np.sort(times)
    return np.append(times[:1], [b for a, b in pairwise(times) if b - a > SAME])
