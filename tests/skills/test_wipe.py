"""Wipe, carried out in PyBullet."""

from dataclasses import replace

import numpy as np
import pytest
from bench import Bench, action, scene_with, with_pose
from pinocchio import SE3
from py_trees.common import Status

from bt_tamp.executive.loop import run_scenario
from bt_tamp.options import RunOptions
from bt_tamp.report.events import Event
from bt_tamp.report.recorder import RunRecorder
from planner.failure import EffectMissing, RefinementFailure
from planner.refinement import Budget, Hints, Refinement
from planner.task.facts import place_of
from scenarios.scenario import Body, Fixture, Region, Scenario
from scenarios.shapes import Box
from skills.pressing import Pressing
from skills.skill import ContactSettings
from skills.wipe import pressings

TOP = 0.05


def with_body(scenario: Scenario, name: str, **changes) -> Scenario:
    body: Body = replace(scenario.bodies[name], **changes)
    return replace(scenario, bodies={**scenario.bodies, name: body})


def standing(size: tuple[float, float, float], x: float, y: float) -> SE3:
    """Where something of that size stands on the table."""
    return SE3(np.eye(3), np.array([x, y, TOP + size[2] / 2]))


@pytest.mark.parametrize(("contact", "x", "y"), [("hybrid", 0.73, 0.055), ("impedance", 0.66, 0.1)])
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


def test_a_crumb_that_every_straight_way_would_push_into_a_post_goes_round_a_bend():
    size = (0.04, 0.04, 0.06)
    post = Fixture("post", Box(size), standing(size, 0.6, -0.14), 0.5, (0.0, 0.0, 0.0, 1.0))
    scene = replace(scene_with("carrot", "sponge"), fixtures={"post": post})
    bench = Bench(with_pose(scene, "carrot", 0.54, 0.02))
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    found = bench.refine(action("wipe(carrot, table, dustpan)"))
    assert isinstance(found, Refinement)
    assert found.sample.stroke.turn != 0.0
    assert bench.do("wipe(carrot, table, dustpan)") is Status.SUCCESS
    assert place_of(bench.scene, "carrot") == "dustpan"
    steady = np.array(bench.forces["stroke"][250:])
    assert np.sqrt(np.mean((steady - 10.0) ** 2)) < 0.5


def test_the_force_is_kept_up_a_ramp_into_a_dustpan_on_the_table():
    size = (0.26, 0.18, 0.05)
    pan = Region("dustpan", "dustpan", size, 0.01, standing(size, 0.62, -0.16), 0.5, open_side="+y", ramp_deg=8.0)
    scene = replace(scene_with("carrot", "tomato", "sponge"), regions={"dustpan": pan})
    scene = with_pose(with_pose(scene, "carrot", 0.62, 0.12), "tomato", 0.65, 0.15)
    bench = Bench(with_body(scene, "sponge", X_WO=standing((0.09, 0.06, 0.04), 0.6, 0.32)))
    assert bench.do("pick(sponge, table)") is Status.SUCCESS
    assert bench.do("wipe(carrot, table, dustpan)") is Status.SUCCESS
    assert place_of(bench.scene, "carrot") == place_of(bench.scene, "tomato") == "dustpan"
    steady = np.array(bench.forces["stroke"][150:])
    assert abs(steady.mean() - 10.0) < 0.3
    assert np.sqrt(np.mean((steady - 10.0) ** 2)) < 1.0
    assert steady.min() > 5.0
    assert steady.max() < 20.0


def test_what_was_missed_is_wiped_again():
    bench = Bench(with_pose(scene_with("carrot", "sponge"), "carrot", 0.66, 0.0))
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    X_WO = SE3(np.eye(3), bench.scene.poses["carrot"].translation + np.array([0.0, 0.15, 0.0]))
    run = bench.run

    def put_behind(ticks: int) -> None:
        run(ticks)
        if bench.context.phase is not None and bench.context.phase.name == "retract":
            bench.plant.put("carrot", X_WO)
            bench.run = run

    bench.run = put_behind
    assert bench.do("wipe(carrot, table, dustpan)") is Status.FAILURE
    assert isinstance(bench.context.failure, EffectMissing)
    assert bench.context.failure.reason.endswith("it is on the table")
    bench.context.failure = None
    assert bench.do("wipe(carrot, table, dustpan)") is Status.SUCCESS
    assert place_of(bench.scene, "carrot") == "dustpan"


def test_what_pressed_well_on_a_crumb_is_tried_first_and_what_failed_last():
    bench = Bench(with_pose(scene_with("carrot", "sponge"), "carrot", 0.66, 0.0))
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    what = action("wipe(carrot, table, dustpan)")

    def pressing_with(**known) -> Pressing:
        found = bench.skills["wipe"].refine(what, bench.scene, np.random.default_rng(0), Budget(), Hints(**known))
        assert isinstance(found, Refinement)
        assert found.phases[-2].press is not None
        assert found.phases[-2].press.force == found.sample.pressing.force
        return found.sample.pressing

    usual, lighter, *_ = pressings(ContactSettings(), hold=20.0)
    first = bench.refine(what)
    assert isinstance(first, Refinement)
    assert first.sample.pressing == usual
    assert pressing_with(failed=(first.sample,)) == lighter
    assert pressing_with(done=(replace(first.sample, pressing=lighter),)) == lighter


def test_no_set_presses_much_harder_than_the_grip_on_the_sponge_bears():
    assert max(set_.force for set_ in pressings(ContactSettings(force=10.0), hold=20.0)) <= 12.0
    assert max(set_.force for set_ in pressings(ContactSettings(force=10.0), hold=100.0)) == 20.0


class Story(RunRecorder):
    """Remembers a run's events."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.events: list[Event] = []
        self.pressed: list[float] = []

    def event(self, kind, t, **data) -> None:
        self.events.append(Event(kind, t, data))

    def sample(self, observation, reference, force) -> None:
        if reference.force and (not self.pressed or self.pressed[-1] != reference.force):
            self.pressed.append(reference.force)


def test_where_the_usual_set_leaves_a_grain_on_a_sticky_table_a_lighter_one_does_not():
    """Without force control the arm pulls the sponge by a spring: friction holds it back by more than a grain."""
    size = (0.008, 0.008, 0.008)
    scene = scene_with("carrot", "sponge")
    scene = with_body(scene, "carrot", shape=Box(size), mass=0.001, X_WO=standing(size, 0.68, 0.1))
    scene = with_body(scene, "sponge", friction=1.0)
    sticky = replace(scene, table=replace(scene.table, friction=2.2), goal="(and (in_bin carrot dustpan))")
    story = Story(sticky)
    result = run_scenario(sticky, RunOptions(contact="impedance", max_sim_time=60.0), story)
    assert result.outcome == "goal_reached"
    assert story.pressed == [10.0, 5.0]
    assert [event.data["action"] for event in story.events if event.kind == "action_failed"] == [
        "wipe(carrot, table, dustpan)"
    ]
