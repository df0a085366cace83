"""Wipe and drag, carried out in PyBullet."""

import numpy as np
import pytest
from bench import Bench, action, scene_with, with_pose
from py_trees.common import Status

from planner.failure import RefinementFailure
from planner.task.facts import place_of


@pytest.mark.parametrize(
    ("contact", "x", "y"), [("hybrid", 0.73, 0.055), ("hybrid", 0.6, 0.15), ("impedance", 0.66, 0.1)]
)
def test_a_crumb_is_wiped_into_the_dustpan(contact, x, y):
    bench = Bench(with_pose(scene_with("carrot", "sponge"), "carrot", x, y), contact)
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    assert bench.do("wipe(carrot, table, dustpan)") is Status.SUCCESS
    assert place_of(bench.scene, "carrot") == "dustpan"
    assert bench.peak_force < 30.0
    if contact == "hybrid":
        steady = np.array(bench.forces["stroke"][250:])
        assert abs(steady.mean() - 10.0) < 0.5


def test_crumbs_in_a_strokes_way_are_no_culprits_and_come_along():
    scenario = with_pose(scene_with("carrot", "tomato", "sponge"), "tomato", 0.735, -0.02)
    bench = Bench(scenario)
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    found = bench.refine(action("wipe(carrot, table, dustpan)"))
    assert not isinstance(found, RefinementFailure)
    after = bench.skills["wipe"].predict(bench.scene, found)
    assert place_of(after, "carrot") == place_of(after, "tomato") == "dustpan"


def test_what_stands_between_crumb_and_pan_is_named_as_culprit():
    bench = Bench(scene_with("carrot", "box", "sponge"))
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    failure = bench.refine(action("wipe(carrot, table, dustpan)"))
    assert isinstance(failure, RefinementFailure)
    assert frozenset({"box"}) in failure.culprit_sets


@pytest.mark.parametrize(("x", "y", "yaw"), [(0.58, 0.21, 0.0), (0.6, 0.18, 0.15)])
def test_a_flat_book_is_dragged_to_an_overhang_and_can_then_be_picked(x, y, yaw):
    bench = Bench(with_pose(scene_with("book"), "book", x, y, yaw))
    assert bench.do("drag(book, table)") is Status.SUCCESS
    assert place_of(bench.scene, "book") == "table"
    assert bench.do("pick(book, table)") is Status.SUCCESS
    assert bench.do("place(book, right_bin)") is Status.SUCCESS
    assert place_of(bench.scene, "book") == "right_bin"


def test_a_drag_that_finds_no_friction_is_refused():
    from dataclasses import replace

    scenario = scene_with("book")
    slippery = replace(scenario, table=replace(scenario.table, friction=1.3))
    failure = Bench(slippery).refine(action("drag(book, table)"))
    assert isinstance(failure, RefinementFailure)
    assert "friction" in failure.reason
