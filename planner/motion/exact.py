"""The exact collision model: distances between convex solids by coal, many configurations at a time.

It shares the forward kinematics with the fast model, but no geometry. World bounds sort out what is far
apart; coal measures the rest.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import coal
import numpy as np
from pinocchio import SE3

from planner.motion.broad import near_pairs, place_solids
from planner.motion.chain import place_links
from planner.motion.collision import ARM_LINKS, part_names, self_collision_pairs
from planner.motion.world import Margins, Same, Standing
from planner.refinement import Pair
from scenarios.shapes import Convex, Hull, Shape, convex_parts, extents, middle
from scenarios.solids import geometry, polytope
from sim.robot import RobotModel
from sim.scene import Held, SceneState

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
    """A convex solid of part or obstacle `name`: pose in link `link` (−1: in W), half extents (3,), coal geometry."""

    name: str
    link: int
    X: SE3
    half: np.ndarray
    geometry: Any


_UNTURNED = np.eye(3)


class _PlacedGroup(NamedTuple):
    """Solids of a group of obstacles, their coal transforms, world bounds lower, upper (o,3)."""

    solids: list[_Solid]
    transforms: list[Any]
    lower: np.ndarray
    upper: np.ndarray


@lru_cache(maxsize=1024)
def _placed_group(group: Same) -> _PlacedGroup:
    solids = [_solid(o.name, -1, o.X_WS, o.shape) for o in group.things[0]]
    transforms = [coal.Transform3s(solid.X.rotation, solid.X.translation) for solid in solids]
    centres = np.array([solid.X.translation for solid in solids])
    reach = np.array([np.abs(solid.X.rotation) @ solid.half for solid in solids])
    return _PlacedGroup(solids, transforms, centres - reach, centres + reach)


class _Fixed:
    """What stands in the scene: solids, their coal transforms, world bounds lower, upper (1,o,3)."""

    def __init__(self, standing: Standing) -> None:
        groups = [_placed_group(Same(group)) for group in standing.groups]
        self.solids = [solid for group in groups for solid in group.solids]
        self.names = [solid.name for solid in self.solids]
        self.transforms = [transform for group in groups for transform in group.transforms]
        self.lower = np.concatenate([group.lower for group in groups])[None]
        self.upper = np.concatenate([group.upper for group in groups])[None]


class _Moving:
    """The robot and what it holds: first the spheres of the links, `arm` of them, then what rides on link 7."""

    def __init__(self, robot: RobotModel, opening: float, held: Held | None, shape: Shape | None) -> None:
        self._robot = robot
        arm = _arm_solids(robot)
        self.solids = [*arm, *_hand_solids(robot, opening)]
        if held is not None and shape is not None:
            X_7O = robot.model.frames[robot.tcp_id].placement * held.X_GO
            parts = convex_parts(shape)
            self.solids += [_solid(held.name, ARM_LINKS - 1, X_7O * X_OP, part) for part, X_OP in parts]
        self.arm = len(arm)
        self.names = tuple(solid.name for solid in self.solids)
        names = part_names(robot, held)
        self.part = np.array([names.index(name) for name in self.names])
        self.link = np.array([solid.link for solid in self.solids])
        self.half = np.array([solid.half for solid in self.solids])
        self._p = np.array([solid.X.translation for solid in self.solids])
        self._R = np.array([solid.X.rotation for solid in self.solids[self.arm :]])

    def placed(self, q: np.ndarray) -> "_Placed":
        """All solids in W at configurations q (n,7)."""
        return _Placed(*place_solids(place_links(self._robot, q), self.link, self._p, self._R, self.half))


class _Placed(NamedTuple):
    """Moving solids at n configurations: centres p (n,m,3), world bounds (n,m,3), the riders' rotations R (n,r,3,3)."""

    p: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    R: np.ndarray


def _any(pair: Pair) -> bool:
    return True


def _none(pair: Pair) -> bool:
    return False


class ExactChecker:
    """Convex solids in coal: for culprits, for lines near contact, for the audit of timed paths.

    parts: names of what moves, the robot's links and the held body.
    """

    def __init__(self, robot: RobotModel, scene: SceneState, margins: Margins | None = None) -> None:
        margins = Margins() if margins is None else margins
        self.checks = 0
        self._limits = np.stack([robot.q_min, robot.q_max])
        self._fixed = _fixed(Standing(scene))
        self._moving = _moving(robot, scene)
        parts = part_names(robot, scene.held)
        self.parts = frozenset(parts)
        self._solids = [*self._moving.solids, *self._fixed.solids]
        self._outward = _outward_pairs(parts, self._moving.part, self._moving.link, self._fixed.names, margins)
        self._inward = _inward_pairs(parts, self._moving.names, margins)
        self._request, self._result = coal.DistanceRequest(), coal.DistanceResult()

    def is_free(self, q: np.ndarray) -> bool:
        """Is q (7,) within the joint limits and free of collision?"""
        return self._within_limits(q) and not self.contacts(q[None], _any)

    def edge_is_free(self, qa: np.ndarray, qb: np.ndarray) -> bool:
        """Is the straight edge from qa to qb free, at JOINT_STEP and TRAVEL_STEP?"""
        return self._within_limits(qb) and not self.contacts(self.densified(np.stack([qa, qb])), _any)

    def contacts(self, q: np.ndarray, enough: Callable[[Pair], bool] = _none) -> list[Contact]:
        """What comes nearer than its margin at the configurations q (n,7): for each pair the first one, closest part.

        The search ends early with the first pair that is `enough`. Sorted by index, then by names.
        """
        self.checks += len(q)
        placed = self._moving.placed(q)
        found: dict[Pair, Contact] = {}
        for index, a, b, margin in self._candidates(placed):
            pair = frozenset((self._solids[a].name, self._solids[b].name))
            known = found.get(pair)
            if known is not None and known.index < index:
                continue
            distance = self._distance(placed, index, a, b)
            if distance < margin and (known is None or distance < known.distance):
                found[pair] = Contact(index, pair, distance)
                if enough(pair):
                    break
        return sorted(found.values(), key=lambda contact: (contact.index, sorted(contact.pair)))

    def densified(self, path: np.ndarray) -> np.ndarray:
        """The path (n,7) with configurations (k,7) put in between, as close as JOINT_STEP and TRAVEL_STEP demand."""
        if len(path) < 2:
            return path
        counts = np.maximum(1, np.ceil(self._steps(path))).astype(int)
        segment = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(len(segment)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
        between = path[segment] + (path[segment + 1] - path[segment]) * (number / counts[segment])[:, None]
        return np.concatenate([path[:1], between])

    def _steps(self, path: np.ndarray) -> np.ndarray:
        """How many steps each edge of the path needs, not rounded: (n−1,). The way of hand and held body is taken as
        the chords of both halves of the edge, a tenth added."""
        joints = np.abs(path[1:] - path[:-1]).max(axis=1)
        halved = np.empty((2 * len(path) - 1, 7))
        halved[::2], halved[1::2] = path, (path[1:] + path[:-1]) / 2
        placed, arm = self._moving.placed(halved), self._moving.arm
        spread = (placed.R @ self._moving.half[arm:, :, None])[..., 0]
        ends = np.concatenate([placed.p[:, arm:] - spread, placed.p[:, arm:] + spread], axis=1)
        chords = np.sqrt(((ends[1:] - ends[:-1]) ** 2).sum(axis=2).max(axis=1))
        travel = 2.2 * np.maximum(chords[::2], chords[1::2])
        return np.maximum(joints / JOINT_STEP, travel / TRAVEL_STEP)

    def _within_limits(self, q: np.ndarray) -> bool:
        return bool(np.all(q >= self._limits[0]) and np.all(q <= self._limits[1]))

    def _candidates(self, placed: _Placed) -> Iterator[tuple[int, int, int, float]]:
        """What is near by world bounds: index, the two solids' numbers, and their margin."""
        fixed, out, own = self._fixed, self._outward, self._inward
        lower, upper, moving = placed.lower, placed.upper, placed.p.shape[1]
        for index, k in near_pairs(lower, upper, fixed.lower, fixed.upper, out.a, out.b, out.margin).tolist():
            yield index, int(out.a[k]), moving + int(out.b[k]), float(out.margin[k])
        for index, k in near_pairs(lower, upper, lower, upper, own.a, own.b, own.margin).tolist():
            yield index, int(own.a[k]), int(own.b[k]), float(own.margin[k])

    def _distance(self, placed: _Placed, index: int, a: int, b: int) -> float:
        self._result.clear()
        first, second = self._solids[a].geometry, self._solids[b].geometry
        X_a, X_b = self._transform(placed, index, a), self._transform(placed, index, b)
        return coal.distance(first, X_a, second, X_b, self._request, self._result)

    def _transform(self, placed: _Placed, index: int, k: int) -> Any:
        moving = placed.p.shape[1]
        if k >= moving:
            return self._fixed.transforms[k - moving]
        rider = k - self._moving.arm
        return coal.Transform3s(_UNTURNED if rider < 0 else placed.R[index, rider], placed.p[index, k])


@dataclass(frozen=True)
class _Pairs:
    """Numbers a, b (k,) of solids that are checked against each other, and their margins (k,)."""

    a: np.ndarray
    b: np.ndarray
    margin: np.ndarray


def _outward_pairs(
    parts: tuple[str, ...], part: np.ndarray, link: np.ndarray, fixed: list[str], margins: Margins
) -> _Pairs:
    """Moving solids against what stands in the scene; link 0 never moves and is left out."""
    table = margins.table(parts, fixed)[part]
    table[link == 0] = -np.inf
    a, b = np.nonzero(table > -np.inf)
    return _Pairs(np.ascontiguousarray(a), np.ascontiguousarray(b), table[a, b])


def _inward_pairs(parts: tuple[str, ...], names: tuple[str, ...], margins: Margins) -> _Pairs:
    """The robot's own solids against each other."""
    pairs, rows, a, b = _inward_numbers(parts, names)
    if not (margins.allowed or margins.relaxed):
        return _Pairs(a, b, np.zeros(len(rows)))
    margin = margins.within_robot(pairs)[rows]
    kept = margin > -np.inf
    return _Pairs(a[kept], b[kept], margin[kept])


@lru_cache(maxsize=64)
def _inward_numbers(
    parts: tuple[str, ...], names: tuple[str, ...]
) -> tuple[list[Pair], np.ndarray, np.ndarray, np.ndarray]:
    """The pairs of parts, and for each pair of their solids: its pair's row, and the two numbers."""
    pairs = self_collision_pairs(parts)
    solids = {part: [k for k, name in enumerate(names) if name == part] for part in parts}
    found = [(row, a, b) for row, (first, second) in enumerate(pairs) for a in solids[first] for b in solids[second]]
    rows, a, b = (np.array(column) for column in zip(*found, strict=True))
    return [frozenset(pair) for pair in pairs], rows, a, b


def _moving(robot: RobotModel, scene: SceneState) -> _Moving:
    shape = None if scene.held is None else scene.scenario.bodies[scene.held.name].shape
    return _moving_of(robot, scene.opening, Same(scene.held, shape))


@lru_cache(maxsize=64)
def _moving_of(robot: RobotModel, opening: float, carried: Same) -> _Moving:
    return _Moving(robot, opening, *carried.things)


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


def _solid(name: str, link: int, X: SE3, shape: Convex) -> _Solid:
    # About the middle of its bounding box, so that half extents bound it on both sides.
    if not isinstance(shape, Hull):
        return _Solid(name, link, X, extents(shape) / 2, geometry(shape))
    return _Solid(name, link, X * SE3(np.eye(3), middle(shape)), extents(shape) / 2, _centred(shape))


@lru_cache(maxsize=256)
def _centred(hull: Hull) -> Any:
    return polytope(hull.solid, -middle(hull))
