"""Shapes in PyBullet, and the frame about which it turns them.

PyBullet keeps a body's pose as that of its principal axes of inertia, and gives meshes and compounds the inertia of
their bounding box. So these and discs are built in their principal frame I (about O, the shape's own origin), with the
true one.
"""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pybullet as p
from pinocchio import SE3

from scenarios.hulls import Polyhedron, ShapeError, polyhedron
from scenarios.shapes import Box, Compound, Cylinder, Hull, Shape, Sphere, convex_parts, inertia
from sim.surfaces import triangles

RIM = 48
"""Sides of what stands for a disc: 0.2 % of its radius is missing between its corners."""


def principal_axes(shape: Shape) -> tuple[SE3, np.ndarray] | None:
    """X_OI and the principal moments (3,) per kg; None for a shape that PyBullet knows how to turn by itself."""
    if not isinstance(shape, Hull | Compound) and not _is_flat(shape):
        return None
    moments, axes = np.linalg.eigh(inertia(shape, 1.0))
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] = -axes[:, 2]
    return SE3(axes, np.zeros(3)), moments


def add_collision_shape(shape: Shape, client: int) -> int:
    """The number of a new collision shape, a hull or compound in its principal frame."""
    match shape:
        case Box(size):
            return p.createCollisionShape(p.GEOM_BOX, halfExtents=[s / 2 for s in size], physicsClientId=client)
        case Cylinder(radius, height) if not _is_flat(shape):
            return p.createCollisionShape(p.GEOM_CYLINDER, radius=radius, height=height, physicsClientId=client)
        case Sphere(radius):
            return p.createCollisionShape(p.GEOM_SPHERE, radius=radius, physicsClientId=client)
        case Cylinder() | Hull() | Compound():
            with _part_arrays(_pieces(shape), _R_OI(shape).T) as arrays:
                return p.createCollisionShapeArray(**arrays, physicsClientId=client)


def add_visual_shape(shape: Shape, client: int, **paint: Any) -> int:
    """The number of a new visual shape, a hull or compound in its own frame O. `paint`: as createVisualShape has it."""
    match shape:
        case Box(size):
            return p.createVisualShape(p.GEOM_BOX, halfExtents=[s / 2 for s in size], physicsClientId=client, **paint)
        case Cylinder(radius, height):
            return p.createVisualShape(p.GEOM_CYLINDER, radius=radius, length=height, physicsClientId=client, **paint)
        case Sphere(radius):
            return p.createVisualShape(p.GEOM_SPHERE, radius=radius, physicsClientId=client, **paint)
        case Hull() | Compound():
            corners = triangles(shape)
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            normals /= np.linalg.norm(normals, axis=1)[:, None]
            return p.createVisualShape(
                p.GEOM_MESH,
                vertices=corners.reshape(-1, 3).tolist(),
                indices=list(range(3 * len(corners))),
                normals=np.repeat(normals, 3, axis=0).tolist(),
                physicsClientId=client,
                **paint,
            )


def _R_OI(shape: Shape) -> np.ndarray:
    axes = principal_axes(shape)
    return np.eye(3) if axes is None else axes[0].rotation


_Piece = tuple[Box | Cylinder | Sphere | Polyhedron, SE3]


def _is_flat(shape: Shape) -> bool:
    """Is it a disc, wider than high? It lies and is pulled on its face, under which the engine's one point of contact
    would wander about."""
    return isinstance(shape, Cylinder) and shape.height < 2.0 * shape.radius


def _pieces(shape: Cylinder | Hull | Compound) -> list[_Piece]:
    match shape:
        case Cylinder(radius, height):
            angles = 2.0 * np.pi * np.arange(RIM) / RIM
            rim = [[radius * np.cos(a), radius * np.sin(a), z] for a in angles for z in (-height / 2, height / 2)]
            return _octants(polyhedron(np.array(rim)))
        case Hull():
            return _octants(shape.solid)
        case Compound():
            return _parts(shape)


def _parts(shape: Compound) -> list[_Piece]:
    return [(part.solid if isinstance(part, Hull) else part, X_OP) for part, X_OP in convex_parts(shape)]


def _octants(solid: Polyhedron) -> list[_Piece]:
    """A hull cut along its three axes: PyBullet finds one point of contact at a time for a pair of convex solids, and
    a hull in one piece would turn about it, in the hand as on the table."""
    pieces = [solid]
    for axis in np.eye(3):
        pieces = [half for piece in pieces for half in _halves(piece, axis)]
    return [(piece, SE3.Identity()) for piece in pieces]


def _halves(solid: Polyhedron, axis: np.ndarray) -> Iterator[Polyhedron]:
    """Both halves of a convex solid, or the one that isn't a sliver."""
    for points in _cut(solid.vertices, axis):
        with suppress(ShapeError):
            yield polyhedron(points)


def _cut(points: np.ndarray, axis: np.ndarray) -> Iterator[np.ndarray]:
    """The corners (n,3) of both halves of a convex solid with corners (m,3), cut square to the axis at the origin."""
    height = points @ axis
    above, below = points[height > 0.0], points[height < 0.0]
    a, b = np.repeat(above, len(below), axis=0), np.tile(below, (len(above), 1))
    share = (a @ axis) / ((a - b) @ axis)
    level = np.concatenate([a + (b - a) * share[:, None], points[height == 0.0]])
    for side in (above, below):
        if len(side):
            yield np.concatenate([side, level])


@contextmanager
def _part_arrays(parts: list[_Piece], R_IO: np.ndarray) -> Iterator[dict[str, list]]:
    """Arguments of createCollisionShapeArray; polyhedra, which it only takes from files, lie in a temporary folder."""
    arrays: dict[str, list] = {"shapeTypes": [], "halfExtents": [], "radii": [], "lengths": [], "fileNames": []}
    positions, quaternions = [], []
    with tempfile.TemporaryDirectory() as folder:
        for number, (shape, X_OP) in enumerate(parts):
            kind, half, radius, length, file = p.GEOM_BOX, [0.0] * 3, 0.0, 0.0, ""
            match shape:
                case Box(size):
                    half = [s / 2 for s in size]
                case Cylinder(r, h):
                    kind, radius, length = p.GEOM_CYLINDER, r, h
                case Sphere(r):
                    kind, radius = p.GEOM_SPHERE, r
                case Polyhedron():
                    kind, file = p.GEOM_MESH, str(Path(folder) / f"{number}.obj")
                    Path(file).write_text(_obj(shape))
            for key, value in zip(arrays, (kind, half, radius, length, file), strict=True):
                arrays[key].append(value)
            positions.append((R_IO @ X_OP.translation).tolist())
            quaternions.append(pin.Quaternion(R_IO @ X_OP.rotation).coeffs().tolist())
        yield {
            **arrays,
            "meshScales": [[1.0] * 3] * len(parts),
            "collisionFramePositions": positions,
            "collisionFrameOrientations": quaternions,
        }


def _obj(solid: Polyhedron) -> str:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in solid.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in solid.triangles.tolist()]
    return "\n".join(lines) + "\n"
