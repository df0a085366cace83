"""Solid things in the world, and whether they overlap (exactly, by coal)."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import coal
import numpy as np
from pinocchio import SE3

from scenarios.hulls import Polyhedron
from scenarios.regions import parts
from scenarios.scenario import Body, Fixture, Region, Table
from scenarios.shapes import Box, Convex, Cylinder, Hull, Sphere, bounding_radius, convex_parts, volume

TOUCH = 1e-4
"""How deep in metres two things may overlap and still count as touching: hand-written poses are rounded."""


@dataclass(frozen=True)
class Solid:
    """A named thing: its convex parts, each with its pose X_WP in the world."""

    name: str
    parts: tuple[tuple[Convex, SE3], ...]

    @property
    def centre(self) -> np.ndarray:
        """Centre of volume (3,) in W."""
        weights = np.array([volume(shape) for shape, _ in self.parts])
        return weights @ np.array([X_WP.translation for _, X_WP in self.parts]) / weights.sum()

    @cached_property
    def ball(self) -> tuple[np.ndarray, float]:
        """Centre (3,) in W and radius of a sphere that holds the whole thing."""
        centre = np.mean([X_WP.translation for _, X_WP in self.parts], axis=0)
        reach = [np.linalg.norm(X_WP.translation - centre) + bounding_radius(shape) for shape, X_WP in self.parts]
        return centre, float(max(reach))

    def moved(self, X_WW: SE3) -> "Solid":
        """The same thing after a rigid motion of the world."""
        return Solid(self.name, tuple((shape, X_WW * X_WP) for shape, X_WP in self.parts))


def body_solid(body: Body | Fixture, X_WO: SE3 | None = None) -> Solid:
    """A body or fixture where it is declared, or at X_WO."""
    X_WO = body.X_WO if X_WO is None else X_WO
    return Solid(body.name, tuple((shape, X_WO * X_OP) for shape, X_OP in convex_parts(body.shape)))


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


def distance(first: tuple[Convex, SE3], second: tuple[Convex, SE3]) -> float:
    """Distance in metres between two placed shapes, negative if they overlap; a lower bound when far apart."""
    (a, X_WA), (b, X_WB) = first, second
    gap = float(np.linalg.norm(X_WA.translation - X_WB.translation)) - bounding_radius(a) - bounding_radius(b)
    if gap > 0:
        return gap
    return coal.distance(
        geometry(a), _place(X_WA), geometry(b), _place(X_WB), coal.DistanceRequest(), coal.DistanceResult()
    )


def _place(X: SE3) -> coal.Transform3s:
    return coal.Transform3s(X.rotation, X.translation)


@lru_cache(maxsize=1024)
def geometry(shape: Convex) -> coal.ShapeBase:
    """The shape as coal knows it, in the shape's own frame."""
    match shape:
        case Box((x, y, z)):
            return coal.Box(x, y, z)
        case Cylinder(radius, height):
            return coal.Cylinder(radius, height)
        case Sphere(radius):
            return coal.Sphere(radius)
        case Hull():
            return polytope(shape.solid, np.zeros(3))


def polytope(solid: Polyhedron, offset: np.ndarray) -> coal.Convex:
    """A polyhedron as coal knows it, moved by `offset` (3,) metres."""
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(solid.vertices + offset))
    triangles.extend([coal.Triangle(*map(int, corners)) for corners in solid.triangles])
    return coal.Convex(points, triangles)
