"""Random crumbs on a table with a dustpan on any of its sides: the scenes of `bench wipe`."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from scenarios.regions import OUTWARD
from scenarios.scenario import Body, OpenSide, Region, RobotPlacement, Scenario, Table
from scenarios.shapes import Box
from sim.robot import RobotModel

COUNT = 50
GRAIN_COUNT = 10
SEED = 5

GRAINS = 60
MOST_CUBES = 12
CUBES = (0.01, 0.0299)
"""Metres: what is 3 cm or more can be grasped and is no crumb."""

GRAIN_SIZES = (0.006, 0.008)
DENSITY = 600.0
FRICTION = 0.4
APART = 0.002
"""Metres between two crumbs, at least."""

PAN = "dustpan"
SPONGE = "sponge"
TOP, PLATE = 0.05, 0.14
"""Metres: the plate reaches below the dustpan's floor, so that nothing slides back out under the table."""

PAN_SIZE = (0.28, 0.15, 0.09)
"""Metres along the table's edge, away from it, and up: twelve cubes of 3 cm pile up three deep below the edge over
which they fall."""

RIMS_BELOW = 0.03
HOME = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])


@dataclass(frozen=True)
class Side:
    """A table with a dustpan at one of its edges, placed so that the arm can work there: x and y in W, metres.

    table: x and y from and to. crumbs: the same of where they lie. pan: middle of its opening along the edge. sponge:
    where it lies on the table.
    """

    table: tuple[float, float, float, float]
    crumbs: tuple[float, float, float, float]
    pan: float
    sponge: tuple[float, float]


SIDES: Mapping[OpenSide, Side] = {
    "-y": Side((0.40, 0.84, -0.28, 0.42), (0.50, 0.76, -0.18, 0.12), 0.64, (0.60, 0.32)),
    "+x": Side((0.34, 0.74, -0.42, 0.42), (0.48, 0.68, -0.15, 0.15), 0.0, (0.56, 0.32)),
    "+y": Side((0.40, 0.84, -0.42, 0.28), (0.50, 0.76, -0.12, 0.18), 0.64, (0.60, -0.32)),
    "-x": Side((0.48, 0.88, -0.42, 0.42), (0.53, 0.71, -0.15, 0.15), 0.0, (0.64, 0.32)),
}
"""By the side of the table on which the dustpan is."""


@dataclass(frozen=True)
class Layout:
    """Crumbs on a table: the side of the dustpan, edges of the cubes (m), and x, y (m) and yaw (rad) of each, in W."""

    side: OpenSide
    edges: tuple[float, ...]
    poses: tuple[tuple[float, float, float], ...]

    def scenario(self) -> Scenario:
        """The scene: table, dustpan, sponge and crumbs. All crumbs are to lie in the dustpan."""
        side = SIDES[self.side]
        x0, x1, y0, y1 = side.table
        middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2, TOP - PLATE / 2])
        table = Table((x1 - x0, y1 - y0, PLATE), SE3(np.eye(3), middle), 0.5)
        crumbs = {
            f"crumb_{index:02d}": _crumb(edge, pose)
            for index, (edge, pose) in enumerate(zip(self.edges, self.poses, strict=True))
        }
        goal = " ".join(f"(in_bin {name} {PAN})" for name in crumbs)
        placement = RobotPlacement(RobotModel().name, SE3.Identity(), HOME)
        pan = _pan(self.side, table)
        return Scenario("wipe", 0, placement, table, {PAN: pan}, {}, {**crumbs, SPONGE: _sponge(side)}, f"(and {goal})")


def _crumb(edge: float, pose: tuple[float, float, float]) -> Body:
    x, y, yaw = pose
    X_WO = SE3(pin.rpy.rpyToMatrix(0.0, 0.0, yaw), np.array([x, y, TOP + edge / 2]))
    return Body("crumb", Box((edge, edge, edge)), DENSITY * edge**3, FRICTION, (0.97, 0.5, 0.0, 1.0), X_WO)


def _sponge(side: Side) -> Body:
    return Body(
        name=SPONGE,
        shape=Box((0.09, 0.06, 0.04)),
        mass=0.06,
        friction=0.5,
        color=(0.95, 0.76, 0.2, 1.0),
        X_WO=SE3(np.eye(3), np.array([*side.sponge, TOP + 0.02])),
        tool="sponge",
        contact_stiffness=2000.0,
        contact_damping=20.0,
    )


def _pan(name: OpenSide, table: Table) -> Region:
    """The dustpan just beyond the table's edge on that side, open towards the table."""
    out = OUTWARD[name]
    axis = int(np.argmax(np.abs(out)))
    wide, deep, high = PAN_SIZE
    size = (deep, wide, high) if axis == 0 else (wide, deep, high)
    middle = table.X_WT.translation + out * (table.size[axis] / 2 + deep / 2 + 0.0005)
    middle[1 - axis] = SIDES[name].pan
    middle[2] = TOP - RIMS_BELOW - high / 2
    opposite: Mapping[OpenSide, OpenSide] = {"-y": "+y", "+y": "-y", "-x": "+x", "+x": "-x"}
    return Region(PAN, "dustpan", size, 0.01, SE3(np.eye(3), middle), 0.5, open_side=opposite[name])


def cubes(count: int = COUNT, seed: int = SEED) -> Iterator[Layout]:
    """Layouts of 1 to 12 cubes of 1 to 3 cm, the dustpan on each side in turn."""
    for index in range(count):
        rng = np.random.default_rng([seed, 0, index])
        yield _random(index, rng, int(rng.integers(1, MOST_CUBES + 1)), CUBES)


def grains(count: int = GRAIN_COUNT, seed: int = SEED) -> Iterator[Layout]:
    """Layouts of 60 grains of 6 to 8 mm, the dustpan on each side in turn."""
    for index in range(count):
        yield _random(index, np.random.default_rng([seed, 1, index]), GRAINS, GRAIN_SIZES)


def _random(index: int, rng: np.random.Generator, count: int, sizes: tuple[float, float]) -> Layout:
    side = list(SIDES)[index % len(SIDES)]
    x0, x1, y0, y1 = SIDES[side].crumbs
    edges = rng.uniform(*sizes, count)
    placed: list[np.ndarray] = []
    while len(placed) < count:
        p = rng.uniform((x0, y0), (x1, y1))
        reach = (edges[: len(placed)] + edges[len(placed)]) / np.sqrt(2.0) + APART
        if not placed or np.all(np.linalg.norm(np.array(placed) - p, axis=1) > reach):
            placed.append(p)
    yaws = rng.uniform(-np.pi, np.pi, count)
    poses = tuple((float(p[0]), float(p[1]), float(yaw)) for p, yaw in zip(placed, yaws, strict=True))
    return Layout(side, tuple(float(edge) for edge in edges), poses)
