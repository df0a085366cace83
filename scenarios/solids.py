"""Solid things in the world, and whether they overlap (exactly, by coal)."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import coal
import numpy as np
from pinocchio import SE3

from scenarios.regions import parts
from scenarios.scenario import Body, Fixture, Region, Table
from scenarios.shapes import Box, Cylinder, Shape, Sphere, bounding_radius

TOUCH = 1e-4
"""How deep in metres two things may overlap and still count as touching: hand-written poses are rounded."""


@dataclass(frozen=True)
class Solid:
    """A named thing: its convex parts, each with its pose X_WP in the world."""

    name: str
    parts: tuple[tuple[Shape, SE3], ...]

    def moved(self, X_WW: SE3) -> "Solid":
        """The same thing after a rigid motion of the world."""
        return Solid(self.name, tuple((shape, X_WW * X_WP) for shape, X_WP in self.parts))


def body_solid(body: Body | Fixture, X_WO: SE3 | None = None) -> Solid:
    """A body or fixture where it is declared, or at X_WO."""
    return Solid(body.name, ((body.shape, body.X_WO if X_WO is None else X_WO),))


def table_solid(table: Table) -> Solid:
    """The table's plate."""
    return Solid("table", ((table.shape, table.X_WT),))


def region_solid(region: Region) -> Solid:
    """A region's floor, walls and ramp."""
    return Solid(region.name, tuple((shape, region.X_WR * X_RP) for shape, X_RP in parts(region)))


def region_hull(region: Region) -> Solid:
    """A region's outer box, its inside filled."""
    return Solid(region.name, ((Box(region.size), region.X_WR),))


def overlap(first: Solid, second: Solid, depth: float = TOUCH) -> bool:
    """Do two things overlap by more than `depth` metres?"""
    return any(distance(a, b) < -depth for a in first.parts for b in second.parts)


def overlapping(solid: Solid, others: Iterable[Solid]) -> str | None:
    """The name of the first of the others that overlaps the solid, or None."""
    return next((other.name for other in others if overlap(solid, other)), None)


def distance(first: tuple[Shape, SE3], second: tuple[Shape, SE3]) -> float:
    """Distance in metres between two placed shapes, negative if they overlap; a lower bound when far apart."""
    (a, X_WA), (b, X_WB) = first, second
    gap = float(np.linalg.norm(X_WA.translation - X_WB.translation)) - bounding_radius(a) - bounding_radius(b)
    if gap > 0:
        return gap
    return coal.distance(
        _geometry(a), _place(X_WA), _geometry(b), _place(X_WB), coal.DistanceRequest(), coal.DistanceResult()
    )


def _place(X: SE3) -> coal.Transform3s:
    return coal.Transform3s(X.rotation, X.translation)


@lru_cache(maxsize=1024)
def _geometry(shape: Shape) -> coal.ShapeBase:
    match shape:
        case Box((x, y, z)):
            return coal.Box(x, y, z)
        case Cylinder(radius, height):
            return coal.Cylinder(radius, height)
        case Sphere(radius):
            return coal.Sphere(radius)
