"""Sensors that err: a force sensor, joint encoders, and whoever tells where bodies lie.

Each is laid over what the plant senses (`sim.disturbance.SensorFault`).
"""

from collections import deque
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from sim.disturbance import HAIR, Fault, Sense
from sim.plant import Observation
from sim.wrench import Wrench

T = TypeVar("T")


@dataclass(frozen=True)
class ForceNoise(Fault):
    """White noise on the wrist sensor: standard deviations in N and Nm of each component and reading."""

    force: float
    torque: float = 0.0
    seed: int = 0

    def sense(self) -> Sense:
        rng = np.random.default_rng(self.seed)

        def noisy(seen: Observation) -> Observation:
            wrist = seen.wrist
            force = wrist.force + self.force * rng.normal(size=3)
            return replace(seen, wrist=Wrench(force, wrist.torque + self.torque * rng.normal(size=3)))

        return noisy


@dataclass(frozen=True)
class ForceBias(Fault):
    """A constant error of the wrist sensor, in its own frame: N and Nm."""

    force: tuple[float, float, float]
    torque: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def sense(self) -> Sense:
        def biased(seen: Observation) -> Observation:
            wrist = seen.wrist
            return replace(seen, wrist=Wrench(wrist.force + self.force, wrist.torque + self.torque))

        return biased


@dataclass(frozen=True)
class ForceDelay(Fault):
    """The wrist sensor tells what it felt so many seconds ago."""

    seconds: float

    def sense(self) -> Sense:
        late = _Late[Wrench](self.seconds)
        return lambda seen: replace(seen, wrist=late(seen.t, seen.wrist))


@dataclass(frozen=True)
class ForceFrozen(Fault):
    """The wrist sensor goes on telling the same."""

    def sense(self) -> Sense:
        kept: list[Wrench] = []

        def frozen(seen: Observation) -> Observation:
            if not kept:
                kept.append(seen.wrist)
            return replace(seen, wrist=kept[0])

        return frozen


@dataclass(frozen=True)
class ForceMissing(Fault):
    """The wrist sensor tells nothing: NaN."""

    def sense(self) -> Sense:
        nothing = Wrench(np.full(3, np.nan), np.full(3, np.nan))
        return lambda seen: replace(seen, wrist=nothing)


@dataclass(frozen=True)
class JointDelay(Fault):
    """Positions and velocities of the joints are so many seconds old."""

    seconds: float

    def sense(self) -> Sense:
        late = _Late[tuple[np.ndarray, np.ndarray]](self.seconds)

        def delayed(seen: Observation) -> Observation:
            q, v = late(seen.t, (seen.q, seen.v))
            return replace(seen, q=q, v=v)

        return delayed


@dataclass(frozen=True)
class PoseNoise(Fault):
    """White noise on the poses of bodies, all or those named: standard deviations in m and rad of each component."""

    position: float
    angle: float = 0.0
    names: frozenset[str] | None = None
    seed: int = 0

    def sense(self) -> Sense:
        rng = np.random.default_rng(self.seed)

        def noisy(X: SE3) -> SE3:
            shift, turn = rng.normal(size=(2, 3))
            return SE3(pin.exp3(self.angle * turn) @ X.rotation, X.translation + self.position * shift)

        def sensed(seen: Observation) -> Observation:
            poses = {name: noisy(X) if _is_meant(name, self.names) else X for name, X in seen.poses.items()}
            return replace(seen, poses=poses)

        return sensed


@dataclass(frozen=True)
class PoseDelay(Fault):
    """Poses and velocities of bodies, all or those named, are so many seconds old, and say so."""

    seconds: float
    names: frozenset[str] | None = None

    def hides_poses_for(self, t: float) -> float:
        return min(self.seconds, self.end - t)

    def sense(self) -> Sense:
        late = _Late[Observation](self.seconds)

        def delayed(seen: Observation) -> Observation:
            then = late(seen.t, seen)
            meant = [name for name in seen.poses if _is_meant(name, self.names) and name in then.poses]
            return replace(
                seen,
                poses={**seen.poses, **{name: then.poses[name] for name in meant}},
                velocities={**seen.velocities, **{name: then.velocities[name] for name in meant}},
                seen_at={**seen.seen_at, **dict.fromkeys(meant, then.t)},
            )

        return delayed


@dataclass(frozen=True)
class PoseMissing(Fault):
    """Bodies, all or those named, are not seen."""

    names: frozenset[str] | None = None

    def hides_poses_for(self, t: float) -> float:
        return self.end - t

    def sense(self) -> Sense:
        def blind(seen: Observation) -> Observation:
            return replace(
                seen,
                poses={n: X for n, X in seen.poses.items() if not _is_meant(n, self.names)},
                velocities={n: V for n, V in seen.velocities.items() if not _is_meant(n, self.names)},
            )

        return blind


class _Late(Generic[T]):
    """Gives back what it was given `seconds` ago; until there is something that old, the oldest."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._past: deque[tuple[float, T]] = deque()

    def __call__(self, t: float, value: T) -> T:
        self._past.append((t, value))
        while len(self._past) > 1 and self._past[1][0] <= t - self._seconds + HAIR:
            self._past.popleft()
        return self._past[0][1]


def _is_meant(name: str, names: Collection[str] | None) -> bool:
    return names is None or name in names
