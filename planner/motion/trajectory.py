"""A timed joint path, and how to read it at any time."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

SAME = 1e-6
"""Seconds below which two knots are one."""


@dataclass(frozen=True)
class Trajectory:
    """Joint configurations q (n,7) in rad and velocities v (n,7) in rad/s at strictly rising times (n,) in s.

    Between knots the motion is the cubic Hermite polynomial through both ends, so position and
    velocity are continuous. Before the first and after the last knot it stands still there; one that
    `ends_moving` is meant to be followed by another that goes on from there.
    """

    times: np.ndarray
    q: np.ndarray
    v: np.ndarray

    def __post_init__(self) -> None:
        n = len(self.times)
        if n < 1 or self.q.shape != (n, 7) or self.v.shape != (n, 7):
            raise ValueError(
                f"trajectory shapes: times {self.times.shape}, q {self.q.shape}, v {self.v.shape}, "
                "expected (n,), (n, 7), (n, 7)"
            )
        if np.any(np.diff(self.times) <= 0):
            raise ValueError("trajectory times must rise strictly")
        for array in (self.times, self.q, self.v):
            array.setflags(write=False)

    @staticmethod
    def standstill(q: np.ndarray, duration: float = 0.0) -> "Trajectory":
        """Stay at q (7,) for `duration` seconds."""
        q = np.array(q, dtype=float)
        if duration <= 0:
            return Trajectory(np.zeros(1), q[None], np.zeros((1, 7)))
        return Trajectory(np.array([0.0, duration]), np.stack([q, q]), np.zeros((2, 7)))

    def slowed(self, factor: float) -> "Trajectory":
        """The same path, taking `factor` times as long."""
        return Trajectory(self.times * factor, self.q, self.v / factor)

    @property
    def duration(self) -> float:
        """Seconds from the first knot to the last."""
        return float(self.times[-1] - self.times[0])

    @property
    def start(self) -> np.ndarray:
        return self.q[0]

    @property
    def end(self) -> np.ndarray:
        return self.q[-1]

    @property
    def ends_moving(self) -> bool:
        """Is it still under way at its last knot?"""
        return bool(np.any(self.v[-1]))

    @cached_property
    def length(self) -> float:
        """Length of the joint path in rad (Euclidean over the joints, knot to knot)."""
        return float(np.linalg.norm(np.diff(self.q, axis=0), axis=1).sum())

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and acceleration (7,) at t seconds after the first knot."""
        now = np.zeros((3, 7))
        _evaluate(self.times, self._coefficients, self.q, t, now)
        return now[0], now[1], now[2]

    @cached_property
    def _coefficients(self) -> np.ndarray:
        """Coefficients (n-1,4,7) of each segment's cubic in its own time from 0 to 1."""
        h = np.diff(self.times)[:, None]
        m0, m1 = h * self.v[:-1], h * self.v[1:]
        d = np.diff(self.q, axis=0)
        return np.stack([self.q[:-1], m0, 3 * d - 2 * m0 - m1, m0 + m1 - 2 * d], axis=1)

    def until(self, t: float) -> "Trajectory":
        """The first t seconds, 0 < t < duration; ends moving unless it stands there."""
        since = self.times - self.times[0]
        early = since < t - SAME
        q, v, _ = self.at(t)
        return Trajectory(np.append(since[early], t), np.vstack([self.q[early], q]), np.vstack([self.v[early], v]))


@njit(cache=True)
def _evaluate(times: np.ndarray, coefficients: np.ndarray, q: np.ndarray, t: float, now: np.ndarray) -> None:
    """Fill in `now` (3,7): position, velocity and acceleration t seconds after the first knot."""
    s = t + times[0]
    if s <= times[0] or s >= times[-1]:
        now[0] = q[0] if s <= times[0] else q[-1]
        return
    i = np.searchsorted(times, s, side="right") - 1
    h = times[i + 1] - times[i]
    u = (s - times[i]) / h
    for j in range(now.shape[1]):
        c0, c1, c2, c3 = coefficients[i, 0, j], coefficients[i, 1, j], coefficients[i, 2, j], coefficients[i, 3, j]
        now[0, j] = c0 + u * (c1 + u * (c2 + u * c3))
        now[1, j] = (c1 + u * (2.0 * c2 + u * 3.0 * c3)) / h
        now[2, j] = (2.0 * c2 + 6.0 * u * c3) / h**2
