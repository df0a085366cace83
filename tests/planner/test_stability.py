"""Bodies are put down only on sides on which they stay, on places that are flat, and where there is room."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from planner.packing import clear_first
from planner.placements import Surface, placements, top_of
from planner.stability import level_top, rests
from scenarios.scenario import Body
from scenarios.shapes import Box, Compound, Cylinder, Hull, Shape, Sphere, outline, reach
from scenarios.solids import body_solid, overlap

FLOOR = Surface(SE3.Identity(), np.array([0.17, 0.17]), 0.12)
OPEN = Surface(SE3.Identity(), np.array([0.17, 0.17]), 0.0)
FROM_ABOVE = SE3(pin.rpy.rpyToMatrix(np.pi, 0.0, 0.0), np.array([0.0, 0.0, 0.3]))
HELD = (FROM_ABOVE, FROM_ABOVE.inverse() * SE3(np.eye(3), FROM_ABOVE.translation))


def _pyramid(height: float) -> Hull:
    corners = [[x, y, 0.0] for x in (-0.04, 0.04) for y in (-0.04, 0.04)]
    return Hull.of(np.array([*corners, [0.0, 0.0, height]]))[0]


def _leaning() -> Hull:
    """A prism that leans over so far that its centre lies beyond its base."""
    base = np.array([[x, y, 0.0] for x in (0.0, 0.04) for y in (0.0, 0.04)])
    return Hull.of(np.concatenate([base, base + np.array([0.09, 0.0, 0.06])]))[0]


def _cup() -> Compound:
    walls = []
    for angle in np.arange(12) * np.pi / 6:
        R = pin.rpy.rpyToMatrix(0.0, 0.0, angle)
        walls.append((Box((0.006, 0.022, 0.09)), SE3(R, R @ np.array([0.037, 0.0, 0.045]))))
    return Compound.of([(Cylinder(0.035, 0.008), SE3(np.eye(3), np.array([0.0, 0.0, 0.004]))), *walls])[0]


def _downs(shape: Shape) -> list[np.ndarray]:
    return [np.array(rest.down) for rest in rests(shape) if rest.is_firm]


def test_a_leaning_prism_does_not_stand_on_its_base():
    shape = _leaning()
    down = np.array([0.0, 0.0, -1.0])
    assert not any(np.allclose(d, down) for d in _downs(shape))
    assert _downs(shape)


def test_a_pyramid_stands_on_its_base_and_a_spire_not_on_its_side_edges():
    assert any(np.allclose(d, [0, 0, -1]) for d in _downs(_pyramid(0.05)))
    assert len(_downs(_pyramid(0.6))) == 4  # the four long sides, no longer the base


def test_a_cup_stands_upright_and_upside_down_but_on_no_stave():
    found = np.array(_downs(_cup()))
    assert np.allclose(sorted(found[:, 2]), [-1.0, 1.0])


@settings(derandomize=True, max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_every_hull_has_a_side_on_which_it_stands_still(seed):
    # On that side the centre of mass is as low as on any other: there is no way down.
    rng = np.random.default_rng(seed)
    shape = Hull.of(rng.normal(size=(rng.integers(4, 30), 3)) * rng.uniform(0.02, 0.1, 3))[0]
    lowest = min(rests(shape), key=lambda rest: reach(shape, np.array(rest.down)))
    assert reach(shape, np.array(lowest.down)) == pytest.approx(outline(shape).offsets.min())


def test_nothing_is_put_on_top_of_a_ball_a_lying_cylinder_a_cup_or_a_pyramid():
    lying = SE3(pin.rpy.rpyToMatrix(np.pi / 2, 0.0, 0.0), np.zeros(3))
    assert top_of(Sphere(0.04), SE3.Identity()) is None
    for shape, X_WO in ((Cylinder(0.04, 0.1), lying), (_cup(), SE3.Identity())):
        top = level_top(shape, X_WO)
        assert top is None or top[2] < 0.01
    assert top_of(_pyramid(0.05), SE3.Identity()) is None


def test_the_place_on_top_of_a_cylinder_lies_within_its_rim():
    top = top_of(Cylinder(0.04, 0.1), SE3(np.eye(3), np.array([0.3, 0.2, 0.05])))
    assert top is not None
    np.testing.assert_allclose(top.X_WS.translation, [0.3, 0.2, 0.1])
    assert 0.025 < np.linalg.norm(top.half) / np.sqrt(2) <= 0.04 / np.sqrt(2)


@pytest.mark.parametrize("shape", [_pyramid(0.05), _cup(), _leaning(), Box((0.05, 0.06, 0.1)), Cylinder(0.04, 0.1)])
@pytest.mark.parametrize("surface", [FLOOR, OPEN])
def test_placements_lie_on_the_surface_and_within_its_walls(shape, surface):
    found = list(placements(shape, HELD, surface, np.random.default_rng(0)))
    assert found
    for placement in found[::7]:
        for X, gap in ((placement.X_WO, 0.01), (placement.X_WO_rest, 0.0)):
            assert -reach(shape, -X.rotation[2]) + X.translation[2] == pytest.approx(gap, abs=1e-6)
            sides = [X.translation[i] * s + reach(shape, s * X.rotation[i]) for i in range(2) for s in (1.0, -1.0)]
            assert max(sides) <= 0.17 + 1e-6


def test_a_ball_is_put_into_a_bin_but_not_onto_an_open_table():
    rng = np.random.default_rng(0)
    assert next(placements(Sphere(0.03), HELD, FLOOR, rng), None) is not None
    assert next(placements(Sphere(0.03), HELD, OPEN, rng), None) is None


def anywhere(placement):
    """Nothing speaks against any placement."""
    return True


def test_placements_that_something_speaks_against_come_last():
    body = Body("it", _cup(), 0.1, 0.5, (1.0, 1.0, 1.0, 1.0), SE3.Identity())
    drawn = list(placements(body.shape, HELD, FLOOR, np.random.default_rng(0)))
    left = [sample for sample in drawn if sample.rest[1] < 0.0]
    found = list(clear_first(drawn, body, [], lambda sample: sample.rest[1] < 0.0))
    assert 0 < len(left) < len(drawn)
    assert found[: len(left)] == left
    assert set(found) == set(drawn)


def test_a_bin_is_packed_one_beside_the_other_without_overlap():
    rng = np.random.default_rng(3)
    packed = []
    for k, shape in enumerate([Box((0.1, 0.08, 0.06)), _cup(), _pyramid(0.05), Cylinder(0.04, 0.1), _leaning()]):
        body = Body(f"it{k}", shape, 0.1, 0.5, (1.0, 1.0, 1.0, 1.0), SE3.Identity())
        placement = next(clear_first(placements(shape, HELD, FLOOR, rng), body, packed, anywhere))
        packed.append(body_solid(body, placement.X_WO_rest))
    assert not any(overlap(a, b, 0.002) for i, a in enumerate(packed) for b in packed[:i])


def test_where_there_is_no_room_placements_still_come_to_name_what_is_in_the_way():
    full = Body("full", Box((0.34, 0.34, 0.1)), 0.1, 0.5, (1.0, 1.0, 1.0, 1.0), SE3(np.eye(3), np.array([0, 0, 0.05])))
    body = Body("it", _cup(), 0.1, 0.5, (1.0, 1.0, 1.0, 1.0), SE3.Identity())
    drawn = list(placements(body.shape, HELD, FLOOR, np.random.default_rng(0)))
    assert list(clear_first(drawn, body, [body_solid(full)], anywhere)) == drawn
