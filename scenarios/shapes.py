"""Solid shapes. Sizes are full extents in metres.

The origin O of every shape is its centre of volume, so that a body's pose is that of its centre of mass. For box,
cylinder and sphere it is the geometric centre as well; a hull or a compound need not reach equally far to both sides
of it: `bounds` and `reach` tell how far it does.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from scenarios.hulls import Polyhedron, ShapeError, hull_of, polyhedron

CENTRED = 1e-6
"""Metres that a hull's or compound's centre of volume may lie from its origin."""

MAX_VERTICES = 256
"""Vertices that a hull may have: every collision check looks at all of them."""

MAX_PARTS = 64


@dataclass(frozen=True)
class Box:
    """A cuboid with full extents `size` = (x, y, z) in metres along its own axes."""

    size: tuple[float, float, float]


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along its own z axis; `radius` and full `height` in metres."""

    radius: float
    height: float


@dataclass(frozen=True)
class Sphere:
    """A sphere of `radius` metres."""

    radius: float


@dataclass(frozen=True)
class Hull:
    """A convex polyhedron by its vertices in metres, its centre of volume at the origin. `Hull.of` makes one.

    Raises ShapeError for points that span no solid, too many, or ones about another centre.
    """

    vertices: tuple[tuple[float, float, float], ...]

    def __post_init__(self) -> None:
        if len(self.solid.vertices) > MAX_VERTICES:
            raise ShapeError(f"the hull has {len(self.solid.vertices)} vertices, expected at most {MAX_VERTICES}")
        off = float(np.linalg.norm(self.solid.centroid))
        if off > CENTRED:
            raise ShapeError(f"the centre of volume lies {off * 1000:.3g} mm from the origin, expected it there")

    @staticmethod
    def of(points: np.ndarray) -> "tuple[Hull, np.ndarray]":
        """The convex hull of points (n,3), moved to its centre, and where that lay (3,). Raises ShapeError."""
        solid = polyhedron(points)
        return Hull(tuple(_triple(p - solid.centroid) for p in solid.vertices)), solid.centroid

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash(self.vertices)

    @cached_property
    def solid(self) -> Polyhedron:
        """Its faces, volume and moments."""
        return hull_of(self.vertices)


Convex = Box | Cylinder | Sphere | Hull


@dataclass(frozen=True)
class Part:
    """A convex part of a compound: its shape, and the pose X_OP of the shape's origin as plain numbers.

    position (3,) in metres, quaternion (x, y, z, w).
    """

    shape: Convex
    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    @cached_property
    def X_OP(self) -> SE3:
        return pin.XYZQUATToSE3(np.array(self.position + self.quaternion))

    @staticmethod
    def at(shape: Convex, X_OP: SE3) -> "Part":
        """A part from a pose."""
        x, y, z, qx, qy, qz, qw = (round(float(n), 12) for n in pin.SE3ToXYZQUAT(X_OP))
        return Part(shape, (x, y, z), (qx, qy, qz, qw))


@dataclass(frozen=True)
class Compound:
    """One rigid body of convex parts, its centre of volume at the origin. `Compound.of` makes one.

    Each part counts in full: where two overlap, the volume counts twice. Raises ShapeError for no
    parts, too many, or ones about another centre.
    """

    parts: tuple[Part, ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.parts) <= MAX_PARTS:
            raise ShapeError(f"{len(self.parts)} parts, expected 1 to {MAX_PARTS}")
        off = float(np.linalg.norm(_centre(self.parts)))
        if off > CENTRED:
            raise ShapeError(f"the centre of volume lies {off * 1000:.3g} mm from the origin, expected it there")

    @staticmethod
    def of(parts: Iterable[tuple[Convex, SE3]]) -> "tuple[Compound, np.ndarray]":
        """Placed shapes as one, moved to their common centre, and where that lay (3,). Raises ShapeError."""
        placed = [Part.at(shape, X) for shape, X in parts]
        if not placed:
            raise ShapeError(f"0 parts, expected 1 to {MAX_PARTS}")
        centre = _centre(placed)
        back = SE3(np.eye(3), -centre)
        return Compound(tuple(Part.at(part.shape, back * part.X_OP) for part in placed)), centre

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash(self.parts)


Shape = Convex | Compound


def convex_parts(shape: Shape) -> tuple[tuple[Convex, SE3], ...]:
    """The convex parts of a shape with their poses X_OP: itself, or those of a compound."""
    if isinstance(shape, Compound):
        return tuple((part.shape, part.X_OP) for part in shape.parts)
    return ((shape, SE3.Identity()),)


def extents(shape: Shape) -> np.ndarray:
    """Full extents (3,) of the shape's bounding box in its own frame, in metres. See `middle` for where that lies."""
    match shape:
        case Box(size):
            return np.array(size, dtype=float)
        case Cylinder(radius, height):
            return np.array([2 * radius, 2 * radius, height])
        case Sphere(radius):
            return np.full(3, 2 * radius)
        case Hull() | Compound():
            lower, upper = bounds(shape)
            return upper - lower


def bounds(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner (3,) of the shape's bounding box in its own frame, in metres."""
    if isinstance(shape, Hull | Compound):
        lower, upper = _bounds(shape)
        return lower.copy(), upper.copy()
    half = extents(shape) / 2
    return -half, half


def middle(shape: Shape) -> np.ndarray:
    """Centre (3,) of the shape's bounding box in its own frame, in metres: zero for all but hulls and compounds."""
    lower, upper = bounds(shape)
    return (lower + upper) / 2


def reach(shape: Shape, direction: np.ndarray) -> float:
    """How far in metres the shape extends from its origin along a unit vector (3,) of its own frame."""
    match shape:
        case Box(size):
            return float(np.abs(direction) @ np.array(size)) / 2
        case Cylinder(radius, height):
            return float(np.hypot(direction[0], direction[1]) * radius + abs(direction[2]) * height / 2)
        case Sphere(radius):
            return radius
        case Hull():
            return float((shape.solid.vertices @ direction).max())
        case Compound(parts):
            ahead = (reach(part.shape, part.X_OP.rotation.T @ direction) for part in parts)
            return max(r + float(part.X_OP.translation @ direction) for r, part in zip(ahead, parts, strict=True))


@lru_cache(maxsize=1024)
def bounding_radius(shape: Shape) -> float:
    """Radius in metres of the smallest sphere about the origin that holds the shape; of a compound's parts' spheres."""
    match shape:
        case Box(size):
            return float(np.linalg.norm(size)) / 2
        case Cylinder(radius, height):
            return float(np.hypot(radius, height / 2))
        case Sphere(radius):
            return radius
        case Hull():
            return float(np.linalg.norm(shape.solid.vertices, axis=1).max())
        case Compound(parts):
            return max(float(np.linalg.norm(part.position)) + bounding_radius(part.shape) for part in parts)


def inscribed_radius(shape: Shape) -> float:
    """Radius in metres of the largest sphere about the origin inside the shape, for a compound inside one of its parts;
    0 if the origin lies in none of them, as in a mug's hollow."""
    match shape:
        case Box(size):
            return min(size) / 2
        case Cylinder(radius, height):
            return min(radius, height / 2)
        case Sphere(radius):
            return radius
        case Hull():
            return float(shape.solid.offsets.min())
        case Compound():
            solids = ((outline(part), X_OP.inverse().translation) for part, X_OP in convex_parts(shape))
            return max(0.0, *(-solid.outside(p_PO) for solid, p_PO in solids))


def volume(shape: Shape) -> float:
    """Volume in cubic metres."""
    match shape:
        case Box(size):
            return float(np.prod(size))
        case Cylinder(radius, height):
            return float(np.pi * radius**2 * height)
        case Sphere(radius):
            return float(4 / 3 * np.pi * radius**3)
        case Hull():
            return shape.solid.volume
        case Compound(parts):
            return sum(volume(part.shape) for part in parts)


def inertia(shape: Shape, mass: float) -> np.ndarray:
    """Rotational inertia (3,3) in kg m² of a homogeneous body about its centre, in its own axes."""
    match shape:
        case Box((x, y, z)):
            return mass / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])
        case Cylinder(r, h):
            side = mass * (3 * r * r + h * h) / 12
            return np.diag([side, side, mass * r * r / 2])
        case Sphere(r):
            return 0.4 * mass * r * r * np.eye(3)
        case Hull():
            return shape.solid.inertia * (mass / shape.solid.volume)
        case Compound(parts):
            density = mass / volume(shape)
            return np.sum([_inertia_about_origin(part, density * volume(part.shape)) for part in parts], axis=0)


@lru_cache(maxsize=512)
def outline(shape: Shape) -> Polyhedron:
    """The convex hull of the whole shape, curved surfaces as 32 flat ones, which lie inside."""
    if isinstance(shape, Hull):
        return shape.solid
    points = [_points(part) @ X.rotation.T + X.translation for part, X in convex_parts(shape)]
    return hull_of(tuple(_triple(p) for p in np.concatenate(points)))


def _points(shape: Convex) -> np.ndarray:
    match shape:
        case Hull():
            return shape.solid.vertices
        case Cylinder(radius, height):
            angles = np.linspace(0.0, 2 * np.pi, 32, endpoint=False)
            ring = np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(32, height / 2)])
            return np.concatenate([ring, ring * [1.0, 1.0, -1.0]])
        case Sphere(radius):
            return radius * _directions()
        case Box(size):
            return np.array(list(product((-0.5, 0.5), repeat=3))) * size


def _directions() -> np.ndarray:
    """Unit vectors (n,3) all round: rings of 16, 22.5° apart."""
    polar, around = np.meshgrid(np.linspace(0.0, np.pi, 9)[1:-1], np.linspace(0.0, 2 * np.pi, 16, endpoint=False))
    ring = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)
    return np.concatenate([ring.reshape(-1, 3), [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])


def _inertia_about_origin(part: Part, mass: float) -> np.ndarray:
    """Rotated, and moved by the parallel-axis theorem."""
    R, p = part.X_OP.rotation, part.X_OP.translation
    return R @ inertia(part.shape, mass) @ R.T + mass * (float(p @ p) * np.eye(3) - np.outer(p, p))


def _centre(parts: Iterable[Part]) -> np.ndarray:
    weighed = [(volume(part.shape), np.array(part.position)) for part in parts]
    return np.sum([v * p for v, p in weighed], axis=0) / sum(v for v, _ in weighed)


@lru_cache(maxsize=512)
def _bounds(shape: Hull | Compound) -> tuple[np.ndarray, np.ndarray]:
    axes = np.eye(3)
    return np.array([-reach(shape, -axis) for axis in axes]), np.array([reach(shape, axis) for axis in axes])


def _triple(p: np.ndarray) -> tuple[float, float, float]:
    """Rounded far below what matters, so that what is written to a file and read again is the same."""
    x, y, z = (round(float(c), 12) for c in p)
    return x, y, z


def distance_to(shape: Shape, p_O: np.ndarray) -> float:
    """Distance in metres from a point p_O (3,), in the shape's frame, to the shape; 0 inside.

    What lies in a compound's hollow is inside: fingers that hold a mug from without have nothing between their middles.
    Beyond an edge of a hull it is the distance to the nearer face's plane, which is less.
    """
    match shape:
        case Box(size):
            return float(np.linalg.norm(np.maximum(np.abs(p_O) - np.array(size) / 2, 0.0)))
        case Cylinder(radius, height):
            radial = max(float(np.hypot(p_O[0], p_O[1])) - radius, 0.0)
            return float(np.hypot(radial, max(abs(float(p_O[2])) - height / 2, 0.0)))
        case Sphere(radius):
            return max(float(np.linalg.norm(p_O)) - radius, 0.0)
        case Hull() | Compound():
            return max(outline(shape).outside(p_O), 0.0)
