"""The seam between the executive and a world: observe, apply, step.

PyBullet is one world behind it (`sim.bullet`); another engine or a real arm fits here with
nothing above changing.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from pinocchio import SE3

from sim.wrench import Wrench


@dataclass(frozen=True)
class Observation:
    """What can be sensed at time `t` (s, simulated).

    q, v, tau (7,): arm position (rad), velocity (rad/s), commanded torque in force (Nm).
    opening: distance between the fingers in metres; opening_velocity in m/s.
    grip_force: force in N with which the fingers' drive presses (0 when free).
    wrist: wrench that the hand exerts on the flange's sensor, in the sensor frame at the
    flange, gravity and inertia of the hand included, as a real sensor reads it.
    poses: X_WO of every movable body that is seen; velocities: V_WO (6,), linear before angular, in W.
    seen_at: when (s) a body was seen so, for those whose pose is older than t.
    regions: X_WR of the containers, as far as they are known not to stand where they were declared.
    """

    t: float
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    opening: float
    opening_velocity: float
    grip_force: float
    wrist: Wrench
    poses: Mapping[str, SE3]
    velocities: Mapping[str, np.ndarray]
    seen_at: Mapping[str, float] = field(default_factory=dict)
    regions: Mapping[str, SE3] = field(default_factory=dict)


@dataclass(frozen=True)
class GripCommand:
    """Drive the fingers at `speed` (m/s of opening, positive opens) with at most `force` N each."""

    speed: float
    force: float


@dataclass(frozen=True)
class Command:
    """Joint torques tau (7,) in Nm, and what the fingers do."""

    tau: np.ndarray
    grip: GripCommand


class Plant(Protocol):
    """A world with one arm. Commands hold until the next `apply`."""

    @property
    def timestep(self) -> float:
        """Length of one step in seconds."""
        ...

    def observe(self) -> Observation:
        """What the sensors say now."""
        ...

    def apply(self, command: Command) -> None:
        """Set torques and fingers from now on. Raises ValueError for a command that isn't finite."""
        ...

    def step(self) -> None:
        """Let `timestep` seconds pass."""
        ...
