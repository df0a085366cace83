"""What a class draws can be dealt with, as it declares."""

from dataclasses import replace

import numpy as np
import pytest
from pinocchio import SE3

from bt_tamp.disturb import driver
from bt_tamp.disturb.classes import KINDS, Kind, Prospect, amended
from bt_tamp.disturb.consequence import Trial
from bt_tamp.disturb.deed import Deed, Later, Occasion
from bt_tamp.disturb.driver import Driver
from bt_tamp.disturb.world import (
    brought_back,
    crumbs_beside_pan,
    goal_changed,
    knocked_from_hand,
    moved,
    path_blocked,
    rotated,
)
from bt_tamp.executive.build import build
from bt_tamp.options import RunOptions
from planner.motion.collision import part_names
from planner.motion.motion_planner import MotionPlanner
from planner.motion.trajectory import Trajectory
from planner.motion.world import obstacles
from planner.refinement import Phase, pairs
from planner.task.facts import goal_facts
from planner.task.symbols import Fact, GroundAction
from scenarios.document import parse_document
from scenarios.generate import generate
from scenarios.library import scenario_path
from scenarios.load import build_scenario, load_scenario
from scenarios.scenario import Fixture
from scenarios.shapes import Box
from sim.scene import Held
from skills.gathering import Place, strokes_for
from skills.strokes import Crumbs, Tool, opening_of

SPONGE = Tool(width=0.09, depth=0.06, span=0.11)


def _scenes():
    yield load_scenario("fig1")
    yield load_scenario("fig1_wipe")
    for seed, objects in ((27, 4), (31, 8)):
        yield build_scenario(parse_document(generate(seed, objects), "generated"))


@pytest.mark.parametrize("draw", [crumbs_beside_pan, moved])
def test_a_crumb_is_put_where_a_stroke_can_take_it(draw):
    found = 0
    for scenario in _scenes():
        machine = build(scenario, RunOptions(), lambda kind, **data: None, lambda why: None)
        rng = np.random.default_rng(0)
        pans = [region for region in scenario.regions.values() if region.kind == "dustpan"]
        for _ in range(20):
            now = Occasion(0.0, machine.plant.observe(), machine, MotionPlanner(machine.robot), rng)
            deed = draw(now)
            if deed is None or not now.is_crumb(deed.names[0]):
                continue
            (fault,), (name,) = deed.faults, deed.names
            crumbs = Crumbs((name,), fault.X_WO.translation[None, :2], np.array([0.016]))
            places = [Place(scenario.table, SPONGE, opening_of(pan, scenario.table), crumbs) for pan in pans]
            assert any(True for place in places for _ in strokes_for(place, name)), fault.X_WO.translation
            found += 1
        machine.plant.close()
    assert found >= 10


def action(text):
    """`pick(cup, table)` as an action."""
    name, args = text.rstrip(")").split("(")
    return GroundAction(name, tuple(args.split(", ")))


@pytest.mark.parametrize(
    ("name", "left", "may_come"),
    [
        ("rotated", ("wipe(carrot, table)", "pick(box, table)"), True),
        ("rotated", ("pick(box, table)", "place(box, right_bin)"), True),
        ("rotated", ("wipe(carrot, table)", "wipe(tomato, table)"), False),
        ("rotated", ("pick(sponge, dustpan)", "wipe(carrot, table)"), False),
        ("toppled", ("pick(book, table)", "place(book, right_bin)", "pick(box, table)"), True),
        ("toppled", ("pick(book, table)", "place(book, right_bin)", "pick(sponge, dustpan)"), False),
        ("sponge-far", ("pick(book, table)", "pick(sponge, dustpan)"), True),
        ("sponge-far", ("pick(book, table)", "place(book, right_bin)"), False),
        ("moved", ("pick(sponge, dustpan)", "wipe(carrot, table)"), True),
        ("moved", ("pick(sponge, dustpan)", "place(sponge, left_bin)"), False),
        ("pose-delay", ("pick(sponge, dustpan)", "wipe(carrot, table)"), True),
        ("pose-missing", ("pick(sponge, dustpan)", "place(sponge, left_bin)"), False),
        ("taken-and-returned", ("pick(sponge, dustpan)", "place(sponge, left_bin)"), False),
        ("bin-shifted", ("wipe(carrot, table, dustpan)", "place(sponge, left_bin)"), True),
        ("bin-shifted", ("wipe(carrot, table, dustpan)", "place(sponge, table)"), False),
    ],
)
def test_a_class_waits_for_no_phase_after_which_there_is_nothing_for_it_to_do(name, left, may_come):
    scenario = load_scenario("fig1")
    actions = tuple(map(action, left))
    still = Phase("go", "move", Trajectory.standstill(np.zeros(7)), 0.1)
    assert KINDS[name].fits(Prospect(still, actions, scenario, goal_facts(scenario.goal))) is may_come


@pytest.mark.parametrize(
    ("phase", "kind", "held", "left", "may_come"),
    [
        ("lift", "approach", "box", ("pick(box, table)", "place(box, table)"), False),
        ("pre-wipe", "move", "sponge", ("wipe(carrot, table)", "place(sponge, table)"), True),
        ("stroke", "slide", "sponge", ("wipe(carrot, table)", "place(sponge, table)"), False),
        ("retreat", "approach", None, ("place(box, table)", "place(sponge, left_bin)"), False),
    ],
)
def test_what_is_in_the_hand_or_already_dealt_with_is_not_there_to_be_moved(phase, kind, held, left, may_come):
    scenario = load_scenario("fig1")
    grip = None if held is None else Held(held, SE3.Identity())
    now = Phase(phase, kind, Trajectory.standstill(np.zeros(7)), 0.1, grip)
    prospect = Prospect(now, tuple(map(action, left)), scenario, goal_facts(scenario.goal))
    assert KINDS["moved"].fits(prospect) is may_come


def test_what_the_fingers_are_about_to_close_on_is_not_to_come():
    scenario = load_scenario("fig1")
    closing = Phase("close", "close", Trajectory.standstill(np.zeros(7)), 0.1)
    prospect = Prospect(closing, (GroundAction("pick", ("box", "table")),), scenario, goal_facts(scenario.goal))
    assert not KINDS["rotated"].fits(prospect)


@pytest.mark.parametrize(
    ("goal", "left", "may_come"),
    [
        ("(in_bin sponge left_bin)", ("place(box, right_bin)",), True),
        ("(in_bin box right_bin)", ("place(box, right_bin)", "wipe(carrot, table)"), True),
        ("(in_bin box right_bin)", ("wipe(carrot, table)", "place(sponge, left_bin)"), False),
    ],
)
def test_a_sponge_is_thrown_away_for_good_only_while_something_needs_it(goal, left, may_come):
    scenario = load_scenario("fig1")
    still = Phase("go", "move", Trajectory.standstill(np.zeros(7)), 0.1)
    prospect = Prospect(still, tuple(map(action, left)), scenario, goal_facts(goal))
    assert KINDS["sponge-out-of-reach"].fits(prospect) is may_come


def test_what_is_knocked_from_the_hand_is_sure_to_matter():
    machine = build(load_scenario("fig1"), RunOptions(), lambda kind, **data: None, lambda why: None)
    seen, context = machine.plant.observe(), machine.context
    context.scene = replace(context.scene, held=Held("box", machine.robot.X_WG(seen.q).inverse() * seen.poses["box"]))
    now = Occasion(0.0, seen, machine, MotionPlanner(machine.robot), np.random.default_rng(0))
    deed = knocked_from_hand(now)
    machine.plant.close()
    assert deed is not None
    assert deed.names == ("box",)
    assert deed.is_certain


@pytest.mark.parametrize(
    ("shape", "is_turned"), [("{cylinder: {radius: 0.033, height: 0.12}}", False), ("{box: [0.05, 0.06, 0.07]}", True)]
)
def test_what_is_round_is_not_turned_on_the_spot(shape, is_turned):
    text = scenario_path("fig3").read_text().replace("{box: [0.16, 0.22, 0.03]}", shape)
    machine = build(
        build_scenario(parse_document(text, "fig3")), RunOptions(), lambda kind, **data: None, lambda why: None
    )
    now = Occasion(0.0, machine.plant.observe(), machine, MotionPlanner(machine.robot), np.random.default_rng(0))
    assert (rotated(now) is not None) == is_turned
    machine.plant.close()


def test_what_was_taken_comes_back_further_off_where_there_is_no_room_nearby():
    scenario = load_scenario("fig1")
    X_WO = scenario.bodies["carrot"].X_WO
    slab = Fixture("slab", Box((0.28, 0.28, 0.05)), X_WO, 0.5, (1.0, 1.0, 1.0, 1.0))
    machine = build(replace(scenario, fixtures={"slab": slab}), RunOptions(), lambda kind, **data: None, print)
    machine.plant.take_away("carrot")
    rng, motion = np.random.default_rng(0), MotionPlanner(machine.robot)
    deeds = {}
    for waited in (0.0, 0.5, 1.0, 6.0):
        now = Occasion(10.0 + waited, machine.plant.observe(), machine, motion, rng)
        deeds[waited] = brought_back(now, name="carrot", X_WO=X_WO, since=10.0)
    machine.plant.close()
    assert not deeds[0.0]
    assert not deeds[0.5]
    assert not deeds[1.0]
    deed = deeds[6.0]
    assert deed is not None
    spot = deed.faults[0].X_WO
    assert np.linalg.norm((spot.translation - X_WO.translation)[:2]) > 0.14
    assert now.is_on_table(spot.translation[:2], 0.0)


def test_what_is_owed_comes_however_often_there_was_nothing_to_do(monkeypatch):
    tries = []

    def back(now):
        tries.append(now.t)
        return None if len(tries) < 6 else Deed("it came back")

    monkeypatch.setattr(driver, "PATIENCE", 2)
    monkeypatch.setitem(KINDS, "moved", Kind(lambda now: Deed("it went", later=Later(now.t + 0.01, back))))
    told = []
    # A seed for which it befalls the first planning, at a time that is drawn before.
    befalling = Driver((), ("moved",), 5, lambda kind, **data: told.append(data["sentence"]))
    machine = build(load_scenario("fig2"), RunOptions(), lambda kind, **data: None, print, befalling.seams)
    befalling.bind(machine)
    while machine.plant.observe().t < 1.5:
        machine.plant.step()
    machine.plant.close()
    assert told == ["it went", "it came back"]


@pytest.mark.parametrize(
    "goal", ["(in_bin box right_bin)", "(and (in_bin box right_bin) (put_away box))", "(put_away box)"]
)
def test_another_bin_is_wanted_for_what_belongs_in_one_or_goes_into_one(goal):
    scenario = replace(load_scenario("fig1"), goal=goal)
    machine = build(scenario, RunOptions(), lambda kind, **data: None, lambda why: None)
    now = Occasion(0.0, machine.plant.observe(), machine, MotionPlanner(machine.robot), np.random.default_rng(0))
    before = goal_changed(now)
    outcome = machine.planner.plan(machine.context.scene, machine.agenda)
    machine.agenda.adopt(outcome.plan, outcome.refinements, machine.context, "planned")
    planned = outcome.plan.actions[-1].args[1]
    deed = goal_changed(now)
    machine.plant.close()
    other = {"left_bin": "right_bin", "right_bin": "left_bin"}[planned]
    assert deed is not None
    assert deed.sentence == f"box is wanted in {other} instead of {planned}"
    assert deed.goal == {Fact("in_bin", ("box", other))}
    assert (before is None) == goal.startswith("(put_away")


def test_a_goal_that_changes_keeps_what_is_still_to_come_and_what_is_about_nothing():
    scenario = amended(load_scenario("fig1"), ("new-object",))
    scenario = replace(scenario, goal=f"{scenario.goal[:-1]} (hand_empty))")
    machine = build(scenario, RunOptions(), lambda kind, **data: None, lambda why: None)
    machine.agenda.facts = lambda scene: frozenset()
    now = Occasion(0.0, machine.plant.observe(), machine, MotionPlanner(machine.robot), np.random.default_rng(0))
    outcome = machine.planner.plan(machine.context.scene, machine.agenda)
    machine.agenda.adopt(outcome.plan, outcome.refinements, machine.context, "planned")
    deed = goal_changed(now)
    machine.plant.close()
    assert deed is not None
    assert {"hand_empty()", "stray_box"} <= {*map(str, deed.goal), *(arg for fact in deed.goal for arg in fact.args)}


def test_what_stands_in_the_way_already_is_not_put_there_once_more():
    scenario = amended(load_scenario("fig1"), ("path-blocked",))
    (post,) = scenario.late
    machine = build(scenario, RunOptions(), lambda kind, **data: None, lambda why: None)
    outcome = machine.planner.plan(machine.context.scene, machine.agenda)
    machine.agenda.adopt(outcome.plan, outcome.refinements, machine.context, "planned")
    machine.agenda.begin()

    def drawn(phase):
        machine.context.phase = phase
        now = Occasion(0.0, machine.plant.observe(), machine, MotionPlanner(machine.robot), np.random.default_rng(0))
        return path_blocked(now, post), brought_back(now, post, SE3(np.eye(3), np.array([0.6, 0.0, 0.0])), 0.0)

    phases = [phase for refinement in outcome.refinements for phase in refinement.phases]
    phase, deeds = next((phase, deeds) for phase in phases if None not in (deeds := drawn(phase)))
    machine.plant.bring(post, deeds[0].faults[0].X_WO)
    assert drawn(phase) == (None, None)
    machine.plant.close()


def test_nothing_is_put_so_close_before_the_hand_that_no_arm_could_stop():
    scenario = amended(load_scenario("fig1"), ("path-blocked",))
    (post,) = scenario.late
    machine = build(scenario, RunOptions(), lambda kind, **data: None, lambda why: None)
    outcome = machine.planner.plan(machine.context.scene, machine.agenda)
    machine.agenda.adopt(outcome.plan, outcome.refinements, machine.context, "planned")
    machine.agenda.begin()
    seen, motion, blocked = machine.plant.observe(), MotionPlanner(machine.robot), 0
    for phase in (phase for refinement in outcome.refinements for phase in refinement.phases if phase.kind == "move"):
        path, k = phase.trajectory, len(phase.trajectory.times) // 3
        left = Trajectory(path.times[k:] - path.times[k], path.q[k:], path.v[k:])
        machine.context.phase = replace(phase, trajectory=left)
        now = Occasion(0.0, replace(seen, q=left.start), machine, motion, np.random.default_rng(0))
        for _ in range(10):
            deed = path_blocked(now, post)
            if deed is None:
                continue
            there = now.scene.moved(post, deed.faults[0].X_WO)
            others = frozenset(obstacle.name for obstacle in obstacles(there)) - {post}
            allowed = pairs(frozenset(part_names(machine.robot, None)), others)
            assert all(motion.free(there, left.at(t)[0], allowed, 0.0) for t in np.linspace(0.0, 0.3, 31)), phase.name
            blocked += 1
    machine.plant.close()
    assert blocked > 10


def test_what_undoes_something_that_is_done_matters():
    scenario = replace(load_scenario("fig1"), goal="(and (in_bin carrot table) (in_bin box right_bin))")
    machine = build(scenario, RunOptions(), lambda kind, **data: None, lambda why: None)
    plant, context = machine.plant, machine.context

    def look():
        for _ in range(20):
            plant.step()
            context.scene = machine.belief.update(plant.observe(), is_closing=False)
        return Occasion(0.0, plant.observe(), machine, MotionPlanner(machine.robot), np.random.default_rng(0))

    pan = scenario.regions["dustpan"].X_WR.translation + np.array([0.0, 0.0, 0.01])
    trial = Trial.of(0, Deed("carrot fell into the pan", names=("carrot",)), look())
    assert not trial.is_proven(look())
    plant.put("carrot", SE3(np.eye(3), pan))
    assert trial.is_proven(look())
    plant.close()
