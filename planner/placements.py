"""Where and how to let go of a held object inside a container or on the table, best first.

A placement is the object's pose X_WO when released, a little above what it will rest on. It may be
tilted so that the hand points down into a container; then it falls the rest of the way.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from planner.stability import UPRIGHT, level_top, rests
from scenarios.regions import interior
from scenarios.scenario import Region, Table
from scenarios.shapes import Box, Compound, Hull, Shape, extents, outline, reach
from sim.scene import depth_below, height_above

DROP = 0.01
"""Metres between the object's lowest point and what it will rest on, at release."""

TILTS = np.radians([0.0, 40.0, 50.0, 60.0, 75.0, 90.0])
YAWS = np.radians(np.arange(0.0, 360.0, 30.0))
LEVEL = 0.1
"""Sine of the angle by which the hand may point upwards at release."""

OVERTILT = np.radians(10.0)
"""Angle by which a tilt may turn the hand past pointing straight down."""

OUTWARDS = 0.4
"""Exponent below 1 that draws spots towards the walls of a container, so that room is left for what comes later."""

EDGE = 0.002
"""Metres above the lowest corner within which corners belong to the lowest edge."""

WALL_GAP = 0.005
EDGE_GAP = 0.01


@dataclass(frozen=True)
class Placement:
    """Pose of the object in W at release, and where it is expected to lie afterwards, as plain numbers.

    release, rest: x, y, z in metres and quaternion (x, y, z, w).
    """

    release: tuple[float, ...]
    rest: tuple[float, ...]

    @cached_property
    def X_WO(self) -> SE3:
        return pin.XYZQUATToSE3(np.array(self.release))

    @cached_property
    def X_WO_rest(self) -> SE3:
        return pin.XYZQUATToSE3(np.array(self.rest))


@dataclass(frozen=True)
class Surface:
    """A level rectangle to put things on: X_WS of its centre, half extents (2,), height of the walls (0: none)."""

    X_WS: SE3
    half: np.ndarray
    wall: float


def surface_of(place: Region | Table) -> Surface:
    """The floor of a container or the top of the table."""
    if isinstance(place, Table):
        lift = SE3(np.eye(3), np.array([0.0, 0.0, place.size[2] / 2]))
        return Surface(place.X_WT * lift, np.array(place.size[:2]) / 2, 0.0)
    lower, upper = interior(place)
    centre = np.array([(lower[0] + upper[0]) / 2, (lower[1] + upper[1]) / 2, lower[2]])
    return Surface(place.X_WR * SE3(np.eye(3), centre), (upper[:2] - lower[:2]) / 2, float(upper[2] - lower[2]))


def top_of(shape: Shape, X_WO: SE3) -> Surface | None:
    """The top of a body that lies level, to put something on; None if there is no flat top."""
    if not isinstance(shape, Box):
        top = level_top(shape, X_WO)
        if top is None:
            return None
        centre, yaw, half = top
        return Surface(SE3(pin.rpy.rpyToMatrix(0.0, 0.0, yaw), centre), np.full(2, half), 0.0)
    up_O = X_WO.rotation[2]
    axis = int(np.argmax(np.abs(up_O)))
    if abs(up_O[axis]) < UPRIGHT:
        return None
    down_O = -np.sign(up_O[axis]) * np.eye(3)[axis]
    R = X_WO.rotation @ _turn_down((float(down_O[0]), float(down_O[1]), float(down_O[2]))).T
    yaw = pin.rpy.rpyToMatrix(0.0, 0.0, float(np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])))
    half = np.abs(yaw.T @ X_WO.rotation) @ extents(shape) / 2
    centre = X_WO.translation + np.array([0.0, 0.0, height_above(shape, X_WO.rotation)])
    return Surface(SE3(yaw, centre), half[:2], 0.0)


def placements(
    shape: Shape, held: tuple[SE3, SE3], surface: Surface, rng: np.random.Generator, spots: int = 6
) -> Iterator[Placement]:
    """Placements of an object that is held at X_GO with the hand at X_WG, `held` = (X_WG, X_GO).

    The least tilted come first, among them those that turn the object the least on the way, and
    `spots` random positions for each direction.

    The object gets a face down on which it stands firmly, and where no walls are, one on which it doesn't roll;
    tilting turns it with the hand towards pointing straight down; then there is room for it to fall flat.
    Overlap with other things is not looked at here.
    """
    X_WG, X_GO = held
    R_WO = X_WG.rotation @ X_GO.rotation
    tilts = TILTS[:1] if surface.wall == 0.0 else TILTS
    for tilt in tilts:
        found = [
            (firmness, -float(np.trace(R_WO.T @ R_target)), R_target)
            for firmness, R_upright in enumerate(_uprights(shape, X_GO, surface.wall > 0.0))
            for yaw in YAWS
            if (R_target := _turned(R_upright, X_GO, float(tilt), float(yaw), surface)) is not None
        ]
        found.sort(key=lambda way: way[:2])
        fits: list[_Fit] = []
        for _, _, R_target in found:
            fit = _fit(shape, surface, R_target)
            if fit is not None:
                fits.append(fit)
                yield _placement(surface, fit, rng)
        for _ in range(1, spots):
            for fit in fits:
                yield _placement(surface, fit, rng)


def _turned(R_upright: np.ndarray, X_GO: SE3, tilt: float, yaw: float, surface: Surface) -> np.ndarray | None:
    """R_WO of an upright object turned by `yaw` and tilted with the hand; None if that points the hand past down."""
    R_WO = R_upright
    approach = R_WO @ X_GO.rotation.T[:, 2]
    level = approach * np.array([1.0, 1.0, 0.0])
    if tilt > 0.0:
        if np.linalg.norm(level) < np.sin(tilt - OVERTILT):
            return None
        axis = np.cross(level / np.linalg.norm(level), np.array([0.0, 0.0, -1.0]))
        R_WO = pin.exp3(axis / np.linalg.norm(axis) * tilt) @ R_WO
    return surface.X_WS.rotation @ pin.rpy.rpyToMatrix(0.0, 0.0, yaw) @ R_WO


@dataclass(frozen=True)
class _Fit:
    """One way to turn the object above a surface: R_SO at release and at rest, how far it moves in the plane as it
    falls (2,), its height above the surface at release and at rest, and the middle (2,) and half size (2,) of where
    its centre may be released."""

    R_SO: np.ndarray
    R_rest: np.ndarray
    shift: np.ndarray
    heights: tuple[float, float]
    middle: np.ndarray
    room: np.ndarray


def _fit(shape: Shape, surface: Surface, R_WO: np.ndarray) -> _Fit | None:
    """None if the surface has no room for the object when it is turned like this."""
    R_SO = surface.X_WS.rotation.T @ R_WO
    R_rest, shift = _fallen(shape, R_SO)
    half = surface.half - (WALL_GAP if surface.wall > 0.0 else EDGE_GAP)
    lower = np.array([max(reach(shape, -R_SO[i]), reach(shape, -R_rest[i]) - shift[i]) for i in range(2)]) - half
    upper = half - np.array([max(reach(shape, R_SO[i]), reach(shape, R_rest[i]) + shift[i]) for i in range(2)])
    room = (upper - lower) / 2
    if np.any(room < 0.0):
        return None
    heights = depth_below(shape, R_SO) + DROP, depth_below(shape, R_rest)
    return _Fit(R_SO, R_rest, shift, heights, (upper + lower) / 2, room)


def _placement(surface: Surface, fit: _Fit, rng: np.random.Generator) -> Placement:
    along = rng.uniform(-1.0, 1.0, 2)
    spread = fit.room * (np.sign(along) * np.abs(along) ** OUTWARDS if surface.wall > 0.0 else along)
    spot = fit.middle + spread
    X_WO = surface.X_WS * SE3(fit.R_SO, np.array([*spot, fit.heights[0]]))
    X_rest = surface.X_WS * SE3(fit.R_rest, np.array([*(spot + fit.shift), fit.heights[1]]))
    return Placement(_numbers(X_WO), _numbers(X_rest))


def _uprights(shape: Shape, X_GO: SE3, may_roll: bool) -> list[np.ndarray]:
    """Rotations R_WO with one side of the object down on which it stands firmly, the hand not below level.

    Those in which the hand points down the most come first.
    """
    approach_O = X_GO.rotation.T[:, 2]
    found = []
    for rest in rests(shape):
        downward = float(approach_O @ np.array(rest.down))
        if rest.is_firm and downward > -LEVEL and (may_roll or not rest.rolls):
            found.append((-round(downward, 6), len(found), _turn_down(rest.down)))
    return [R for _, _, R in sorted(found, key=lambda entry: entry[:2])]


@lru_cache(maxsize=1024)
def _turn_down(down_O: tuple[float, float, float]) -> np.ndarray:
    """A rotation that takes the object's direction `down_O` to −z of the world."""
    z = -np.array(down_O)
    across = np.roll(z, 1)
    x = across - (across @ z) * z
    if np.linalg.norm(x) < 0.1:
        across = np.eye(3)[int(np.argmin(np.abs(z)))]
        x = across - (across @ z) * z
    x = x / np.linalg.norm(x)
    return np.vstack([x, np.cross(z, x), z])


def _fallen(shape: Shape, R_SO: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How a tilted object comes to rest: its lowest side turned fully down about its lowest edge.

    Returns the rotation R_SO at rest and how far the centre moves in the plane (2,), in metres.
    """
    downs = [rest.down for rest in rests(shape)]
    flat = _turn_down(downs[int(np.argmax(np.array(downs) @ -R_SO[2]))])
    delta = R_SO @ flat.T
    yaw = np.arctan2(delta[1, 0] - delta[0, 1], delta[0, 0] + delta[1, 1])
    R_rest = pin.rpy.rpyToMatrix(0.0, 0.0, float(yaw)) @ flat
    corners = _corners(shape)
    heights = corners @ R_SO[2]
    edge = corners[heights < heights.min() + EDGE].mean(axis=0)
    return R_rest, ((R_SO - R_rest) @ edge)[:2]


def _corners(shape: Shape) -> np.ndarray:
    """Points (n,3) of the shape of which the lowest ones carry it."""
    if isinstance(shape, Hull | Compound):
        return outline(shape).vertices
    return np.array(list(product(*((-h, h) for h in extents(shape) / 2))))


def _numbers(X: SE3) -> tuple[float, ...]:
    return tuple(round(float(x), 9) for x in pin.SE3ToXYZQUAT(X))
