"""Convex primitives. The origin is the geometric centre, sizes are full extents in metres."""

from dataclasses import dataclass

import numpy as np


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


Shape = Box | Cylinder | Sphere


def extents(shape: Shape) -> np.ndarray:
    """Full extents (3,) of the shape's bounding box in its own frame, in metres."""
    match shape:
        case Box(size):
            return np.array(size, dtype=float)
        case Cylinder(radius, height):
            return np.array([2 * radius, 2 * radius, height])
        case Sphere(radius):
            return np.full(3, 2 * radius)


def bounding_radius(shape: Shape) -> float:
    """Radius in metres of the smallest sphere about the origin that holds the shape."""
    match shape:
        case Box(size):
            return float(np.linalg.norm(size)) / 2
        case Cylinder(radius, height):
            return float(np.hypot(radius, height / 2))
        case Sphere(radius):
            return radius


def inscribed_radius(shape: Shape) -> float:
    """Radius in metres of the largest sphere about the origin inside the shape."""
    match shape:
        case Box(size):
            return min(size) / 2
        case Cylinder(radius, height):
            return min(radius, height / 2)
        case Sphere(radius):
            return radius


def volume(shape: Shape) -> float:
    """Volume in cubic metres."""
    match shape:
        case Box(size):
            return float(np.prod(size))
        case Cylinder(radius, height):
            return float(np.pi * radius**2 * height)
        case Sphere(radius):
            return float(4 / 3 * np.pi * radius**3)
