"""What goes wrong with a plant: sensors that err, joints that rub, someone who pushes or moves things.

A fault is a frozen dataclass with the times between which it holds. `DisturbedPlant` is a `Plant`
that suffers from some of them; nothing above it knows. Errors of sensors are laid over what the
plant senses, in the order given; commands are altered on their way; what acts is done to the world
before each step. The faults themselves: `sensor_faults`, `robot_faults`, `world_faults`.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from sim.bullet import BulletPlant
from sim.contact import Contact
from sim.plant import Command, Observation

FOREVER = float("inf")
HAIR = 1e-9
"""Seconds by which sums of steps may err."""

Sense = Callable[[Observation], Observation]
"""What a sensor makes of the truth. Called once for each observation while its fault holds."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Something that is wrong from `start` until before `end`, in simulated seconds."""

    start: float = 0.0
    end: float = FOREVER

    def holds_at(self, t: float) -> bool:
        """Is this so at t seconds?"""
        return self.start - HAIR <= t < self.end - HAIR

    def hides_poses_for(self, t: float) -> float:
        """Seconds from t on until sensors can show where a body lies that is moved at t."""
        return 0.0


@runtime_checkable
class SensorFault(Protocol):
    """A fault of what is sensed. `sense` gives a fresh sensor with its own memory."""

    def holds_at(self, t: float) -> bool: ...

    def sense(self) -> Sense: ...

    def hides_poses_for(self, t: float) -> float: ...


@runtime_checkable
class CommandFault(Protocol):
    """A fault of what is done with a command."""

    def holds_at(self, t: float) -> bool: ...

    def alter(self, command: Command) -> Command: ...


@runtime_checkable
class WorldFault(Protocol):
    """A fault of the world. `begin` is called once, `act` before each step while it holds, `cease` once afterwards."""

    def holds_at(self, t: float) -> bool: ...

    def begin(self, plant: BulletPlant) -> None: ...

    def act(self, plant: BulletPlant) -> None: ...

    def cease(self, plant: BulletPlant) -> None: ...


class DisturbedPlant:
    """A `Plant` that wraps another and suffers from `faults`, and from those that `suffer` adds later.

    `before_step` is called before each step with the time in s: whoever disturbs may look at the clock there.
    Raises TypeError for a fault that is none of the sensors', the commands' or the world's.
    """

    def __init__(self, plant: BulletPlant, faults: Iterable[Fault] = ()) -> None:
        self._plant = plant
        self._sensors: list[tuple[SensorFault, Sense]] = []
        self._commands: list[CommandFault] = []
        self._world: list[WorldFault] = []
        self._acting: set[int] = set()
        self._command: Command | None = None
        self._seen: Observation | None = None
        self._t = plant.observe().t
        self.before_step: Callable[[float], None] = _nobody
        for fault in faults:
            self.suffer(fault)

    @property
    def timestep(self) -> float:
        return self._plant.timestep

    @property
    def lap(self) -> Callable[[str], None]:
        """Called with the name of each part of a step that has just been done."""
        return self._plant.lap

    @lap.setter
    def lap(self, lap: Callable[[str], None]) -> None:
        self._plant.lap = lap

    def suffer(self, fault: Fault) -> None:
        """One more fault. Raises TypeError for what is none."""
        if isinstance(fault, SensorFault):
            self._sensors.append((fault, fault.sense()))
        elif isinstance(fault, CommandFault):
            self._commands.append(fault)
        elif isinstance(fault, WorldFault):
            self._world.append(fault)
        else:
            raise TypeError(f"{fault!r} is neither a fault of sensors, of commands nor of the world")

    def observe(self) -> Observation:
        """What the sensors say now; asked twice between two steps, they say the same."""
        if self._seen is None:
            seen = self._plant.observe()
            for fault, sense in self._sensors:
                if fault.holds_at(seen.t):
                    seen = sense(seen)
            self._seen = seen
        return self._seen

    def hides_poses_for(self) -> float:
        """Seconds until the sensors can show where a body lies that is moved now."""
        hidden = (fault.hides_poses_for(self._t) for fault, _ in self._sensors if fault.holds_at(self._t))
        return max(hidden, default=0.0)

    def truth(self) -> Observation:
        """What faultless sensors would say now: for reports and benchmarks, and for whoever disturbs."""
        return self._plant.observe()

    def apply(self, command: Command) -> None:
        self._command = command
        self._plant.apply(self._altered(command))

    def step(self) -> None:
        self.before_step(self._t)
        for index, fault in enumerate(self._world):
            if fault.holds_at(self._t):
                if index not in self._acting:
                    self._acting.add(index)
                    fault.begin(self._plant)
                fault.act(self._plant)
            elif index in self._acting:
                fault.cease(self._plant)
                self._acting.discard(index)
        if self._command is not None and self._commands:
            self._plant.apply(self._altered(self._command))
        self._plant.step()
        self._t += self._plant.timestep
        self._seen = None

    def contacts(self) -> list[Contact]:
        """The true contacts, for reports and benchmarks."""
        return self._plant.contacts()

    def close(self) -> None:
        """Free the engine. The plant can't be used afterwards."""
        self._plant.close()

    def _altered(self, command: Command) -> Command:
        for fault in self._commands:
            if fault.holds_at(self._t):
                command = fault.alter(command)
        return command


def _nobody(t: float) -> None:
    """Looks at no clock."""
