"""The exact collision model: distances between primitives by coal, many configurations at a time.

It shares no arithmetic with the fast model. Bounding boxes, in numpy, sort out what is far apart;
coal measures the rest.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import coal
import numpy as np
from pinocchio import SE3

from planner.motion.chain import place_links
from planner.motion.collision import ARM_LINKS, part_names, self_collision_pairs
from planner.motion.world import Margins, Standing
from planner.refinement import Pair
from scenarios.shapes import Box, Cylinder, Shape, Sphere, extents
from sim.robot import RobotModel
from sim.scene import SceneState

JOINT_STEP = 0.02
"""Largest step of a joint, in rad, between two configurations that are looked at on a path."""

TRAVEL_STEP = 0.005
"""Largest way of the hand or the held body, in metres, between two configurations looked at on a path."""


@dataclass(frozen=True)
class Contact:
    """At configuration number `index` the two of `pair` are `distance` metres apart: less than their margin."""

    index: int
    pair: Pair
    distance: float


@dataclass(frozen=True)
class _Solid:
    """A primitive of part or obstacle `name`, its pose in link `link` (−1: in W), half extents (3,), coal geometry."""

    name: str
    link: int
    X: SE3
    half: np.ndarray
    geometry: Any


_Posed = tuple[_Solid, Any]
"""A solid with its coal transform in W."""


class _Fixed:
    """What stands in the scene: solids, their coal transforms, world bounds lower, upper (o,3)."""

    def __init__(self, standing: Standing) -> None:
        self.solids = [_solid(o.name, -1, o.X_WS, o.shape) for o in standing.obstacles]
        self.transforms = [coal.Transform3s(solid.X.rotation, solid.X.translation) for solid in self.solids]
        centres = np.array([solid.X.translation for solid in self.solids])
        reach = np.array([np.abs(solid.X.rotation) @ solid.half for solid in self.solids])
        self.lower, self.upper = centres - reach, centres + reach


class _Moving:
    """The robot and what it holds: first the spheres of the links, `arm` of them, then what rides on link 7."""

    def __init__(self, robot: RobotModel, scene: SceneState) -> None:
        self._robot = robot
        arm = _arm_solids(robot)
        self.solids = [*arm, *_riders(robot, scene)]
        self.arm = len(arm)
        self.link = np.array([solid.link for solid in self.solids])
        self.half = np.array([solid.half for solid in self.solids])
        self._p = np.array([solid.X.translation for solid in self.solids])
        self._R_riders = np.array([solid.X.rotation for solid in self.solids[self.arm :]])

    def placed(self, q: np.ndarray) -> "_Placed":
        """All solids in W at configurations q (n,7)."""
        R_link, p_link = place_links(self._robot, q)
        p = p_link[:, self.link] + (R_link[:, self.link] @ self._p[:, :, None])[..., 0]
        R = R_link[:, ARM_LINKS - 1, None] @ self._R_riders
        reach = np.empty_like(p)
        reach[:, : self.arm] = self.half[: self.arm]
        reach[:, self.arm :] = (np.abs(R) @ self.half[self.arm :, :, None])[..., 0]
        return _Placed(p, R, p - reach, p + reach)


@dataclass(frozen=True)
class _Placed:
    """Moving solids at n configurations: centres p (n,m,3), the riders' rotations R (n,r,3,3), world bounds (n,m,3)."""

    p: np.ndarray
    R: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


class ExactChecker:
    """Spheres, boxes and cylinders in coal: for culprits, for lines near contact, for the audit of timed paths."""

    def __init__(self, robot: RobotModel, scene: SceneState, margins: Margins | None = None) -> None:
        margins = Margins() if margins is None else margins
        self.checks = 0
        self._limits = np.stack([robot.q_min, robot.q_max])
        self._fixed = _fixed(Standing(scene))
        self._moving = _Moving(robot, scene)
        parts = part_names(robot, scene.held)
        names = [solid.name for solid in self._moving.solids]
        self._outward = _outward_pairs(parts, names, self._moving.link, self._fixed.solids, margins)
        self._inward = _inward_pairs(parts, tuple(names), margins)
        self._request, self._result = coal.DistanceRequest(), coal.DistanceResult()

    def is_free(self, q: np.ndarray) -> bool:
        """Is q (7,) within the joint limits and free of collision?"""
        return self._within_limits(q) and not self._contacts(q[None], True)

    def edge_is_free(self, qa: np.ndarray, qb: np.ndarray) -> bool:
        """Is the straight edge from qa to qb free, at JOINT_STEP and TRAVEL_STEP?"""
        return self._within_limits(qb) and not self._contacts(self.densified(np.stack([qa, qb])), True)

    def colliding_pairs(self, q: np.ndarray) -> frozenset[Pair]:
        """Names of the robot's parts (or the held body) and what they hit at q (7,), or hit among each other."""
        return frozenset(contact.pair for contact in self.contacts(q[None]))

    def contacts(self, q: np.ndarray) -> list[Contact]:
        """What comes nearer than its margin at the configurations q (n,7): for each pair the first one, closest part.

        Sorted by index, then by names.
        """
        found = self._contacts(q, False)
        return sorted(found, key=lambda contact: (contact.index, sorted(contact.pair)))

    def densified(self, path: np.ndarray) -> np.ndarray:
        """The path (n,7) with configurations (k,7) put in between, as close as JOINT_STEP and TRAVEL_STEP demand."""
        if len(path) < 2:
            return path
        halves = np.insert(path[1:], np.arange(len(path) - 1), (path[1:] + path[:-1]) / 2, axis=0)
        placed, arm = self._moving.placed(np.concatenate([path[:1], halves])), self._moving.arm
        spread = (placed.R @ self._moving.half[arm:, :, None])[..., 0]
        ends = np.concatenate([placed.p[:, arm:] - spread, placed.p[:, arm:] + spread], axis=1)
        chords = np.linalg.norm(np.diff(ends, axis=0), axis=-1).max(axis=1)
        travel = 2.2 * np.maximum(chords[::2], chords[1::2])
        steps = np.maximum(np.abs(np.diff(path, axis=0)).max(axis=1) / JOINT_STEP, travel / TRAVEL_STEP)
        counts = np.maximum(1, np.ceil(steps)).astype(int)
        segment = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(len(segment)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
        between = path[segment] + (path[segment + 1] - path[segment]) * (number / counts[segment])[:, None]
        return np.concatenate([path[:1], between])

    def _within_limits(self, q: np.ndarray) -> bool:
        return bool(np.all(q >= self._limits[0]) and np.all(q <= self._limits[1]))

    def _contacts(self, q: np.ndarray, first_only: bool) -> list[Contact]:
        self.checks += len(q)
        placed = self._moving.placed(q)
        found: dict[Pair, Contact] = {}
        for index, margin, first, second in self._candidates(placed):
            pair = frozenset((first[0].name, second[0].name))
            known = found.get(pair)
            if known is not None and known.index < index:
                continue
            distance = self._distance(first, second)
            if distance < margin and (known is None or distance < known.distance):
                found[pair] = Contact(index, pair, distance)
                if first_only:
                    break
        return list(found.values())

    def _candidates(self, placed: _Placed) -> Iterator[tuple[int, float, _Posed, _Posed]]:
        """What is near by world bounds: index, margin, and the two solids where they are."""
        for index, a, b, margin in _near(placed, self._fixed.lower[None], self._fixed.upper[None], self._outward):
            yield index, margin, self._at(placed, index, a), (self._fixed.solids[b], self._fixed.transforms[b])
        for index, a, b, margin in _near(placed, placed.lower, placed.upper, self._inward):
            yield index, margin, self._at(placed, index, a), self._at(placed, index, b)

    def _at(self, placed: _Placed, index: int, k: int) -> _Posed:
        rider = k - self._moving.arm
        R = np.eye(3) if rider < 0 else placed.R[index, rider]
        return self._moving.solids[k], coal.Transform3s(R, placed.p[index, k])

    def _distance(self, first: _Posed, second: _Posed) -> float:
        self._result.clear()
        return coal.distance(first[0].geometry, first[1], second[0].geometry, second[1], self._request, self._result)


@dataclass(frozen=True)
class _Pairs:
    """Numbers a, b (k,) of solids that are checked against each other, and their margins (k,)."""

    a: np.ndarray
    b: np.ndarray
    margin: np.ndarray


def _near(placed: _Placed, lower: np.ndarray, upper: np.ndarray, pairs: _Pairs) -> list[tuple[int, int, int, float]]:
    """(index, a, b, margin) wherever the world bounds of moving solid a and of b, lower, upper (n or 1,…,3), come
    nearer than the margin, sorted by index."""
    a, b, margin = pairs.a, pairs.b, pairs.margin[:, None]
    below, above = placed.lower.min(axis=0), placed.upper.max(axis=0)
    far = (below[a] - margin >= upper.max(axis=0)[b]) | (above[a] + margin <= lower.min(axis=0)[b])
    kept = np.flatnonzero(~far.any(axis=1))
    a, b, margin = a[kept], b[kept], pairs.margin[kept]
    apart = np.zeros((len(placed.p), len(kept)), dtype=bool)
    for axis in range(3):
        apart |= placed.lower[:, a, axis] - margin >= upper[:, b, axis]
        apart |= placed.upper[:, a, axis] + margin <= lower[:, b, axis]
    return [(int(i), int(a[k]), int(b[k]), float(margin[k])) for i, k in np.argwhere(~apart)]


def _outward_pairs(
    parts: tuple[str, ...], names: list[str], link: np.ndarray, fixed: list[_Solid], margins: Margins
) -> _Pairs:
    """Moving solids against what stands in the scene; link 0 never moves and is left out."""
    rows = [parts.index(name) for name in names]
    table = margins.table(parts, [solid.name for solid in fixed])[rows]
    table[link == 0] = -np.inf
    a, b = np.nonzero(table > -np.inf)
    return _Pairs(a, b, table[a, b])


def _inward_pairs(parts: tuple[str, ...], names: tuple[str, ...], margins: Margins) -> _Pairs:
    """The robot's own solids against each other."""
    pairs = [(outer, inner, margins.within_robot(outer, inner)) for outer, inner in self_collision_pairs(parts)]
    found = [
        (a, b, margin) for outer, inner, margin in pairs if margin > -np.inf for a, b in _numbers(names, outer, inner)
    ]
    a, b, margin = zip(*found, strict=True)
    return _Pairs(np.array(a), np.array(b), np.array(margin))


@lru_cache(maxsize=1024)
def _numbers(names: tuple[str, ...], first: str, second: str) -> tuple[tuple[int, int], ...]:
    inner = [k for k, name in enumerate(names) if name == second]
    return tuple((a, b) for a, name in enumerate(names) if name == first for b in inner)


@lru_cache(maxsize=64)
def _fixed(standing: Standing) -> _Fixed:
    return _Fixed(standing)


@lru_cache(maxsize=8)
def _arm_solids(robot: RobotModel) -> list[_Solid]:
    links = robot.links[:ARM_LINKS]
    return [_solid(s.link, links.index(s.link), s.X_LS, s.shape) for s in robot.geometry if s.link in links]


@lru_cache(maxsize=64)
def _hand_solids(robot: RobotModel, opening: float) -> list[_Solid]:
    last = ARM_LINKS - 1
    poses = robot.link_poses(np.zeros(7), opening)
    X_7W = poses[robot.links[last]].inverse()
    hand = [solid for solid in robot.geometry if solid.link in robot.hand_links]
    return [_solid(solid.link, last, X_7W * poses[solid.link] * solid.X_LS, solid.shape) for solid in hand]


def _riders(robot: RobotModel, scene: SceneState) -> list[_Solid]:
    """Hand, fingers and held body, in link 7."""
    solids = _hand_solids(robot, scene.opening)
    if scene.held is None:
        return solids
    X_7O = robot.model.frames[robot.tcp_id].placement * scene.held.X_GO
    shape = scene.scenario.bodies[scene.held.name].shape
    return [*solids, _solid(scene.held.name, ARM_LINKS - 1, X_7O, shape)]


def _solid(name: str, link: int, X: SE3, shape: Shape) -> _Solid:
    return _Solid(name, link, X, extents(shape) / 2, _geometry(shape))


def _geometry(shape: Shape) -> Any:
    match shape:
        case Box(size):
            return coal.Box(*size)
        case Cylinder(radius, height):
            return coal.Cylinder(radius, height)
        case Sphere(radius):
            return coal.Sphere(radius)
