"""A scene as it stands at the start of a run: plain data, poses resolved, noise drawn.

`schema.py` reads scene files and makes these; nothing above it sees YAML or pydantic.
Poses are `pinocchio.SE3`; X_WO is the pose of object O in the world frame W (z up, metres).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pinocchio import SE3

from scenarios.disturbance import Disturbance
from scenarios.shapes import Box, Shape

OpenSide = Literal["+x", "-x", "+y", "-y"]


@dataclass(frozen=True)
class RobotPlacement:
    """Which robot stands where: model name, base pose X_WB, start configuration q0 (7,) in rad."""

    model: str
    X_WB: SE3
    q0: np.ndarray


@dataclass(frozen=True)
class Table:
    """The table's plate: full `size` (3,) in metres, X_WT of its geometric centre, friction coefficient."""

    size: tuple[float, float, float]
    X_WT: SE3
    friction: float

    @property
    def shape(self) -> Box:
        return Box(self.size)


@dataclass(frozen=True)
class Region:
    """A container: a bin (four walls) or a dustpan (three walls, open at `open_side`).

    `size` is the full outer size, X_WR the pose of the outer box's geometric centre. Walls and
    floor are `wall` metres thick. `ramp_deg` is the slope of the ramp inside the open side
    (None: no ramp, a tray whose rim lies below the table's edge).
    """

    name: str
    kind: Literal["bin", "dustpan"]
    size: tuple[float, float, float]
    wall: float
    X_WR: SE3
    friction: float
    open_side: OpenSide | None = None
    ramp_deg: float | None = None


@dataclass(frozen=True)
class Fixture:
    """Something that never moves and is in the way."""

    name: str
    shape: Shape
    X_WO: SE3
    friction: float
    color: tuple[float, float, float, float]


@dataclass(frozen=True)
class Body:
    """A movable thing: an object to clear, or a tool (`tool` holds its kind, such as "sponge")."""

    name: str
    shape: Shape
    mass: float
    friction: float
    color: tuple[float, float, float, float]
    X_WO: SE3
    home: str | None = None
    tool: str | None = None
    contact_stiffness: float | None = None
    contact_damping: float | None = None


@dataclass(frozen=True)
class Scenario:
    """The scene with `seed` drawn. `goal` is the PDDL condition as text, `clear-table` expanded.

    `late` are bodies that are not there at the start: the goal counts them once they were seen.
    `disturbances` will befall the run.
    """

    name: str
    seed: int
    robot: RobotPlacement
    table: Table
    regions: Mapping[str, Region]
    fixtures: Mapping[str, Fixture]
    bodies: Mapping[str, Body]
    goal: str
    late: frozenset[str] = frozenset()
    disturbances: tuple[Disturbance, ...] = ()
