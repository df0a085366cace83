"""The fast collision model: the scene as arrays, checked by compiled code (about a microsecond a configuration)."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from pinocchio import SE3

from planner.motion.chain import chain, placement
from planner.motion.kernels import edge_is_free, hand_contacts
from planner.motion.tables import (
    BOUND,
    BOX,
    COUNT,
    CYLINDER,
    FACES,
    FIRST,
    HALF,
    HULL,
    KIND,
    LOWER,
    OBSTACLE_COLUMNS,
    PART,
    PLACE,
    SOLID_COLUMNS,
    SPHERE,
    UPPER,
    ArmArrays,
    Packed,
    SceneArrays,
    flat,
    pack,
)
from planner.motion.world import Margins, Same, Standing
from planner.refinement import Pair
from scenarios.shapes import (
    Box,
    Convex,
    Cylinder,
    Hull,
    Shape,
    Sphere,
    bounding_radius,
    convex_parts,
    extents,
    middle,
)
from sim.robot import RobotModel
from sim.scene import Held, SceneState

JOINT_STEP = 0.05
"""Largest step of a joint, in rad, between two configurations checked on an edge."""

TRAVEL_STEP = 0.02
"""Largest way of the hand, in metres, between two configurations checked on an edge."""


ARM_LINKS = 8
"""Links 0 to 7; hand, fingers and held body ride on the last."""

_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


class FastChecker:
    """Convex solids in numba, for planners: never calls free what the exact model calls a collision.

    Where it may refuse what is free (by millimetres, near corners and rims) is told in `apart`.
    Link 0 never moves, so it is checked against the arm and the held body only, not against the scene.
    packed: robot and scene as the kernels take them, see `tables.pack`.
    """

    def __init__(self, robot: RobotModel, scene: SceneState, margins: Margins | None = None) -> None:
        margins = Margins() if margins is None else margins
        parts = part_names(robot, scene.held)
        self.checks = 0
        arm = _arm(robot, scene)
        self.packed = pack(arm.packed, _scene_tables(arm, parts, scene, margins))

    def is_free(self, q: np.ndarray) -> bool:
        """Is q (7,) within the joint limits and free of collision?"""
        return self.edge_is_free(q, q)

    def edge_is_free(self, qa: np.ndarray, qb: np.ndarray) -> bool:
        """Is the straight edge from qa (known to be free) to qb free, at JOINT_STEP and TRAVEL_STEP?"""
        # Copies: a read-only array is another type to numba, and would be compiled for anew.
        start = np.array(qa, dtype=float)
        end = start if qb is qa else np.array(qb, dtype=float)
        free, checks = edge_is_free(start, end, self.packed, JOINT_STEP, TRAVEL_STEP)
        self.checks += checks
        return free


def hand_hits(robot: RobotModel, scene: SceneState, X_WG: SE3, margins: Margins) -> frozenset[str]:
    """Names of what hand, fingers or held body would come too near to with the gripper at X_WG, wherever the arm is."""
    arm = _arm(robot, scene).tables
    names, table, corners = _obstacle_rows(Standing(scene))
    X_W7 = X_WG * robot.model.frames[robot.tcp_id].placement.inverse()
    allowed = margins.table(part_names(robot, scene.held), names)
    hits = hand_contacts(placement(X_W7)[None], arm.solids, arm.corners, table, corners, allowed)
    return frozenset(name for name, hit in zip(names, hits, strict=True) if hit)


def part_names(robot: RobotModel, held: Held | None) -> tuple[str, ...]:
    """Names of the parts that can collide: the robot's links, and the held body last."""
    return robot.links if held is None else (*robot.links, held.name)


@lru_cache(maxsize=64)
def self_collision_pairs(parts: tuple[str, ...]) -> list[tuple[str, str]]:
    """Pairs of the robot's parts that can meet: the outer arm, hand and held body against the links further in.

    Neighbours and next neighbours overlap by construction; the joint limits keep the pairs left out apart.
    """
    links, riders = parts[:ARM_LINKS], parts[ARM_LINKS:]
    found = [(outer, inner) for k, outer in enumerate(links) for inner in links[: max(0, k - 3)]]
    return found + [(rider, inner) for rider in riders for inner in links[:6]]


def _kind(shape: Convex) -> int:
    match shape:
        case Box():
            return BOX
        case Cylinder():
            return CYLINDER
        case Sphere():
            return SPHERE
        case Hull():
            return HULL


class _Spheres(NamedTuple):
    """The arm's spheres, see `ArmArrays`."""

    table: np.ndarray
    first: np.ndarray
    covers: np.ndarray


@lru_cache(maxsize=16)
def _spheres(robot: RobotModel) -> _Spheres:
    tables: list[np.ndarray] = []
    first, covers = [0], np.zeros((ARM_LINKS, 4))
    for k, link in enumerate(robot.links[:ARM_LINKS]):
        own = []
        for solid in robot.geometry:
            if solid.link == link:
                if not isinstance(solid.shape, Sphere):
                    raise ValueError(f"robot {robot.name!r}: {link} has the solid {solid.shape}, spheres expected")
                own.append([*solid.X_LS.translation, solid.shape.radius])
        table = np.array(own)
        covers[k, :3] = table[:, :3].mean(axis=0)
        covers[k, 3] = np.max(np.linalg.norm(table[:, :3] - covers[k, :3], axis=1) + table[:, 3])
        tables.append(table)
        first.append(first[-1] + len(table))
    return _Spheres(np.concatenate(tables), np.array(first), covers)


_NO_CORNERS = np.zeros((0, 3))


def _solid_row(shape: Convex, X: SE3, part: int) -> np.ndarray:
    """A row of a table of solids (SOLID_COLUMNS,), its corners not counted yet."""
    row = _shape_row(shape).copy()
    row[PART] = part
    row[PLACE : PLACE + 9], row[PLACE + 9 : FIRST] = X.rotation.ravel(), X.translation
    if isinstance(shape, Hull):
        row[PLACE + 9 : FIRST] = X.act(middle(shape))
    return row


@lru_cache(maxsize=1024)
def _shape_row(shape: Convex) -> np.ndarray:
    """A solid's row but for where it is and to what it belongs."""
    row = np.zeros(SOLID_COLUMNS)
    row[KIND], row[BOUND], row[HALF:PLACE] = _kind(shape), bounding_radius(shape), extents(shape) / 2
    if isinstance(shape, Hull):
        row[BOUND] = float(np.linalg.norm(shape.solid.vertices - middle(shape), axis=1).max())
        row[COUNT], row[FACES] = len(shape.solid.vertices), len(shape.solid.normals)
    return row


@lru_cache(maxsize=256)
def _corners(shape: Convex) -> np.ndarray:
    """Corners about the middle of the bounding box, then the normals of the faces (n,3)."""
    if not isinstance(shape, Hull):
        return _NO_CORNERS
    return np.concatenate([shape.solid.vertices - middle(shape), shape.solid.normals])


def _with_corners(rows: np.ndarray, shapes: Sequence[Convex]) -> np.ndarray:
    """The corners (n,3) of all shapes, and in `rows` where each shape's begin."""
    if not any(isinstance(shape, Hull) for shape in shapes):
        return _NO_CORNERS
    tables = [_corners(shape) for shape in shapes]
    rows[:, FIRST] = np.cumsum([0, *(len(table) for table in tables[:-1])])
    return np.concatenate([_NO_CORNERS, *tables])


@lru_cache(maxsize=64)
def _hand_rows(robot: RobotModel, opening: float) -> np.ndarray:
    """Hand and fingers as a table (m, SOLID_COLUMNS) in link 7."""
    poses = robot.link_poses(np.zeros(7), opening)
    X_7W = poses["link_7"].inverse()
    return np.array(
        [
            _solid_row(solid.shape, X_7W * poses[solid.link] * solid.X_LS, robot.links.index(solid.link))
            for solid in robot.geometry
            if solid.link in robot.hand_links
        ]
    )


class _Arm(NamedTuple):
    """The robot's tables, the same packed, and which of its own parts can meet."""

    tables: ArmArrays
    packed: Packed
    own: "_OwnPairs"


def _arm(robot: RobotModel, scene: SceneState) -> _Arm:
    held = scene.held
    shape = None if held is None else scene.scenario.bodies[held.name].shape
    return _arm_of(robot, scene.opening, Same(held, shape))


@lru_cache(maxsize=64)
def _arm_of(robot: RobotModel, opening: float, carried: Same) -> _Arm:
    held, shape = carried.things
    tables = _arm_arrays(robot, opening, None if held is None else (held, shape))
    own = _own_pairs(part_names(robot, held), tuple(tables.solids[:, PART].tolist()))
    return _Arm(tables, flat(tables), own)


def _arm_arrays(robot: RobotModel, opening: float, held: tuple[Held, Shape] | None) -> ArmArrays:
    X_7G = robot.model.frames[robot.tcp_id].placement
    solids, corners = _hand_rows(robot, opening), _NO_CORNERS
    probes = X_7G.translation[None]
    if held is not None:
        grip, shape = held
        X_7O = X_7G * grip.X_GO
        parts = convex_parts(shape)
        rows = np.array([_solid_row(part, X_7O * X_OP, len(robot.links)) for part, X_OP in parts])
        corners = _with_corners(rows, [part for part, _ in parts])
        solids = np.concatenate([solids, rows])
        ends = (middle(shape) + _CORNERS * (extents(shape) / 2)) @ X_7O.rotation.T + X_7O.translation
        probes = np.concatenate([probes, ends])
    limits = np.stack([robot.q_min, robot.q_max])
    probes = np.append(probes, np.zeros((len(probes), 1)), axis=1)
    return ArmArrays(*chain(robot), limits, *_spheres(robot), solids, corners, probes, _turning(robot, solids))


def _turning(robot: RobotModel, solids: np.ndarray) -> np.ndarray:
    """See `ArmArrays`. The origin of the next joint keeps its distance from an axis, and all beyond it its distance
    from that origin at most."""
    steps = chain(robot).joints[1:, 9:]
    turning = np.zeros((7, 9))
    turning[:, :8] = _link_turning(robot)
    reach = np.linalg.norm(solids[:, PLACE + 9 : FIRST], axis=1) + np.linalg.norm(solids[:, HALF:PLACE], axis=1)
    turning[:, 8] = _beyond(steps, float(reach.max()))
    return turning


@lru_cache(maxsize=16)
def _link_turning(robot: RobotModel) -> np.ndarray:
    """The columns of links 0 to 7."""
    steps, (table, first, _) = chain(robot).joints[1:, 9:], _spheres(robot)
    turning = np.zeros((7, ARM_LINKS))
    for link in range(1, ARM_LINKS):
        own = table[first[link] : first[link + 1]]
        turning[:link, link] = _beyond(steps[: link - 1], float(np.max(np.linalg.norm(own[:, :3], axis=1) + own[:, 3])))
    return turning


def _beyond(steps: np.ndarray, reach: float) -> np.ndarray:
    """How far what lies within `reach` of the last origin can be from each axis (z): (n+1,). steps (n,3) lead from each
    origin to the next."""
    found = [reach]
    for step in steps[::-1]:
        found.append(float(np.hypot(step[0], step[1])) + reach)
        reach += float(np.linalg.norm(step))
    return np.array(found[::-1])


@lru_cache(maxsize=64)
def _obstacle_rows(standing: Standing) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Names, the table (n, OBSTACLE_COLUMNS) and that of its corners (h,3), as in `tables`."""
    groups = standing.groups
    parts = [_group_rows(Same(group)) for group in groups]
    table = np.concatenate([rows for rows, _ in parts])
    before = np.cumsum([0, *(len(corners) for _, corners in parts[:-1])])
    table[:, FIRST] += np.repeat(before, [len(rows) for rows, _ in parts])
    names = tuple(obstacle.name for group in groups for obstacle in group)
    return names, table, np.concatenate([corners for _, corners in parts])


@lru_cache(maxsize=1024)
def _group_rows(group: Same) -> tuple[np.ndarray, np.ndarray]:
    (obstacles,) = group.things
    return placed_rows([(obstacle.shape, obstacle.X_WS) for obstacle in obstacles])


def placed_rows(solids: Sequence[tuple[Convex, SE3]]) -> tuple[np.ndarray, np.ndarray]:
    """Table (n, OBSTACLE_COLUMNS) and corners (h,3) of placed solids."""
    table = np.zeros((len(solids), OBSTACLE_COLUMNS))
    for row, (shape, X) in zip(table, solids, strict=True):
        row[:SOLID_COLUMNS] = _solid_row(shape, X, 0)
        reach = np.abs(X.rotation) @ row[HALF : HALF + 3]
        row[LOWER : LOWER + 3] = row[FIRST - 3 : FIRST] - reach
        row[UPPER : UPPER + 3] = row[FIRST - 3 : FIRST] + reach
    return table, _with_corners(table, [shape for shape, _ in solids])


class _OwnPairs(NamedTuple):
    """Pairs of the robot's parts. Rows (k,3), (l,3) of two links, of a solid and a link: their pair's number, both.
    free: both tables as they are with no margin."""

    pairs: list[Pair]
    links: np.ndarray
    solids: np.ndarray
    free: tuple[np.ndarray, np.ndarray]


@lru_cache(maxsize=64)
def _own_pairs(parts: tuple[str, ...], riders: tuple[float, ...]) -> _OwnPairs:
    """riders: the part that each solid belongs to."""
    pairs = self_collision_pairs(parts)
    links, solids = [], []
    for n, (outer, inner) in enumerate(pairs):
        a, b = parts.index(outer), parts.index(inner)
        if a < ARM_LINKS:
            links.append((n, a, b))
        else:
            solids += [(n, s, b) for s, part in enumerate(riders) if part == a]
    first, second = (np.array(table, dtype=float).reshape(-1, 3) for table in (links, solids))
    free = _watched(first, np.zeros(len(first))), _watched(second, np.zeros(len(second)))
    return _OwnPairs([frozenset(pair) for pair in pairs], first, second, free)


def _scene_tables(arm: _Arm, parts: tuple[str, ...], scene: SceneState, margins: Margins) -> SceneArrays:
    names, table, corners = _obstacle_rows(Standing(scene))
    bounds = table[:, LOWER:OBSTACLE_COLUMNS].T
    links, solids = arm.own.links, arm.own.solids
    if margins.allowed or margins.relaxed:
        within = margins.within_robot(arm.own.pairs)
        links, solids = (_watched(rows, within[rows[:, 0].astype(int)]) for rows in (links, solids))
    else:
        links, solids = arm.own.free
    return SceneArrays(table, corners, margins.table(parts, names), links, solids, bounds)


def _watched(rows: np.ndarray, margins: np.ndarray) -> np.ndarray:
    """Rows (k,3) of two parts and their margin, those left out that may do anything."""
    return np.column_stack([rows[:, 1:], margins])[margins > -np.inf]


def clear_of(
    moving: Sequence[tuple[Convex, SE3]], places: np.ndarray, standing: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """At which of the places (n,12, see `chain`) do the moving solids overlap none of the standing ones? (n,) of bool.

    standing: what `placed_rows` gave.
    """
    rows = np.array([_solid_row(shape, X, 0) for shape, X in moving])
    own = _with_corners(rows, [shape for shape, _ in moving])
    margins = np.zeros((1, len(standing[0])))
    return np.array([not hand_contacts(place[None], rows, own, *standing, margins).any() for place in places])
