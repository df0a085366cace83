"""Every shape lies about its centre of volume, and says truly how far it reaches and how it resists turning."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from scenarios.hulls import ShapeError, polyhedron
from scenarios.shapes import (
    Box,
    Compound,
    Cylinder,
    Hull,
    Shape,
    Sphere,
    bounding_radius,
    bounds,
    convex_parts,
    distance_to,
    extents,
    inertia,
    inscribed_radius,
    middle,
    outline,
    reach,
    volume,
)

CUBE = np.array([[x, y, z] for x in (0.0, 0.1) for y in (0.0, 0.2) for z in (0.0, 0.3)])


def _at(x: float, y: float, z: float, yaw: float = 0.0) -> SE3:
    return SE3(pin.rpy.rpyToMatrix(0.0, 0.0, yaw), np.array([x, y, z]))


def _mug() -> Compound:
    walls = [(Box((0.08, 0.01, 0.1)), _at(0, s * 0.035, 0.05)) for s in (-1, 1)]
    walls += [(Box((0.01, 0.06, 0.1)), _at(s * 0.035, 0, 0.05)) for s in (-1, 1)]
    handle = [(Cylinder(0.006, 0.03), _at(0.06, 0.0, 0.05)), (Sphere(0.008), _at(0.07, 0.0, 0.08))]
    return Compound.of([*walls, *handle])[0]


def _shapes() -> list[Shape]:
    hull = Hull.of(np.random.default_rng(4).normal(size=(20, 3)) * [0.05, 0.03, 0.02])[0]
    return [Box((0.1, 0.2, 0.3)), Cylinder(0.05, 0.2), Sphere(0.07), hull, _mug()]


def test_a_hull_of_a_cubes_corners_is_that_cube():
    hull, centre = Hull.of(CUBE)
    box = Box((0.1, 0.2, 0.3))
    np.testing.assert_allclose(centre, [0.05, 0.1, 0.15])
    np.testing.assert_allclose(extents(hull), extents(box))
    np.testing.assert_allclose(inertia(hull, 2.0), inertia(box, 2.0), atol=1e-12)
    assert volume(hull) == pytest.approx(volume(box))
    assert bounding_radius(hull) == pytest.approx(bounding_radius(box))
    assert len(hull.solid.normals) == 6


def test_a_box_cut_in_two_weighs_and_turns_like_the_whole():
    halves = Compound.of([(Box((0.1, 0.2, 0.1)), _at(0, 0, 0)), (Box((0.2, 0.1, 0.2)), _at(0, 0, 0.15, np.pi / 2))])[0]
    whole = Box((0.1, 0.2, 0.3))
    np.testing.assert_allclose(inertia(halves, 1.5), inertia(whole, 1.5), atol=1e-12)
    assert volume(halves) == pytest.approx(volume(whole))
    np.testing.assert_allclose(bounds(halves), bounds(whole), atol=1e-9)


def test_a_mugs_origin_is_its_centre_of_volume_not_the_middle_of_its_box():
    mug = _mug()
    weights = [volume(part) for part, _ in convex_parts(mug)]
    np.testing.assert_allclose(np.array(weights) @ [X.translation for _, X in convex_parts(mug)], 0.0, atol=1e-9)
    assert middle(mug)[0] > 0.015


@settings(derandomize=True, max_examples=40, deadline=None)
@given(st.integers(0, 4), st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1))
def test_nothing_reaches_beyond_the_box_the_sphere_and_the_outline(kind, direction):
    shape, d = _shapes()[kind], np.array(direction) / np.linalg.norm(direction)
    lower, upper = bounds(shape)
    assert -reach(shape, -d) <= reach(shape, d) <= bounding_radius(shape) + 1e-9
    assert reach(shape, d) <= np.maximum(lower * d, upper * d).sum() + 1e-9
    farthest = (outline(shape).vertices @ d).max()
    assert 0.95 * reach(shape, d) <= farthest + 1e-9 <= reach(shape, d) + 2e-9


def test_shapes_are_equal_by_what_they_are_and_can_be_keys():
    first, second = Hull.of(CUBE)[0], Hull.of(CUBE + 1.0)[0]
    assert first == second
    assert len({first, second, _mug(), _mug()}) == 2


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (CUBE * [1, 1, 0], "within 0 mm of a plane"),
        (CUBE[:3], "3 points span no solid"),
        (CUBE * np.nan, "not finite"),
    ],
)
def test_points_that_span_nothing_are_refused(points, words):
    with pytest.raises(ShapeError, match=words):
        polyhedron(points)


def test_a_hull_with_too_many_vertices_is_refused():
    ball = np.random.default_rng(0).normal(size=(400, 3))
    with pytest.raises(ShapeError, match="400 vertices, expected at most 256"):
        Hull.of(ball / np.linalg.norm(ball, axis=1)[:, None])


def test_a_shape_about_another_origin_is_refused():
    with pytest.raises(ShapeError, match="from the origin"):
        Hull(tuple(map(tuple, CUBE)))
    with pytest.raises(ShapeError, match="1 to 64"):
        Compound(())


@pytest.mark.parametrize("shape", _shapes())
def test_the_inscribed_ball_lies_inside_the_shape(shape):
    radius = inscribed_radius(shape)
    directions = np.random.default_rng(1).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    assert radius <= min(reach(shape, d) for d in directions)
    solids = [(outline(part), X_OP) for part, X_OP in convex_parts(shape)]
    # Outlines of what is round are cut flat.
    points = 0.95 * radius * directions
    assert radius == 0.0 or all(any(solid.outside(X_OP.actInv(p)) < 0.0 for solid, X_OP in solids) for p in points)


def test_a_mugs_hollow_has_no_inscribed_ball_and_a_hulls_is_that_of_its_nearest_face():
    assert inscribed_radius(_mug()) == 0.0
    assert inscribed_radius(Hull.of(CUBE)[0]) == pytest.approx(0.05)
    assert inscribed_radius(Compound.of([(Box((0.1, 0.2, 0.3)), _at(0, 0, 0))])[0]) == pytest.approx(0.05)


@pytest.mark.parametrize("shape", [Box((0.1, 0.06, 0.04)), Cylinder(0.03, 0.1), Sphere(0.04), Hull.of(CUBE)[0], _mug()])
@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_the_distance_to_a_shape_is_none_inside_and_at_most_that_to_any_point_of_it(shape, seed):
    rng = np.random.default_rng(seed)
    lower, upper = bounds(shape)
    p_O = rng.uniform(lower - 0.1, upper + 0.1)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    # The shape lies on the near side of its tangent plane, so that a point beyond it is at least as far.
    beyond = float(direction @ p_O) - reach(shape, direction)
    if isinstance(shape, Box | Cylinder | Sphere):
        assert distance_to(shape, p_O) >= beyond - 1e-9
    assert distance_to(shape, p_O) <= np.linalg.norm(p_O - middle(shape)) + 1e-9
    assert distance_to(shape, middle(shape)) == 0.0
