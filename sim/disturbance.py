"""What goes wrong with a plant: sensors that err, joints that rub, someone who pushes.

A fault is a frozen dataclass with the times between which it holds. `DisturbedPlant` is a `Plant`
that suffers from some of them; nothing above it knows. Errors of sensors are laid over what the
plant senses, in the order given; what acts is done to the world before each step.
"""

from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar, runtime_checkable

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from sim.bullet import BulletPlant
from sim.contact import Contact
from sim.plant import Command, Observation
from sim.wrench import Wrench

FOREVER = float("inf")
HAIR = 1e-9
"""Seconds by which sums of steps may err."""

Sense = Callable[[Observation], Observation]
"""What a sensor makes of the truth. Called once for each observation while its fault holds."""

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Something that is wrong from `start` until before `end`, in simulated seconds."""

    start: float = 0.0
    end: float = FOREVER

    def holds_at(self, t: float) -> bool:
        """Is this so at t seconds?"""
        return self.start - HAIR <= t < self.end - HAIR


@runtime_checkable
class SensorFault(Protocol):
    """A fault of what is sensed. `sense` gives a fresh sensor with its own memory."""

    def holds_at(self, t: float) -> bool: ...

    def sense(self) -> Sense: ...


@runtime_checkable
class WorldFault(Protocol):
    """A fault of the world. `act` is called before each step while it holds, `cease` once afterwards."""

    def holds_at(self, t: float) -> bool: ...

    def act(self, plant: BulletPlant) -> None: ...

    def cease(self, plant: BulletPlant) -> None: ...


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
    """Poses and velocities of bodies, all or those named, are so many seconds old."""

    seconds: float
    names: frozenset[str] | None = None

    def sense(self) -> Sense:
        late = _Late[tuple[Mapping[str, SE3], Mapping[str, np.ndarray]]](self.seconds)

        def delayed(seen: Observation) -> Observation:
            poses, velocities = late(seen.t, (seen.poses, seen.velocities))
            meant = [name for name in seen.poses if _is_meant(name, self.names) and name in poses]
            return replace(
                seen,
                poses={**seen.poses, **{name: poses[name] for name in meant}},
                velocities={**seen.velocities, **{name: velocities[name] for name in meant}},
            )

        return delayed


@dataclass(frozen=True)
class PoseMissing(Fault):
    """Bodies, all or those named, are not seen."""

    names: frozenset[str] | None = None

    def sense(self) -> Sense:
        def blind(seen: Observation) -> Observation:
            return replace(
                seen,
                poses={n: X for n, X in seen.poses.items() if not _is_meant(n, self.names)},
                velocities={n: V for n, V in seen.velocities.items() if not _is_meant(n, self.names)},
            )

        return blind


@dataclass(frozen=True)
class JointFriction(Fault):
    """Coulomb friction in the arm's joints, in Nm: at rest it holds against as much, moving it brakes with as much."""

    torque: tuple[float, ...]

    def act(self, plant: BulletPlant) -> None:
        plant.set_joint_friction(np.array(self.torque))

    def cease(self, plant: BulletPlant) -> None:
        plant.set_joint_friction(np.zeros(7))


@dataclass(frozen=True)
class Push(Fault):
    """A force (N, in W) on a link of the robot, at its centre of mass; None: at the tool centre."""

    force: tuple[float, float, float]
    link: str | None = None

    def act(self, plant: BulletPlant) -> None:
        plant.push(np.array(self.force), self.link)

    def cease(self, plant: BulletPlant) -> None:
        """A push lasts for one step only: nothing is left to end."""


class DisturbedPlant:
    """A `Plant` that wraps another and suffers from `faults`.

    Raises TypeError for a fault that is none of the sensors' or the world's.
    """

    def __init__(self, plant: BulletPlant, faults: Sequence[Fault]) -> None:
        self._plant = plant
        self._sensors: list[tuple[SensorFault, Sense]] = []
        self._world: list[WorldFault] = []
        self._acting: set[int] = set()
        for fault in faults:
            if isinstance(fault, SensorFault):
                self._sensors.append((fault, fault.sense()))
            elif isinstance(fault, WorldFault):
                self._world.append(fault)
            else:
                raise TypeError(f"{fault!r} is neither a fault of sensors nor of the world")
        self._seen: Observation | None = None
        self._t = plant.observe().t

    @property
    def timestep(self) -> float:
        return self._plant.timestep

    def observe(self) -> Observation:
        """What the sensors say now; asked twice between two steps, they say the same."""
        if self._seen is None:
            seen = self._plant.observe()
            for fault, sense in self._sensors:
                if fault.holds_at(seen.t):
                    seen = sense(seen)
            self._seen = seen
        return self._seen

    def apply(self, command: Command) -> None:
        self._plant.apply(command)

    def step(self) -> None:
        for index, fault in enumerate(self._world):
            if fault.holds_at(self._t):
                fault.act(self._plant)
                self._acting.add(index)
            elif index in self._acting:
                fault.cease(self._plant)
                self._acting.discard(index)
        self._plant.step()
        self._t += self._plant.timestep
        self._seen = None

    def contacts(self) -> list[Contact]:
        """The true contacts, for reports and benchmarks."""
        return self._plant.contacts()

    def close(self) -> None:
        """Free the engine. The plant can't be used afterwards."""
        self._plant.close()


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
