"""Wipe, carried out in PyBullet."""

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
