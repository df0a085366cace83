"""Antipodal grasps of hulls and compounds: two points of the surface between which the fingers can close.

Lines through the shape give pairs of points: where it enters and where it leaves some material. Of these the
fingers' stroke must span the width, the surface at both ends must face the line within the friction cone,
and the hand, coming in square to the line, must find room for its fingers and palm.
"""

from dataclasses import dataclass, replace

import numpy as np
from pinocchio import SE3

from planner.motion.chain import placement
from planner.motion.collision import clear_of, placed_rows
from planner.stability import room_about
from scenarios.shapes import Box, Compound, Convex, Hull, convex_parts, outline
from sim.robot import Gripper
from sim.surfaces import triangles

CONE = float(np.arctan(0.3))
"""Half angle in rad of the friction cone that every grasp stays within: less friction than anything has."""

SAMPLES = 150
"""Points of the surface through which lines are laid, besides those through the centre of mass."""

MOST = 100
"""Pairs of points that are kept, best first."""

CLEARANCE = 0.005
"""Least gap in metres between each open finger and the object."""

LEAST_WIDTH = 0.002
SEAM = 0.0005
"""Metres between two parts over which material counts as going on."""

TIP = 0.012
"""Metres from the fingertips to where they touch."""

LEAST_TIP = 0.003
TIP_CLEARANCE = 0.004
"""Metres that the fingertips stay short of where the material ends, and what it lies on may begin."""

APPROACH_STEP = np.radians(18.0)
"""A fraction of a right angle: what lies on one of its sides is grasped squarely from above."""
PATCH = 0.006
"""Metres about a point of contact within which the surface should go on."""

SPACING = 0.01
"""Metres between the middles of pairs that close the same way."""

UNEVEN = 0.0025
SINK = 0.001
"""Metres that the pads may sink into a face that isn't flat, counted as room for them."""


@dataclass(frozen=True)
class Grips:
    """Grasps as arrays: rotations R_OG (n,3,3), positions p_OG (n,3), widths (n,), and how poor each one is (n,)."""

    R: np.ndarray
    p: np.ndarray
    width: np.ndarray
    cost: np.ndarray


@dataclass(frozen=True)
class _Pair:
    """Two opposite points of contact: their middle (3,), the unit vector (3,) from one to the other, their distance,
    and how poor they are."""

    middle: np.ndarray
    closing: np.ndarray
    width: float
    cost: float


def antipodal_grips(shape: Hull | Compound, gripper: Gripper) -> Grips:
    """All that is found, always the same for the same shape. `cost`: 0 for flat, parallel faces, up to about 0.5."""
    solids = _Solids(shape)
    starts, directions = _lines(shape, solids)
    widest = gripper.stroke - 2 * CLEARANCE
    pairs = _distinct(_pairs(solids, starts, directions, widest))[: 2 * MOST]
    pairs = [replace(pair, cost=pair.cost + _roughness(solids, pair)) for pair in pairs]
    pairs += _distinct(_faced(shape, widest))[:MOST]
    pairs.sort(key=lambda pair: pair.cost + 2.0 * _off_centre(pair))
    standing = placed_rows(convex_parts(shape))
    R, p, width, cost = [], [], [], []
    for pair in pairs[:MOST]:
        hands = _hands(solids, pair)
        has_room = clear_of(_moving(pair, gripper), np.array([placement(X) for X in hands]), standing)
        for X_OG in (X for X, free in zip(hands, has_room, strict=True) if free):
            for R_OG in (X_OG.rotation, X_OG.rotation @ np.diag([-1.0, -1.0, 1.0])):
                R.append(R_OG)
                p.append(X_OG.translation)
                width.append(pair.width)
                cost.append(pair.cost)
    return Grips(np.array(R).reshape(-1, 3, 3), np.array(p).reshape(-1, 3), np.array(width), np.array(cost))


class _Solids:
    """The convex parts as planes: normals (k,3), offsets (k,) and each plane's part (k,), sorted by part."""

    def __init__(self, shape: Hull | Compound) -> None:
        normals, offsets, part = [], [], []
        for number, (convex, X_OP) in enumerate(convex_parts(shape)):
            solid = outline(convex)
            turned = solid.normals @ X_OP.rotation.T
            normals.append(turned)
            offsets.append(solid.offsets + turned @ X_OP.translation)
            part += [number] * len(turned)
        self.normals, self.offsets = np.concatenate(normals), np.concatenate(offsets)
        self.part = np.array(part)
        self._first = np.flatnonzero(np.r_[True, np.diff(self.part) > 0])
        self._end = np.r_[self._first[1:], len(self.part)]

    def contain(self, points: np.ndarray, depth: float) -> np.ndarray:
        """Which of the points (n,3) lie deeper than `depth` metres in some part? (n,) of bool."""
        outside = points @ self.normals.T - self.offsets
        return np.any(np.maximum.reduceat(outside, self._first, axis=1) < -depth, axis=1)

    def crossings(self, start: np.ndarray, direction: np.ndarray) -> list[tuple[float, float, int, int]]:
        """Where a line enters and leaves material: distances from `start` (3,), the planes there; in order."""
        slope = self.normals @ direction
        room = self.offsets - self.normals @ start
        with np.errstate(divide="ignore", invalid="ignore"):
            at = room / slope
        enter = np.where(slope < -1e-9, at, -np.inf)
        leave = np.where(slope > 1e-9, at, np.inf)
        enter[(np.abs(slope) <= 1e-9) & (room < 0.0)] = np.inf
        is_met = np.maximum.reduceat(enter, self._first) < np.minimum.reduceat(leave, self._first)
        found = []
        for k in np.flatnonzero(is_met):
            first, end = self._first[k], self._end[k]
            a, b = first + int(enter[first:end].argmax()), first + int(leave[first:end].argmin())
            found.append((float(enter[a]), float(leave[b]), a, b))
        return _joined(sorted(found))


def _joined(spans: list[tuple[float, float, int, int]]) -> list[tuple[float, float, int, int]]:
    merged: list[tuple[float, float, int, int]] = []
    for span in spans:
        if merged and span[0] <= merged[-1][1] + SEAM:
            enter, leave, a, b = merged[-1]
            merged[-1] = (enter, leave, a, b) if leave >= span[1] else (enter, span[1], a, span[3])
        else:
            merged.append(span)
    return merged


def _lines(shape: Hull | Compound, solids: _Solids) -> tuple[np.ndarray, np.ndarray]:
    """Starts and directions (n,3) of lines square to the surface: through the centre of mass, and through points spread
    over the surface."""
    # Heavy, and only scenes with meshes need it.
    import trimesh

    faces = triangles(shape).reshape(-1, 3)
    mesh = trimesh.Trimesh(faces, np.arange(len(faces)).reshape(-1, 3), process=False)
    points, index = trimesh.sample.sample_surface(mesh, SAMPLES, seed=0)[:2]
    inward = -np.asarray(mesh.face_normals)[index]
    bare = ~solids.contain(np.asarray(points), 1e-4)
    central = -solids.normals
    return np.concatenate([np.zeros_like(central), points[bare]]), np.concatenate([central, inward[bare]])


def _pairs(solids: _Solids, starts: np.ndarray, directions: np.ndarray, widest: float) -> list[_Pair]:
    found = []
    least = np.cos(CONE)
    for start, d in zip(starts, directions, strict=True):
        spans = solids.crossings(start, d)
        for i, (enter, _, a, _) in enumerate(spans):
            if -solids.normals[a] @ d < least:
                continue
            for _, leave, _, b in spans[i:]:
                if LEAST_WIDTH <= leave - enter <= widest and solids.normals[b] @ d >= least:
                    slant = 2.0 + solids.normals[a] @ d - solids.normals[b] @ d
                    found.append(_Pair(start + d * (enter + leave) / 2, d, leave - enter, 3.0 * float(slant)))
    return found


def _faced(shape: Hull | Compound, widest: float) -> list[_Pair]:
    """Pairs between a face, of a part or of the whole outline, and what lies farthest from it: another face, an edge or
    a corner. One pad lies flat on the face; where the other one touches lies over that face, so nothing tilts."""
    found = []
    for convex, X_OP in [*convex_parts(shape), (shape, SE3.Identity())]:
        solid = outline(convex)
        for k, normal in enumerate(solid.normals):
            heights = solid.vertices @ normal
            width = float(solid.offsets[k] - heights.min())
            far = solid.vertices[heights < heights.min() + SINK]
            touch = far.mean(axis=0)
            touch = touch + normal * float(heights.min() - touch @ normal)
            if LEAST_WIDTH <= width <= widest and room_about(solid.face(k), normal, touch) > 0.0:
                middle = touch + normal * width / 2
                found.append(_Pair(X_OP.act(middle), -(X_OP.rotation @ normal), width, 0.3 / min(len(far), 3) - 0.1))
    return found


def _roughness(solids: _Solids, pair: _Pair) -> float:
    """0 to 0.4: at how many of four points about the contact the surface is not where it is in the middle."""
    d, half = pair.closing, pair.width / 2
    x, w = _square_to(d)
    missing = 0
    for side in (x, -x, w, -w):
        spans = solids.crossings(pair.middle + PATCH * side, d)
        enters, leaves = (any(abs(span[k] - end) < UNEVEN for span in spans) for k, end in ((0, -half), (1, half)))
        missing += not (enters and leaves)
    return 0.1 * missing


def _off_centre(pair: _Pair) -> float:
    """Distance in metres of the closing line from the centre of mass."""
    off = _cross(pair.middle, pair.closing)
    return float(np.sqrt(off @ off))


def _distinct(pairs: list[_Pair]) -> list[_Pair]:
    """The pairs, best first, less those that are nearly the same as a better one."""
    pairs = sorted(pairs, key=lambda pair: (pair.cost + 2.0 * _off_centre(pair), pair.width))
    middle = np.array([pair.middle for pair in pairs]).reshape(-1, 3)
    closing = np.array([pair.closing for pair in pairs]).reshape(-1, 3)
    width = np.array([pair.width for pair in pairs])
    kept: list[int] = []
    for k in range(len(pairs)):
        near = np.linalg.norm(middle[kept] - middle[k], axis=1) < SPACING
        near &= (np.abs(closing[kept] @ closing[k]) > 0.98) & (np.abs(width[kept] - width[k]) < UNEVEN)
        if not near.any():
            kept.append(k)
    return [pairs[k] for k in kept]


def _hands(solids: _Solids, pair: _Pair) -> list[SE3]:
    """Poses X_OG of the hand all round the closing line."""
    x, w = _square_to(pair.closing)
    found = []
    for angle in np.arange(0.0, 2 * np.pi - 1e-9, APPROACH_STEP):
        approach = np.cos(angle) * x + np.sin(angle) * w
        across = np.cos(angle) * w - np.sin(angle) * x
        R_OG = np.column_stack([across, pair.closing, approach])
        left = next(
            (leave for enter, leave, *_ in solids.crossings(pair.middle, approach) if enter <= 0.0 <= leave), TIP
        )
        found.append(SE3(R_OG, pair.middle + min(TIP, max(LEAST_TIP, left - TIP_CLEARANCE)) * approach))
    return found


def _square_to(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors x and w = y × x (3,)."""
    x = _cross(y, np.eye(3)[int(np.abs(y).argmin())])
    x = x / np.sqrt(x @ x)
    return x, _cross(y, x)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The cross product of two vectors; NumPy's takes ten times as long for so few numbers."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _moving(pair: _Pair, gripper: Gripper) -> list[tuple[Convex, SE3]]:
    """Palm, and the space that each finger takes from open to closed, in G."""
    across, thick, length = gripper.pad
    inner = pair.width / 2 + SINK
    outer = min(gripper.stroke, pair.width + 2 * CLEARANCE) / 2 + thick
    finger = Box((across, outer - inner, length))
    moving: list[tuple[Convex, SE3]] = [
        (finger, SE3(np.eye(3), np.array([0.0, side * (outer + inner) / 2, -length / 2]))) for side in (1.0, -1.0)
    ]
    moving.append((Box(gripper.body), SE3(np.eye(3), np.array([0.0, 0.0, -length - gripper.body[2] / 2]))))
    return moving
