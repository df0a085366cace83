"""Strokes in the plane, and the covers made of them."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from scenarios.scenario import Region, Table
from skills.gathering import Place, bent_strokes, cover, fewest, strokes_for
from skills.strokes import CHORD, EDGE, Crumbs, Stroke, Tool, along, is_lost, left, opening_of, taken

TABLE = Table((0.44, 0.68, 0.05), SE3(np.eye(3), np.array([0.62, 0.06, 0.025])), 0.5)
PAN = Region("pan", "dustpan", (0.20, 0.15, 0.055), 0.01, SE3(np.eye(3), np.array([0.68, -0.355, -0.0075])), 0.5, "+y")
TOOL = Tool(width=0.09, depth=0.06, span=0.11)

headings = st.floats(-np.pi, np.pi)
lengths = st.floats(0.02, 0.3)
turns = st.sampled_from(np.radians([-90.0, -45.0, 30.0, 60.0, 90.0]).tolist())


def crumbs_at(*points: tuple[float, float], r: float = 0.005) -> Crumbs:
    names = tuple(f"c{i}" for i in range(len(points)))
    return Crumbs(names, np.array(points), np.full(len(points), r))


def place_with(crumbs: Crumbs) -> Place:
    opening = opening_of(PAN, TABLE)
    assert opening is not None
    return Place(TABLE, TOOL, opening, crumbs)


def stroke_at(stroke: Stroke, way: float) -> tuple[np.ndarray, float]:
    """The front's middle and its heading after so many metres, by pieces of the stroke."""
    arc = abs(stroke.turn) * stroke.radius
    if way <= stroke.first:
        return np.array(stroke.start) + way * along(stroke.heading), stroke.heading
    share = min(1.0, (way - stroke.first) / arc)
    part = Stroke(
        stroke.start,
        stroke.heading,
        max(0.0, way - stroke.first - arc),
        stroke.first,
        stroke.turn * share,
        stroke.radius,
    )
    return part.legs[3]


@settings(derandomize=True, max_examples=40, deadline=None)
@given(headings, lengths, lengths, turns, st.floats(0.06, 0.15), st.floats(0.0, 1.0), st.floats(-0.05, 0.05))
def test_what_the_front_meets_is_met_where_it_lies_on_the_front(heading, first, last, turn, radius, share, lateral):
    stroke = Stroke((0.5, 0.1), heading, last, first, turn, radius)
    course = stroke.course()
    front, at = course[round(share * (len(course) - 1))]
    point = front + lateral * left(at)
    when, where = stroke.met(point[None], 0.05 + 1e-9)
    assert np.isfinite(when[0])
    assert -1e-6 <= when[0] <= stroke.length + 1e-6
    met, heading = stroke_at(stroke, float(when[0]))
    assert np.allclose(met + where[0] * left(heading), point, atol=1e-6)


@settings(derandomize=True, max_examples=40, deadline=None)
@given(headings, lengths, lengths, turns, st.floats(0.06, 0.15))
def test_a_bent_course_turns_little_by_little_and_never_leaves_its_heading(heading, first, last, turn, radius):
    course = Stroke((0.5, 0.1), heading, last, first, turn, radius).course()
    for (p, before), (q, after) in pairwise(course):
        assert abs(after - before) <= CHORD + 1e-9
        way = (q - p) / np.linalg.norm(q - p)
        assert way @ along((before + after) / 2) == pytest.approx(1.0)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(headings, lengths, lengths, turns, st.floats(0.06, 0.15), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_what_is_left_of_a_stroke_ends_where_the_whole_one_does(heading, first, last, turn, radius, gone, share):
    stroke = Stroke((0.5, 0.1), heading, last, first, turn, radius)
    way = gone * stroke.length
    rest = stroke.after(way)
    assert rest.length == pytest.approx(stroke.length - way)
    front, _ = stroke_at(stroke, way + share * (stroke.length - way))
    met, _ = rest.met(front[None], 1e-6)
    assert met[0] == pytest.approx(share * (stroke.length - way), abs=1e-6)
    for whole, left_over in zip(stroke.legs[3], rest.legs[3], strict=True):
        assert np.allclose(whole, left_over)


def test_only_what_the_rest_of_a_stroke_can_no_longer_take_is_lost():
    opening = opening_of(PAN, TABLE)
    assert opening is not None
    rest = Stroke((0.68, 0.25), -np.pi / 2, 0.54).after(0.2)

    def lost(x: float, y: float) -> bool:
        return is_lost(rest, TOOL, opening, np.array([x, y]), 0.01)

    far_ahead, pushed, beneath, at_its_side, in_the_pan = (
        (0.64, -0.2),
        (0.69, 0.04),
        (0.68, 0.08),
        (0.74, 0.03),
        (0.7, -0.4),
    )
    assert not any(lost(*p) for p in (far_ahead, pushed, beneath, at_its_side, in_the_pan))
    behind, beside, ahead_beside, beside_the_pan = (0.68, 0.15), (0.78, 0.03), (0.58, -0.1), (0.5, -0.4)
    assert all(lost(*p) for p in (behind, beside, ahead_beside, beside_the_pan))


def test_what_lies_beside_a_stroke_now_is_not_lost_if_it_bends_that_way_later():
    opening = opening_of(PAN, TABLE)
    assert opening is not None
    bent = Stroke((0.5, -0.05), 0.0, 0.2, 0.1, -np.pi / 2, 0.08)
    point = np.array([0.68, -0.2])
    assert not is_lost(bent.after(0.05), TOOL, opening, point, 0.01)
    assert is_lost(Stroke((0.55, -0.05), 0.0, 0.25), TOOL, opening, point, 0.01)


def test_a_crumb_whose_way_leads_past_the_opening_is_not_taken():
    place = place_with(crumbs_at((0.68, 0.1), (0.80, 0.1)))
    ahead = Stroke((0.68, 0.15), -np.pi / 2, 0.44)
    beside = Stroke((0.80, 0.15), -np.pi / 2, 0.44)
    assert list(taken(ahead, TOOL, place.crumbs, place.opening)) == [True, False]
    assert not taken(beside, TOOL, place.crumbs, place.opening).any()


def test_a_crumb_at_the_sponges_very_edge_is_not_counted_on_but_expected():
    place = place_with(crumbs_at((0.68, 0.1), (0.68 + 0.043, 0.0)))
    stroke = Stroke((0.68, 0.15), -np.pi / 2, 0.44)
    assert list(place.taken(stroke)) == [True, False]
    assert list(place.taken(stroke, surely=False)) == [True, True]


def test_crumbs_in_a_row_before_the_opening_take_one_stroke():
    place = place_with(crumbs_at((0.66, 0.1), (0.68, 0.0), (0.70, -0.1), (0.67, 0.2)))
    (stroke,) = cover(place)
    assert place.taken(stroke).all()


def test_crumbs_wider_apart_than_the_sponge_take_as_many_strokes_as_there_are_widths():
    place = place_with(crumbs_at(*[(x, y) for x in (0.61, 0.74) for y in (0.0, 0.1, 0.15)]))
    strokes = cover(place)
    assert len(strokes) == 2
    assert np.any([place.taken(stroke) for stroke in strokes], axis=0).all()


@pytest.mark.parametrize("seed", range(3))
def test_sixty_grains_on_thirty_centimetres_take_few_strokes_and_none_begins_on_a_grain(seed):
    rng = np.random.default_rng(seed)
    grains = crumbs_at(*rng.uniform((0.48, -0.1), (0.78, 0.2), (60, 2)))
    place = place_with(grains)
    strokes = cover(place)
    assert len(strokes) <= 8
    assert np.any([place.taken(stroke) for stroke in strokes], axis=0).all()
    assert not any(place.comes_down_on(stroke) for stroke in strokes)
    ways = [float(stroke.legs[3][0] @ place.opening.across) for stroke in strokes]
    assert ways == sorted(ways)


def test_every_stroke_for_a_crumb_most_likely_takes_it():
    place = place_with(crumbs_at((0.55, 0.05), (0.66, 0.1), (0.6, -0.2)))
    for k, name in enumerate(place.crumbs.names):
        found = list(strokes_for(place, name))
        assert found
        assert all(place.taken(stroke, surely=False)[k] for stroke in found)


def test_beside_a_wall_the_sponges_very_end_gets_behind_a_crumb():
    crumbs = crumbs_at((0.66, 0.1))
    place = place_with(crumbs)
    room = place.tool.width / 2 - float(crumbs.r[0]) - EDGE
    offsets = [float(place.crumbs_met(stroke)[1][0]) for stroke in strokes_for(place, "c0") if not stroke.turn]
    assert min(offsets) == pytest.approx(-room, abs=1e-6)
    assert max(offsets) == pytest.approx(room, abs=1e-6)


def test_a_crumb_off_to_the_side_is_taken_round_a_bend():
    place = place_with(crumbs_at((0.48, -0.22)))
    found = list(strokes_for(place, "c0"))
    assert found
    assert all(stroke.turn for stroke in found)
    assert found[0] in list(bent_strokes(place, 0))


def test_a_dustpan_with_a_rim_above_the_table_has_no_opening():
    high = Region("pan", "dustpan", PAN.size, 0.01, SE3(np.eye(3), np.array([0.68, -0.2, 0.08])), 0.5, "+y")
    assert opening_of(high, TABLE) is None


def test_a_region_without_an_open_side_is_an_error():
    closed = Region("bin", "bin", PAN.size, 0.01, PAN.X_WR, 0.5)
    with pytest.raises(ValueError, match="no open side"):
        opening_of(closed, TABLE)


@settings(derandomize=True, max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 7), st.integers(1, 6))
def test_no_fewer_rows_than_the_fewest_hold_every_column(seed, rows, columns):
    rng = np.random.default_rng(seed)
    masks, costs = rng.random((rows, columns)) < 0.4, rng.random(rows)
    chosen = fewest(masks, costs)
    wanted = masks.any(axis=0)
    assert np.array_equal(masks[chosen].any(axis=0) if chosen else np.zeros(columns, bool), wanted)
    covers = [
        set_
        for n in range(rows + 1)
        for set_ in combinations(range(rows), n)
        if (masks[list(set_)].any(axis=0) == wanted).all()
    ]
    best = min(covers, key=lambda rows: (len(rows), costs[list(rows)].sum()))
    assert len(chosen) == len(best)
    assert costs[chosen].sum() == pytest.approx(costs[list(best)].sum())
