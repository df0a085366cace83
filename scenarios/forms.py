"""The shapes that a scene file describes: meshes read, hulls taken, compounds put together."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from scenarios import schema
from scenarios.document import KeyPath
from scenarios.hulls import ShapeError
from scenarios.meshes import read_points
from scenarios.shapes import Box, Compound, Convex, Cylinder, Hull, Shape, Sphere

Problem = tuple[KeyPath, str]


class _Misshapen(Exception):
    """A shape that can't be made: where below the shape's key, and why."""

    def __init__(self, path: KeyPath, message: str) -> None:
        self.path = path
        super().__init__(message)


def forms(file: schema.SceneFile, folder: Path | None) -> tuple[dict[str, Shape], list[Problem]]:
    """The shape of everything by name, and what is wrong with those that are missing. `folder` holds mesh files."""
    shapes: dict[str, Shape] = {}
    problems: list[Problem] = []
    for path, solid in _solids(file):
        try:
            shapes[path[1]] = form(solid, folder)
        except _Misshapen as error:
            problems.append(((*path, "shape", *error.path), str(error)))
    return shapes, problems


def form(solid: schema.Solid, folder: Path | None) -> Shape:
    """One shape, about its centre of volume."""
    if solid.compound is None:
        return _convex(solid, folder, ())
    placed = []
    for k, part in enumerate(solid.compound):
        R = pin.rpy.rpyToMatrix(np.radians(part.pose.rpy_deg))
        shape = _convex(part.shape, folder, ("compound", k, "shape"))
        placed.append((shape, SE3(R, np.array(part.pose.xyz, dtype=float))))
    try:
        return Compound.of(placed)[0]
    except ShapeError as error:
        raise _Misshapen(("compound",), str(error)) from None


def _solids(file: schema.SceneFile) -> Iterator[tuple[tuple[str, str], schema.Solid]]:
    for group in ("fixed", "objects", "tools"):
        for name, thing in getattr(file, group).items():
            yield (group, name), thing.shape


def _convex(solid: schema.ConvexSolid, folder: Path | None, path: KeyPath) -> Convex:
    if solid.box is not None:
        x, y, z = solid.box
        return Box((float(x), float(y), float(z)))
    if solid.cylinder is not None:
        return Cylinder(float(solid.cylinder.radius), float(solid.cylinder.height))
    if solid.sphere is not None:
        return Sphere(float(solid.sphere.radius))
    if solid.mesh is None:
        raise ValueError("a shape without box, cylinder, sphere and mesh")
    key = "vertices" if solid.mesh.file is None else "file"
    try:
        return Hull.of(_points(solid.mesh, folder))[0]
    except ShapeError as error:
        raise _Misshapen((*path, "mesh", key), str(error)) from None


def _points(mesh: schema.Mesh, folder: Path | None) -> np.ndarray:
    if mesh.file is None:
        return np.array(mesh.vertices, dtype=float)
    return read_points(mesh.file, folder)
