"""On which sides a body can stand, and what can stand on top of it: quasi-static, from the faces of its outline."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from pinocchio import SE3

from scenarios.shapes import Box, Cylinder, Shape, Sphere, convex_parts, extents, outline, reach

FIRM = 0.3
"""Least distance from the centre of mass, seen from above, to the edge of the face a body stands on, as a share of its
height above that face: the tangent of the angle by which it can be tilted without toppling."""

LEAST_BASE = 0.003
"""Least such distance in metres."""

UPRIGHT = 0.995
"""Cosine of the angle off level up to which something can be put on top of a body."""

SAME_HEIGHT = 0.001


@dataclass(frozen=True)
class Rest:
    """A side on which a body can lie: the direction `down` (3,) in its frame, and whether it stays there by itself.

    is_firm: it doesn't topple. rolls: it lies on a round side.
    """

    down: tuple[float, float, float]
    is_firm: bool
    rolls: bool = False


@lru_cache(maxsize=512)
def rests(shape: Shape) -> tuple[Rest, ...]:
    """The sides on which a body can lie, firm or not, on level ground."""
    if not isinstance(shape, Box | Cylinder | Sphere):
        return tuple(Rest(_triple(normal), is_firm) for normal, is_firm in _faces(shape))
    found = []
    for axis in range(3):
        is_firm = float(np.delete(extents(shape), axis).min()) >= FIRM * extents(shape)[axis]
        rolls = isinstance(shape, Sphere) or (isinstance(shape, Cylinder) and axis != 2)
        found += [Rest(_triple(sign * np.eye(3)[axis]), is_firm, rolls) for sign in (1.0, -1.0)]
    return tuple(found)


def level_top(shape: Shape, X_WO: SE3) -> tuple[np.ndarray, float, float] | None:
    """A flat, level place on top of a body that lies at X_WO: its centre (3,) in W, yaw in rad, half side in metres.

    The square is inscribed in the largest circle about the middle of a face. None if the top is round or tilted.
    """
    best: tuple[np.ndarray, float, float] | None = None
    for corners, normal in tops(shape, X_WO.rotation[2], UPRIGHT):
        centre, radius = _middle_of(corners, normal)
        half = radius / np.sqrt(2.0)
        if best is None or half > best[2]:
            best = X_WO.act(centre), 0.0, half
    return best


def tops(shape: Shape, up_O: np.ndarray, level: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Flat faces than which nothing of the shape is higher: corners (n,3) and normal (3,) in O. `up_O` (3,) is the way
    up in O, `level` the cosine of the angle off it up to which a face counts."""
    height = reach(shape, up_O)
    found = []
    for part, X_OP in convex_parts(shape):
        solid = outline(part)
        normals = solid.normals @ X_OP.rotation.T
        for k in np.flatnonzero(normals @ up_O > level):
            corners = solid.face(int(k)) @ X_OP.rotation.T + X_OP.translation
            if height - float((corners @ up_O).max()) <= SAME_HEIGHT:
                found.append((corners, normals[k]))
    return found


def _faces(shape: Shape) -> list[tuple[np.ndarray, bool]]:
    """Normals (3,) of the faces above which the centre of mass lies, and whether the body stands on them firmly."""
    solid = outline(shape)
    found = []
    for k, normal in enumerate(solid.normals):
        inside = room_about(solid.face(k), normal, np.zeros(3))
        if inside > 0.0:
            found.append((normal, inside >= max(FIRM * float(solid.offsets[k]), LEAST_BASE)))
    return found


def _middle_of(corners: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, float]:
    """Mean (3,) of a face's corners (n,3), and its distance to the nearest edge."""
    centre = corners.mean(axis=0)
    return centre, room_about(corners, normal, centre)


def room_about(corners: np.ndarray, normal: np.ndarray, p: np.ndarray) -> float:
    """Distance from the point p (3,), projected onto a face, to the face's nearest edge; below zero outside."""
    x = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    x = x / np.linalg.norm(x)
    flat = corners @ np.column_stack([x, np.cross(normal, x)])
    at = p @ np.column_stack([x, np.cross(normal, x)])
    around = flat - flat.mean(axis=0)
    ring = flat[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
    edges = np.roll(ring, -1, axis=0) - ring
    lengths = np.linalg.norm(edges, axis=1)
    kept = lengths > 1e-9
    to = at - ring[kept]
    return float(((edges[kept, 0] * to[:, 1] - edges[kept, 1] * to[:, 0]) / lengths[kept]).min())


def _triple(p: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(c) for c in p)
    return x, y, z
