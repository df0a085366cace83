"""Antipodal grasps with a parallel gripper, best first.

A grasp closes the fingers along one axis of the shape, where its extent fits the stroke, and
comes in along any direction square to that axis. Cylinders and spheres are treated as boxes
turned about their axes of symmetry. Hulls and compounds are left to `antipodal`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from planner.antipodal import CLEARANCE, Grips, antipodal_grips
from scenarios.shapes import Box, Compound, Cylinder, Hull, Shape, Sphere, distance_to, extents
from sim.robot import Gripper

APPROACH_STEP = np.radians(15.0)
DEPTHS = (0.075, 0.045)
"""Metres that the fingers reach over an object, where it is large enough: far, so that it doesn't swing about the line
between the pads, or less where something stands close."""

MIN_DEPTH = 0.02
TIP_CLEARANCE = 0.012
"""Metres that the fingertips stay short of the object's far side, where what it lies on may be."""

LEAST_CLEARANCE = 0.004
CLEARED = 0.3
"""Of something thin, the part of its thickness that they stay short of, but at least LEAST_CLEARANCE metres."""

LEAST_DEPTH = 0.009
"""Metres that the fingers reach over a thin object at least: less doesn't keep it from tilting."""

TIP = 0.01
"""Metres from the fingertips' ends to their middle."""

LOOSE = 0.003
"""Metres from the tips' middle to what is held from which on it hangs by their ends: carried far it is lost."""

LYING = 0.7
"""Cosine of the angle between a cylinder's axis and the vertical below which it lies rather than stands."""

SIDE_STEP = 0.02
JITTER = 0.02


@dataclass(frozen=True)
class Grasp:
    """The gripper's pose in the object's frame, as plain numbers, and the extent `width` between the fingers (m).

    position (3,) in metres, quaternion (x, y, z, w): X_OG.
    """

    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    width: float

    @cached_property
    def X_OG(self) -> SE3:
        return pin.XYZQUATToSE3(np.array(self.position + self.quaternion))

    @staticmethod
    def at(X_OG: SE3, width: float) -> "Grasp":
        """A grasp from a pose."""
        numbers = [round(float(x), 9) for x in pin.SE3ToXYZQUAT(X_OG)]
        return Grasp((numbers[0], numbers[1], numbers[2]), (numbers[3], numbers[4], numbers[5], numbers[6]), width)


def open_width(gripper: Gripper, width: float) -> float:
    """Opening in metres with which to come near an object of `width`: 15 mm to spare a side, if the stroke allows."""
    return min(gripper.stroke, width + 0.03)


def hangs_by_the_tips(shape: Shape, X_GO: SE3) -> bool:
    """Do the fingertips hold a shape at X_GO in the hand by their ends only?"""
    return distance_to(shape, X_GO.actInv(np.array([0.0, 0.0, -TIP]))) > LOOSE


def grasps(shape: Shape, X_WO: SE3, gripper: Gripper, base: np.ndarray, rng: np.random.Generator) -> Iterator[Grasp]:
    """Grasps of a shape that lies at X_WO, best first: from straight above, near the centre; among
    those from the side, away from the robot's base (3,).

    Ends when all are given. `rng` breaks ties, so that another seed tries another order.
    """
    found = _turned(_candidates(shape, gripper), _levelling(shape, X_WO.rotation))
    approach = found.R[:, :, 2] @ X_WO.rotation.T
    outward = (X_WO.translation - base) * np.array([1.0, 1.0, 0.0])
    outward = outward / max(float(np.linalg.norm(outward)), 1e-6)
    offset = np.linalg.norm(np.cross(found.p, found.R[:, :, 2]), axis=1)
    level = 1.0 - np.abs(approach[:, 2])
    lever = np.abs(np.einsum("ij,ij->i", found.p, found.R[:, :, 2]))
    score = -approach[:, 2] + 0.5 * level * (approach @ outward) - 4.0 * offset - 2.0 * lever - found.cost
    score += JITTER * rng.random(len(offset))
    for index in np.argsort(-score, kind="stable"):
        yield Grasp.at(SE3(found.R[index], found.p[index]), float(found.width[index]))


def tool_grasps(
    shape: Shape, X_WO: SE3, gripper: Gripper, base: np.ndarray, rng: np.random.Generator
) -> Iterator[Grasp]:
    """Grasps that leave a wiping tool's base and two of its sides free, from above: by the ends of its longest level
    axis, for the widest front; then, where something stands at an end, by those of the other."""
    level = np.argsort(np.abs(X_WO.rotation[2]))[:2]
    for axis in sorted(level.tolist(), key=lambda axis: -extents(shape)[axis]):
        for grasp in grasps(shape, X_WO, gripper, base, rng):
            closing = grasp.X_OG.rotation[:, 1]
            approach_W = X_WO.rotation @ grasp.X_OG.rotation[:, 2]
            if abs(closing[axis]) > 0.99 and approach_W[2] < -0.99:
                yield grasp


def _levelling(shape: Shape, R_WO: np.ndarray) -> np.ndarray:
    """Rotation (3,3), about an axis of symmetry, after which something round that has rolled is grasped squarely from
    above as if it had not."""
    match shape:
        case Sphere():
            return R_WO.T
        case Cylinder() if abs(R_WO[2, 2]) < LYING:
            return pin.rpy.rpyToMatrix(0.0, 0.0, float(np.arctan2(R_WO[2, 1], R_WO[2, 0])))
    return np.eye(3)


def _turned(grips: Grips, R: np.ndarray) -> Grips:
    return replace(grips, R=R @ grips.R, p=grips.p @ R.T)


@lru_cache(maxsize=256)
def _candidates(shape: Shape, gripper: Gripper) -> Grips:
    if isinstance(shape, Hull | Compound):
        return antipodal_grips(shape, gripper)
    found = [
        (R_OF @ R_FG, R_OF @ p_FG, width)
        for R_OF in _symmetries(shape)
        for R_FG, p_FG, width in _box_grasps(extents(shape), gripper)
    ]
    R = np.array([entry[0] for entry in found]).reshape(-1, 3, 3)
    p = np.array([entry[1] for entry in found]).reshape(-1, 3)
    return Grips(R, p, np.array([entry[2] for entry in found]), np.zeros(len(found)))


def _symmetries(shape: Box | Cylinder | Sphere) -> list[np.ndarray]:
    """Rotations (3,3) of the bounding box that the shape fills equally well."""
    about_z = [pin.rpy.rpyToMatrix(0.0, 0.0, a) for a in np.radians(np.arange(0.0, 90.0, 22.5))]
    match shape:
        case Box():
            return [np.eye(3)]
        case Cylinder():
            return about_z
        case Sphere():
            return about_z


def _box_grasps(size: np.ndarray, gripper: Gripper) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
    """Rotation (3,3), position (3,) and width of every grasp of a box, in its frame."""
    axes = np.eye(3)
    for axis in range(3):
        width = float(size[axis])
        if width > gripper.stroke - 2 * CLEARANCE:
            continue
        first, second = (axis + 1) % 3, (axis + 2) % 3
        closing = axes[axis]
        for angle in np.arange(0.0, 2 * np.pi - 1e-9, APPROACH_STEP):
            c, s = float(np.cos(angle)), float(np.sin(angle))
            approach = c * axes[first] + s * axes[second]
            lateral = s * axes[first] - c * axes[second]
            hands = [np.array([-sign * lateral, sign * closing, approach]).T for sign in (1.0, -1.0)]
            for side, entry, exit_ in _lines_through((float(size[first]), float(size[second])), (c, s)):
                clearance = min(TIP_CLEARANCE, max(LEAST_CLEARANCE, CLEARED * (exit_ - entry)))
                for depth in sorted({min(depth, exit_ - entry - clearance) for depth in DEPTHS}):
                    if depth < max(LEAST_DEPTH, min(MIN_DEPTH, 0.6 * (exit_ - entry))):
                        continue
                    position = lateral * side + approach * (entry + depth)
                    for R_FG in hands:
                        yield R_FG, position, width


def _lines_through(size: tuple[float, float], approach: tuple[float, float]) -> Iterator[tuple[float, float, float]]:
    """Parallel lines along the unit vector `approach` through a rectangle of `size`.

    Yields (lateral offset, entry, exit) in metres from the centre, offsets on a grid about 0 that
    leaves half a finger's width of material at either side.
    """
    lateral = approach[1], -approach[0]
    reach = (abs(lateral[0]) * size[0] + abs(lateral[1]) * size[1]) / 2 - 0.01
    steps = int(max(reach, 0.0) / SIDE_STEP)
    for k in range(-steps, steps + 1):
        side = k * SIDE_STEP
        entry, exit_ = -np.inf, np.inf
        for way, across, length in zip(approach, lateral, size, strict=True):
            if abs(way) > 1e-9:
                half = length / 2 if way > 0.0 else -length / 2
                entry = max(entry, (-half - across * side) / way)
                exit_ = min(exit_, (half - across * side) / way)
        if exit_ > entry:
            yield side, entry, exit_
