"""What stands in the arm's way: the scene as a list of named solids, and how near the robot may come to each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import permutations
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from pinocchio import SE3

from planner.refinement import Pair
from scenarios.regions import parts
from scenarios.scenario import Scenario
from scenarios.shapes import Box, Convex, Shape, convex_parts
from sim.scene import SceneState, floor_height, pedestal

FLOOR = "floor"
PEDESTAL = "pedestal"
TABLE = "table"

FREE_MARGIN = 0.005
"""Distance in metres that the robot keeps from everything while it moves freely."""

_FLOOR_SIDE = 10.0
_FLOOR_DEPTH = 1.0


class Obstacle(NamedTuple):
    """A convex solid with its pose X_WS in the world. Several may share a name (the walls of a bin)."""

    name: str
    shape: Convex
    X_WS: SE3


Group = tuple[Obstacle, ...]
"""Obstacles that come together: a body's convex parts, or all that never moves."""


class Same:
    """Things as a key of caches: equal if they are the same objects."""

    def __init__(self, *things: Any) -> None:
        self.things = things
        self._ids = tuple(map(id, things))
        self._hash = hash(self._ids)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Same) and other._ids == self._ids


def _solids(name: str, shape: Shape, X_WO: SE3) -> Group:
    """A body's convex parts."""
    return tuple(Obstacle(name, part, X_WO * X_OP) for part, X_OP in convex_parts(shape))


@lru_cache(maxsize=1024)
def _body(name: str, placed: Same) -> Group:
    return _solids(name, *placed.things)


def obstacles(scene: SceneState) -> list[Obstacle]:
    """Everything solid but the robot and what it holds: floor, pedestal, table, regions, fixtures, movable bodies."""
    return Standing(scene).obstacles


@lru_cache(maxsize=32)
def _surroundings(declared: Same) -> Group:
    """What never moves: "floor", "pedestal" (if there is one), "table", each region's parts, each fixture."""
    scenario: Scenario = declared.things[0]
    depth = np.array([0.0, 0.0, floor_height(scenario) - _FLOOR_DEPTH / 2])
    found = [Obstacle(FLOOR, Box((_FLOOR_SIDE, _FLOOR_SIDE, _FLOOR_DEPTH)), SE3(np.eye(3), depth))]
    block = pedestal(scenario)
    if block is not None:
        found.append(Obstacle(PEDESTAL, *block))
    found.append(Obstacle(TABLE, scenario.table.shape, scenario.table.X_WT))
    for region in scenario.regions.values():
        found += [Obstacle(region.name, shape, region.X_WR * X_RP) for shape, X_RP in parts(region)]
    for fixture in scenario.fixtures.values():
        found += _solids(fixture.name, fixture.shape, fixture.X_WO)
    return tuple(found)


class Standing:
    """What stands in a scene, as a key of caches: equal if the scenario and all poses are the same objects."""

    def __init__(self, scene: SceneState) -> None:
        self.scenario = scene.scenario
        self.poses = tuple((name, scene.poses[name]) for name in sorted(movables(scene)))
        self._ids = (id(self.scenario), tuple((name, id(X_WO)) for name, X_WO in self.poses))
        self._hash = hash(self._ids)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Standing) and other._ids == self._ids

    @property
    def groups(self) -> list[Group]:
        """Everything solid but the robot and what it holds: surroundings, then each movable body. A group that stood
        in another scene already is the same object."""
        declared = self.scenario.bodies
        bodies = [_body(name, Same(declared[name].shape, X_WO)) for name, X_WO in self.poses]
        return [_surroundings(Same(self.scenario)), *bodies]

    @property
    def obstacles(self) -> list[Obstacle]:
        """The same, one after the other."""
        return [solid for group in self.groups for solid in group]


def movables(scene: SceneState) -> frozenset[str]:
    """Names of the movable bodies that stand in the scene: what a culprit can be."""
    held = frozenset() if scene.held is None else frozenset({scene.held.name})
    return frozenset(scene.poses) - held


@dataclass(frozen=True)
class Margins:
    """How near two things may come, in metres: nearer than their margin is a collision.

    `free` holds between the robot (with what it holds) and the scene; among the robot's own links
    it is zero, since their spheres already cover the meshes. `allowed` pairs may do anything.
    `relaxed` gives single pairs a smaller margin (negative: they may overlap by as much), for
    motions that begin near or in contact.
    """

    free: float = FREE_MARGIN
    allowed: frozenset[Pair] = frozenset()
    relaxed: Mapping[Pair, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "relaxed", MappingProxyType(dict(self.relaxed)))

    def table(self, parts: Sequence[str], names: Sequence[str]) -> np.ndarray:
        """Margins (parts, names) between the robot's parts and what stands in the scene; −inf where allowed."""
        margins = np.full((len(parts), len(names)), self.free)
        for pair in self.allowed.union(self.relaxed):
            for part, name in permutations(pair):
                if part in parts and name in names:
                    rows = parts.index(part)
                    columns = [k for k, other in enumerate(names) if other == name]
                    margins[rows, columns] = self._of(pair, self.free)
        return margins

    def within_robot(self, own: Sequence[Pair]) -> np.ndarray:
        """Margins (n,) between pairs of the robot's own parts (or one and the held body); −inf where allowed."""
        special = self.allowed.union(self.relaxed)
        return np.array([self._of(pair, 0.0) if pair in special else 0.0 for pair in own])

    def _of(self, pair: Pair, default: float) -> float:
        if pair in self.allowed:
            return -np.inf
        return min(default, self.relaxed.get(pair, default))
