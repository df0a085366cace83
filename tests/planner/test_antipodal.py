"""Grasps of any shape: the pads meet the surface squarely, the hand has room, the fingers can open wide enough."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from planner.antipodal import CLEARANCE, CONE, LEAST_TIP, SINK, TIP, antipodal_grips
from planner.grasps import grasps
from scenarios.shapes import Box, Compound, Cylinder, Hull, Shape, convex_parts, reach
from scenarios.solids import Solid, distance, overlap
from sim.robot import WSG50


def _mug() -> Compound:
    parts: list = [(Cylinder(0.036, 0.008), SE3(np.eye(3), np.array([0.0, 0.0, 0.004])))]
    for angle in np.arange(12) * np.pi / 6:
        R = pin.rpy.rpyToMatrix(0.0, 0.0, angle)
        parts.append((Box((0.006, 0.022, 0.09)), SE3(R, R @ np.array([0.037, 0.0, 0.045]))))
    handle = [((0.03, 0.01, 0.01), (0.055, 0.0, z)) for z in (0.025, 0.065)] + [((0.01, 0.01, 0.05), (0.07, 0, 0.045))]
    return Compound.of([*parts, *((Box(size), SE3(np.eye(3), np.array(at))) for size, at in handle)])[0]


def _block(x: float, y: float, z: float) -> Hull:
    return Hull.of(np.array([[i, j, k] for i in (0, x) for j in (0, y) for k in (0, z)], dtype=float))[0]


def _hull(seed: int) -> Hull:
    rng = np.random.default_rng(seed)
    return Hull.of(rng.normal(size=(rng.integers(8, 30), 3)) * rng.uniform(0.015, 0.025, 3))[0]


def _solid(shape: Shape) -> Solid:
    return Solid("it", convex_parts(shape))


def _hand(X_OG: SE3, gap: float) -> Solid:
    """Palm and fingers with their inner faces `gap` metres apart."""
    across, thick, length = WSG50.pad
    parts: list = [(Box(WSG50.body), SE3(np.eye(3), np.array([0.0, 0.0, -length - WSG50.body[2] / 2])))]
    for side in (1.0, -1.0):
        y = side * (gap + thick) / 2
        parts.append((Box((across, thick, length)), SE3(np.eye(3), np.array([0.0, y, -length / 2]))))
    return Solid("hand", tuple((shape, X_OG * X) for shape, X in parts))


@settings(derandomize=True, max_examples=5, deadline=None)
@given(st.integers(0, 10_000))
def test_the_open_hand_touches_nothing_and_the_closed_one_touches_on_both_sides(seed):
    shape = _hull(seed)
    grips = antipodal_grips(shape, WSG50)
    for k in range(0, len(grips.width), 17):
        X_OG, width = SE3(grips.R[k], grips.p[k]), float(grips.width[k])
        assert np.linalg.det(X_OG.rotation) == pytest.approx(1.0)
        assert width <= WSG50.stroke - 2 * CLEARANCE
        assert not overlap(_hand(X_OG, width + 2 * CLEARANCE), _solid(shape))
        closed = _hand(X_OG, width - 2 * SINK).parts[1:]
        assert all(min(distance(finger, part) for part in convex_parts(shape)) < 0.0 for finger in closed)


@settings(derandomize=True, max_examples=5, deadline=None)
@given(st.integers(0, 10_000))
def test_the_pads_touch_squarely_or_where_nothing_reaches_farther(seed):
    shape = _hull(seed)
    grips = antipodal_grips(shape, WSG50)
    for k in range(0, len(grips.width), 29):
        R, p, half = grips.R[k], grips.p[k], grips.width[k] / 2

        def off_surface(tip, R=R, p=p, half=half):
            contacts = (p - tip * R[:, 2] + side * half * R[:, 1] for side in (1.0, -1.0))
            return max(abs(shape.solid.outside(contact)) for contact in contacts)

        tip = min(np.linspace(LEAST_TIP, TIP, 19), key=off_surface)
        assert off_surface(tip) <= SINK
        for side in (1.0, -1.0):
            out = side * R[:, 1]
            contact = p - tip * R[:, 2] + half * out
            gaps = shape.solid.normals @ contact - shape.solid.offsets
            is_square = np.any((gaps > -1e-4) & (shape.solid.normals @ out > np.cos(CONE) - 1e-6))
            assert is_square or contact @ out > reach(shape, out) - SINK


def test_a_mug_is_taken_round_its_outside_by_its_wall_and_by_its_handle():
    width = antipodal_grips(_mug(), WSG50).width
    for extent in (0.08, 0.006, 0.01):
        assert np.any(np.abs(width - extent) < 0.002)


def test_a_column_with_five_sides_is_taken_between_a_side_and_the_edge_across():
    angles = np.arange(5) * 2 * np.pi / 5
    column = [[0.03 * np.cos(a), 0.03 * np.sin(a), z] for a in angles for z in (0.0, 0.08)]
    width = antipodal_grips(Hull.of(np.array(column))[0], WSG50).width
    assert np.any(np.abs(width - 0.03 * (1 + np.cos(np.pi / 5))) < 1e-6)


def test_what_is_wider_than_the_stroke_is_taken_by_no_side():
    assert len(antipodal_grips(_block(0.12, 0.13, 0.14), WSG50).width) == 0
    assert np.allclose(antipodal_grips(_block(0.12, 0.04, 0.14), WSG50).width, 0.04)


def test_a_block_given_as_a_mesh_is_grasped_from_above_like_one_given_as_a_box():
    block = _block(0.05, 0.06, 0.1)
    X_WO = SE3(np.eye(3), np.array([0.6, 0.1, 0.05 - reach(block, np.array([0.0, 0.0, 1.0]))]))
    for shape in (block, Box((0.05, 0.06, 0.1))):
        best = next(grasps(shape, X_WO, WSG50, np.zeros(3), np.random.default_rng(0)))
        assert best.X_OG.rotation[2, 2] < -0.95
        assert min(abs(best.width - 0.05), abs(best.width - 0.06)) < 1e-6


def test_grasps_come_from_above_tilted_and_from_the_side():
    approach = antipodal_grips(_block(0.05, 0.06, 0.1), WSG50).R[:, 2, 2]
    for low, high in ((-1.0, -0.95), (-0.8, -0.4), (-0.2, 0.2)):
        assert np.any((approach >= low - 1e-9) & (approach <= high))


def test_the_same_shape_always_has_the_same_grasps():
    first, again = antipodal_grips(_hull(3), WSG50), antipodal_grips(_hull(3), WSG50)
    np.testing.assert_array_equal(first.p, again.p)
    np.testing.assert_array_equal(first.R, again.R)
