"""Whether a thing can stand: exact overlaps, gaps beneath, centres beyond an edge."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from scenarios.shapes import Box, Cylinder, Sphere
from scenarios.solids import Solid, distance, overlap
from scenarios.standing import standing_problem

SLAB = Solid("slab", ((Box((1.0, 0.6, 0.1)), SE3(np.eye(3), np.array([0.0, 0.0, -0.05]))),))


def _yawed(x: float, y: float, z: float, yaw: float) -> SE3:
    c, s = np.cos(yaw), np.sin(yaw)
    return SE3(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]), np.array([x, y, z]))


@settings(derandomize=True, max_examples=100, deadline=None)
@given(x=st.floats(-0.7, 0.7), y=st.floats(-0.5, 0.5), yaw=st.floats(-4, 4), kind=st.sampled_from([0, 1]))
def test_on_a_slab_a_thing_stands_exactly_while_its_centre_lies_above_it(x, y, yaw, kind):
    assume(abs(abs(x) - 0.5) > 1e-3)
    assume(abs(abs(y) - 0.3) > 1e-3)
    shape = (Box((0.3, 0.1, 0.2)), Cylinder(0.08, 0.2))[kind]
    problem = standing_problem(Solid("thing", ((shape, _yawed(x, y, 0.1, yaw)),)), [SLAB])
    assert (problem is None) == (abs(x) < 0.5 and abs(y) < 0.3)


@pytest.mark.parametrize(
    ("gap", "expected"),
    [(0.0, None), (0.0019, None), (-0.00009, None), (0.003, "floats"), (-0.0002, "overlaps 'slab'")],
)
@pytest.mark.parametrize(
    "shape", [Box((0.1, 0.1, 0.1)), Cylinder(0.05, 0.1), Sphere(0.05)], ids=lambda s: type(s).__name__
)
def test_a_gap_of_two_millimetres_is_rest_and_a_tenth_of_one_no_overlap(shape, gap, expected):
    problem = standing_problem(Solid("thing", ((shape, _yawed(0, 0, 0.05 + gap, 0.3)),)), [SLAB])
    assert problem is None if expected is None else (problem or "").startswith(expected)


def test_a_plank_on_two_posts_stands_though_its_centre_lies_above_neither():
    posts = [Solid(f"post{i}", ((Box((0.05, 0.05, 0.1)), _yawed(x, 0, 0.05, 0)),)) for i, x in enumerate((-0.2, 0.2))]
    plank = Solid("plank", ((Box((0.5, 0.05, 0.02)), _yawed(0, 0, 0.11, 0)),))
    assert standing_problem(plank, [SLAB, *posts]) is None
    assert "beyond the edge of 'post0'" in (standing_problem(plank, [SLAB, posts[0]]) or "")


def test_what_leans_its_side_on_a_wall_but_has_nothing_beneath_floats():
    wall = Solid("wall", ((Box((0.1, 1.0, 1.0)), _yawed(0.15, 0, 0.5, 0)),))
    thing = Solid("thing", ((Box((0.2, 0.2, 0.2)), _yawed(0, 0, 0.5, 0)),))
    assert (standing_problem(thing, [SLAB, wall]) or "").startswith("floats")


spans = st.tuples(*[st.floats(-0.3, 0.3)] * 3)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(offset=spans, size=st.tuples(*[st.floats(0.02, 0.3)] * 3))
def test_boxes_side_by_side_overlap_exactly_when_all_their_spans_do(offset, size):
    depth = (np.array(size) + 0.1) / 2 - np.abs(offset)
    assume(np.abs(depth.min() - 1e-4) > 1e-5)
    a = Solid("a", ((Box((0.1, 0.1, 0.1)), SE3.Identity()),))
    b = Solid("b", ((Box(size), SE3(np.eye(3), np.array(offset))),))
    assert overlap(a, b) == (depth.min() > 1e-4) == overlap(b, a)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(offset=spans, radius=st.floats(0.01, 0.2))
def test_the_distance_of_spheres_is_that_of_their_centres_less_the_radii(offset, radius):
    assume(np.linalg.norm(offset) > 1e-3)
    placed = (Sphere(radius), SE3(np.eye(3), np.array(offset)))
    expected = np.linalg.norm(offset) - radius - 0.05
    assert distance((Sphere(0.05), SE3.Identity()), placed) == pytest.approx(expected, abs=1e-9)
