"""Convex polyhedra: the hull of points, its faces, its volume and moments."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

MIN_THICKNESS = 0.001
"""Metres that points must extend in every direction to have a hull worth the name."""

_FLAT = 1e-4
"""Sine of the angle between triangles of one face."""


class ShapeError(ValueError):
    """Points or parts that make no solid. The message says what, which value and what was expected."""


@dataclass(frozen=True)
class Polyhedron:
    """A convex polyhedron, lengths in metres, in the frame of the points it is made of.

    vertices (n,3). triangles (m,3): vertex numbers, counterclockwise seen from outside. normals (k,3), offsets (k,)
    of its faces: normal · p ≤ offset for all p inside. centroid (3,). inertia (3,3) about the centroid for 1 kg/m³.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    volume: float
    centroid: np.ndarray
    inertia: np.ndarray

    def face(self, k: int) -> np.ndarray:
        """The vertices (n,3) of face k, in no particular order."""
        return self.vertices[self.vertices @ self.normals[k] > self.offsets[k] - 1e-6]

    def outside(self, p: np.ndarray) -> float:
        """Metres by which the point p (3,) lies beyond the face that it is farthest beyond; below zero inside."""
        return float((self.normals @ p - self.offsets).max())


def polyhedron(points: np.ndarray) -> Polyhedron:
    """The convex hull of points (n,3). Raises ShapeError if they lie in a plane."""
    # Heavy, and only scenes with meshes need it.
    import trimesh

    points = np.asarray(points, dtype=float)
    if len(points) < 4:
        raise ShapeError(f"{len(points)} points span no solid, expected 4 or more")
    if not np.all(np.isfinite(points)):
        raise ShapeError("a coordinate is not finite, expected numbers")
    centred = points - points.mean(axis=0)
    thickness = float(np.ptp(centred @ np.linalg.svd(centred, full_matrices=False)[2][-1]))
    if thickness < MIN_THICKNESS:
        raise ShapeError(f"the points lie within {thickness * 1000:.3g} mm of a plane, expected a solid body")
    mesh = trimesh.convex.convex_hull(points)
    normals, offsets = _faces(np.asarray(mesh.face_normals), np.asarray(mesh.triangles), np.asarray(mesh.area_faces))
    return Polyhedron(
        vertices=np.array(mesh.vertices),
        triangles=np.array(mesh.faces),
        normals=normals,
        offsets=offsets,
        volume=float(mesh.volume),
        centroid=np.array(mesh.center_mass),
        inertia=np.array(mesh.moment_inertia),
    )


@lru_cache(maxsize=512)
def hull_of(points: tuple[tuple[float, float, float], ...]) -> Polyhedron:
    """The same, remembered."""
    return polyhedron(np.array(points))


def _faces(normals: np.ndarray, corners: np.ndarray, areas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Planes (k,3), (k,) of triangles with those normals (m,3), corners (m,3,3) and areas (m,): each plane once.

    The largest triangle of a face says how it lies; the offset is that of its farthest vertex.
    """
    vertices = corners.reshape(-1, 3)
    found: list[np.ndarray] = []
    for k in np.argsort(-areas, kind="stable"):
        if not any(normal @ normals[k] > 1.0 - _FLAT**2 / 2 for normal in found):
            found.append(normals[k])
    planes = np.array(found)
    return planes, (vertices @ planes.T).max(axis=0)
