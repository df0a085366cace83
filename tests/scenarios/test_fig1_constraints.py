"""In fig1 the box closes the way of every stroke and the book that of the tomato, whatever the noise.

Plane geometry only: the footprints of the sponge, of the swept cube and of the hand that holds the
sponge by its ends run along straight lines in every direction that ends in the dustpan, at every
offset that keeps the cube before the sponge. A thing is in the way if a footprint at its height
crosses its own.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from pinocchio import SE3

from scenarios.load import load_scenario
from scenarios.regions import OUTWARD, interior
from scenarios.scenario import Scenario
from scenarios.shapes import extents
from sim.robot import RobotModel

SEEDS = range(8)
ANGLES = np.radians(np.arange(-60, 61, 3))
OFFSETS = np.linspace(-0.04, 0.04, 7)
GRIP_HEIGHT = 0.015
CLEARANCE = 0.003

HAND = RobotModel().gripper


@dataclass(frozen=True)
class Footprint:
    """A rectangle in W's plane: corners (4, 2) in order, and the height above the table at which it begins."""

    corners: NDArray[np.float64]
    bottom: float


def strokes(scene: Scenario, cube: str) -> list[list[Footprint]]:
    """What each straight stroke of the cube into the dustpan sweeps."""
    pan = scene.regions["dustpan"]
    assert pan.open_side is not None
    lower, upper = interior(pan)
    inward = -(pan.X_WR.rotation @ OUTWARD[pan.open_side])[:2]
    along = np.array([-inward[1], inward[0]])
    start = scene.bodies[cube].X_WO.translation[:2]
    centre = pan.X_WR.translation[:2]
    away = (centre - inward * pan.size[1] / 2 - start) @ inward
    width = (upper[0] - lower[0]) / 2 - extents(scene.bodies[cube].shape)[0] / 2
    found = []
    for angle in ANGLES:
        direction = np.cos(angle) * inward + np.sin(angle) * along
        length = away / np.cos(angle)
        if abs((start + direction * length - centre) @ along) <= width:
            found += [_swept(scene, start, direction, length, offset) for offset in OFFSETS]
    return found


def _swept(scene: Scenario, start: NDArray, direction: NDArray, length: float, offset: float) -> list[Footprint]:
    cube = extents(scene.bodies["carrot"].shape)[0] / 2
    long, wide, _ = extents(scene.bodies["sponge"].shape) / 2
    fingers = long + HAND.pad[1]
    behind = -cube - wide
    pieces = [  # half width, offset, from, to, bottom
        (cube, 0.0, -cube, length, 0.0),
        (long, offset, behind - wide, length - cube, 0.0),
        (fingers, offset, behind - HAND.pad[0] / 2, behind + HAND.pad[0] / 2 + length, GRIP_HEIGHT),
        (
            HAND.body[1] / 2,
            offset,
            behind - HAND.body[0] / 2,
            behind + HAND.body[0] / 2 + length,
            GRIP_HEIGHT + HAND.pad[2],
        ),
    ]
    side = np.array([-direction[1], direction[0]])
    return [
        Footprint(
            np.array([start + s * side + t * direction for s, t in ((o - w, a), (o + w, a), (o + w, b), (o - w, b))]), z
        )
        for w, o, a, b, z in pieces
    ]


def in_the_way(scene: Scenario, name: str, swept: list[Footprint], clearance: float) -> bool:
    """Does the body stand where the stroke sweeps?"""
    body = scene.bodies[name]
    x, y, height = extents(body.shape)
    R, p = body.X_WO.rotation[:2, :2], body.X_WO.translation[:2]
    corners = np.array([p + R @ (sx * x / 2, sy * y / 2) for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1))])
    return any(f.bottom < height and _cross(f.corners, corners, clearance) for f in swept)


def _cross(a: NDArray, b: NDArray, clearance: float) -> bool:
    for corners in (a, b):
        edges = np.diff(corners[:3], axis=0)
        normals = edges / np.linalg.norm(edges, axis=1)[:, None]
        for normal in normals:
            u, v = a @ normal, b @ normal
            if u.max() + clearance <= v.min() or v.max() + clearance <= u.min():
                return False
    return True


@pytest.mark.parametrize("scene_name", ["fig1", "fig1_wipe"])
@pytest.mark.parametrize("cube", ["carrot", "tomato"])
def test_no_stroke_passes_the_box(scene_name, cube):
    for seed in SEEDS:
        scene = load_scenario(scene_name, seed)
        assert all(in_the_way(scene, "box", swept, 0.0) for swept in strokes(scene, cube)), seed


def test_no_stroke_of_the_tomato_passes_the_book():
    for seed in SEEDS:
        scene = load_scenario("fig1", seed)
        assert all(in_the_way(scene, "book", swept, 0.0) for swept in strokes(scene, "tomato")), seed


def test_with_the_box_aside_the_carrot_can_be_wiped():
    for seed in SEEDS:
        scene = load_scenario("fig1", seed)
        assert any(not in_the_way(scene, "book", swept, CLEARANCE) for swept in strokes(scene, "carrot")), seed


def test_with_the_box_aside_and_the_book_dragged_to_the_edge_the_tomato_can_be_wiped():
    for seed in SEEDS:
        scene = load_scenario("fig1", seed)
        book = scene.bodies["book"]
        far = scene.table.X_WT.translation[1] + scene.table.size[1] / 2
        dragged = SE3(book.X_WO.rotation, np.array([*book.X_WO.translation[:1], far - 0.055, book.X_WO.translation[2]]))
        after = replace(scene, bodies={**scene.bodies, "book": replace(book, X_WO=dragged)})
        assert any(not in_the_way(after, "book", swept, CLEARANCE) for swept in strokes(after, "tomato")), seed
