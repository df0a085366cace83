"""Things for generated tables: shapes as a scene file has them, with their extents. Lengths in metres."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.hulls import polyhedron

DECIMALS = 4
"""Figures after the point in generated files: a tenth of a millimetre."""


@dataclass(frozen=True)
class Ware:
    """A kind of thing: `shape` as plain data of the scene format; full `size` (3,) of its bounding box; `mass` in kg.

    `drift`: where the middle of the bounding box lies from the origin, in x and y.
    """

    kind: str
    shape: dict[str, Any]
    size: tuple[float, float, float]
    mass: float
    drift: tuple[float, float] = (0.0, 0.0)


def box(x: float, y: float, z: float, kind: str = "box") -> Ware:
    """A cuboid."""
    return Ware(kind, {"box": [number(x), number(y), number(z)]}, (x, y, z), _mass(x * y * z))


def can(radius: float, height: float) -> Ware:
    """An upright cylinder."""
    shape = {"cylinder": {"radius": number(radius), "height": number(height)}}
    return Ware("can", shape, (2 * radius, 2 * radius, height), _mass(np.pi * radius**2 * height))


def prism(rng: np.random.Generator, radius: float, height: float) -> Ware:
    """A mesh: a column with 5 to 8 sides."""
    angles = np.arange(count := int(rng.integers(5, 9))) * 2 * np.pi / count
    rings = [
        np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(count, z)]) for z in (0.0, height)
    ]
    return _mesh("prism", np.concatenate(rings))


def wedge(x: float, y: float, z: float) -> Ware:
    """A mesh: a roof whose ridge lies along y, half as wide as its base."""
    base = [[i, j, 0.0] for i in (-x / 2, x / 2) for j in (-y / 2, y / 2)]
    ridge = [[i, j, z] for i in (-x / 4, x / 4) for j in (-y / 2, y / 2)]
    return _mesh("wedge", np.array(base + ridge))


def mug(radius: float, height: float) -> Ware:
    """A compound: a bottom, a wall of ten staves, and a handle."""
    wall, count = 0.006, 10
    inner = radius - wall
    parts = [_part({"cylinder": {"radius": number(inner), "height": 0.008}}, (0.0, 0.0, 0.004))]
    width = 2 * radius * np.tan(np.pi / count)
    for k in range(count):
        angle = 2 * np.pi * k / count
        at = (radius - wall / 2) * np.array([np.cos(angle), np.sin(angle), 0.0]) + [0.0, 0.0, height / 2]
        parts.append(_part({"box": [wall, number(width), number(height)]}, at, 360.0 * k / count))
    reach = radius + 0.02
    for z in (0.3 * height, 0.75 * height):
        parts.append(_part({"box": [0.024, 0.012, 0.012]}, (radius + 0.01, 0.0, z)))
    grip = 0.45 * height + 0.012
    parts.append(_part({"box": [0.01, 0.012, number(grip)]}, (reach + 0.006, 0.0, 0.525 * height)))
    drift = 0.006
    return Ware("mug", {"compound": parts}, (2 * radius + 0.031, 2 * radius, height), 0.25, (drift, 0.0))


def bowl(radius: float, height: float) -> Ware:
    """A compound: a bottom, and a wall of ten slanting staves, each a mesh."""
    wall, count, foot = 0.007, 10, 0.6 * radius
    half = np.tan(np.pi / count)
    stave = np.array(
        [
            [r, side * r * half, z]
            for r, z in ((foot - wall, 0.0), (foot, 0.0), (radius - wall, height), (radius, height))
            for side in (-1.0, 1.0)
        ]
    )
    centre = polyhedron(stave).centroid
    shape = {"mesh": {"vertices": [[number(c) for c in p - centre] for p in stave]}}
    parts = [_part({"cylinder": {"radius": number(foot - wall), "height": 0.008}}, (0.0, 0.0, 0.004))]
    for k in range(count):
        angle = 2 * np.pi * k / count
        at = (centre[0] * np.cos(angle), centre[0] * np.sin(angle), centre[2])
        parts.append(_part(shape, at, 360.0 * k / count))
    return Ware("bowl", {"compound": parts}, (2 * radius, 2 * radius, height), 0.2)


def number(value: float) -> float:
    """Rounded as files have it."""
    return round(float(value), DECIMALS) + 0.0


def _part(shape: dict[str, Any], xyz: Any, yaw_deg: float = 0.0) -> dict[str, Any]:
    pose: dict[str, Any] = {"xyz": [number(c) for c in xyz]}
    if yaw_deg:
        pose["rpy_deg"] = [0.0, 0.0, number(yaw_deg if yaw_deg <= 180.0 else yaw_deg - 360.0)]
    return {"shape": shape, "pose": pose}


def _mesh(kind: str, points: np.ndarray) -> Ware:
    points = np.round(points, DECIMALS)
    size = np.ptp(points, axis=0)
    solid = polyhedron(points)
    drift = (points.min(axis=0) + points.max(axis=0)) / 2 - solid.centroid
    shape = {"mesh": {"vertices": [[number(c) for c in p] for p in points]}}
    return Ware(kind, shape, tuple(size.tolist()), _mass(solid.volume), (float(drift[0]), float(drift[1])))


def _mass(volume: float) -> float:
    """What it weighs at 450 kg/m³, within what hands carry with ease."""
    return number(min(max(450.0 * volume, 0.05), 0.8))
