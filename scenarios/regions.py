"""The solid parts and the inside of a container, in its own frame R (origin: centre of the outer box)."""

import numpy as np
from pinocchio import SE3

from scenarios.scenario import OpenSide, Region
from scenarios.shapes import Box

OUTWARD: dict[OpenSide, np.ndarray] = {
    "+x": np.array([1.0, 0.0, 0.0]),
    "-x": np.array([-1.0, 0.0, 0.0]),
    "+y": np.array([0.0, 1.0, 0.0]),
    "-y": np.array([0.0, -1.0, 0.0]),
}


def ramp_length(region: Region) -> float:
    """Horizontal length in metres of the ramp that climbs from the outer bottom to the floor."""
    if region.ramp_deg is None:
        return 0.0
    return region.wall / np.tan(np.radians(region.ramp_deg))


def interior(region: Region) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner (3,) of the space inside, in R, in metres: floor to rim, wall to wall, ramp left out."""
    half = np.array(region.size) / 2
    lower = -half + region.wall
    upper = half - region.wall
    upper[2] = half[2]
    if region.open_side is not None:
        out = OUTWARD[region.open_side]
        axis = int(np.argmax(np.abs(out)))
        reach = half[axis] - ramp_length(region)
        if out[axis] > 0:
            upper[axis] = reach
        else:
            lower[axis] = -reach
    return lower, upper


def parts(region: Region) -> list[tuple[Box, SE3]]:
    """Solid boxes of the region with their poses X_RP: floor, walls, and the ramp's plate if it has one."""
    sx, sy, sz = region.size
    wall = region.wall
    half = np.array(region.size) / 2
    solid: list[tuple[Box, SE3]] = []

    floor_lower, floor_upper = -half.copy(), half.copy()
    floor_upper[2] = -half[2] + wall
    out = None if region.open_side is None else OUTWARD[region.open_side]
    if out is not None and region.ramp_deg is not None:
        axis = int(np.argmax(np.abs(out)))
        if out[axis] > 0:
            floor_upper[axis] -= ramp_length(region)
        else:
            floor_lower[axis] += ramp_length(region)
        solid.append(_ramp(region, out, axis))
    solid.append(_box_between(floor_lower, floor_upper))

    for side, direction in OUTWARD.items():
        if side == region.open_side:
            continue
        axis = int(np.argmax(np.abs(direction)))
        size = np.array([sx, sy, sz])
        size[axis] = wall
        if axis == 1:
            size[0] -= 2 * wall
        centre = direction * (half[axis] - wall / 2)
        solid.append((Box((float(size[0]), float(size[1]), float(size[2]))), SE3(np.eye(3), centre)))
    return solid


def _box_between(lower: np.ndarray, upper: np.ndarray) -> tuple[Box, SE3]:
    size = upper - lower
    return Box((float(size[0]), float(size[1]), float(size[2]))), SE3(np.eye(3), (lower + upper) / 2)


def _ramp(region: Region, out: np.ndarray, axis: int) -> tuple[Box, SE3]:
    """A tilted plate whose upper face runs from the outer bottom edge up to the floor's upper face."""
    half = np.array(region.size) / 2
    slope = np.radians(region.ramp_deg or 0.0)
    length = ramp_length(region) / np.cos(slope)
    thickness = region.wall / 2
    width = region.size[1 - axis] - 2 * region.wall
    z = np.array([0.0, 0.0, 1.0])
    uphill = -out * np.cos(slope) + z * np.sin(slope)
    normal = out * np.sin(slope) + z * np.cos(slope)
    R_RP = np.column_stack([uphill, np.cross(normal, uphill), normal])
    lip = out * half[axis] - z * half[2]
    centre = lip + uphill * length / 2 - normal * thickness / 2
    return Box((float(length), float(width), float(thickness))), SE3(R_RP, centre)
