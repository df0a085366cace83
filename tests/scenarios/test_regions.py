"""Bins and dustpans: what is solid lies outside what is inside, and both fill the outer box."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from scenarios.regions import OUTWARD, interior, parts, ramp_length
from scenarios.scenario import Region
from scenarios.shapes import Sphere
from scenarios.solids import distance

sizes = st.tuples(*[st.floats(0.15, 0.5)] * 2, st.floats(0.03, 0.2))


def _region(size, side, ramp=None) -> Region:
    kind = "bin" if side is None else "dustpan"
    return Region("it", kind, size, 0.01, SE3.Identity(), 0.5, open_side=side, ramp_deg=ramp)


@settings(derandomize=True, max_examples=100, deadline=None)
@given(size=sizes, side=st.sampled_from([None, *OUTWARD]), at=st.tuples(*[st.floats(0, 1)] * 3))
def test_every_point_of_the_outer_box_is_either_solid_or_inside(size, side, at):
    region = _region(size, side)
    lower, upper = interior(region)
    p = (np.array(at) - 0.5) * size
    depth = np.minimum(p - lower, upper - p).min()
    assume(abs(depth) > 1e-5)
    nearest = min(distance((Sphere(1e-6), SE3(np.eye(3), p)), part) for part in parts(region))
    assert (depth > 0) == (nearest > 0)


@settings(derandomize=True, max_examples=40, deadline=None)
@given(
    size=sizes,
    side=st.sampled_from([None, *OUTWARD]),
    at=st.tuples(*[st.floats(0, 1)] * 3),
    ramp=st.none() | st.floats(8, 40),
)
def test_no_point_inside_lies_in_anything_solid(size, side, at, ramp):
    region = _region(size, side, ramp if side else None)
    lower, upper = interior(region)
    point = (Sphere(1e-6), SE3(np.eye(3), lower + np.array(at) * (upper - lower)))
    assert all(distance(point, part) > -1e-4 for part in parts(region))


@settings(derandomize=True, max_examples=40, deadline=None)
@given(size=sizes, side=st.sampled_from(sorted(OUTWARD)), ramp=st.floats(8, 40))
def test_a_ramp_climbs_from_the_bottom_edge_of_the_open_side_to_the_floor(size, side, ramp):
    region = _region(size, side, ramp)
    half, out = np.array(size) / 2, OUTWARD[side]
    plate, X_RP = parts(region)[0]
    top = X_RP.translation + X_RP.rotation[:, 2] * plate.size[2] / 2
    foot = top - X_RP.rotation[:, 0] * plate.size[0] / 2
    head = top + X_RP.rotation[:, 0] * plate.size[0] / 2
    np.testing.assert_allclose(foot @ np.abs(out), np.sum(out) * half @ np.abs(out), atol=1e-9)
    np.testing.assert_allclose([foot[2], head[2]], [-half[2], -half[2] + region.wall], atol=1e-9)
    np.testing.assert_allclose((foot - head) @ out, ramp_length(region), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(X_RP.rotation), 1.0)
