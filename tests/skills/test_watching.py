"""Things that move while an action is under way."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio as pin
import pytest
from bench import Bench, action, scene_with, with_pose
from pinocchio import SE3
from py_trees.common import Status
from py_trees.trees import BehaviourTree

from planner.failure import GraspMissed, GraspSlipped, RefinementFailure, SceneChanged
from planner.refinement import Budget, Hints, Refinement
from planner.support import supports
from planner.task.facts import place_of
from scenarios.scenario import Scenario
from scenarios.shapes import Box, extents
from sim.scene import Held
from skills.context import ActionRun
from skills.control.controller import AT_REST
from skills.watching import Watch


def carried_out(bench: Bench, text: str, phase: str, share: float, disturb: Callable[[], None]) -> Status:
    """Carry out an action, and disturb once, as soon as `share` of the named phase's time has passed."""
    what = action(text)
    run = ActionRun(what)
    tree = BehaviourTree(bench.skills[what.name].subtree(run, bench.context))
    disturbed = False
    for _ in range(2000):
        tree.tick()
        if tree.root.status is not Status.RUNNING:
            assert disturbed, f"{text} never came to {phase}"
            return tree.root.status
        now, passed = run.running(bench.context.phase), bench.context.controller.time_in_reference
        if not disturbed and now is not None and now.name == phase and passed >= share * now.trajectory.duration:
            disturb()
            disturbed = True
        bench.run(10)
    raise AssertionError(f"{text} did not end")


def shifted(bench: Bench, name: str, x: float, y: float) -> Callable[[], None]:
    X_WO = bench.scene.poses[name]
    return lambda: bench.plant.put(name, SE3(X_WO.rotation, X_WO.translation + np.array([x, y, 0.0])))


def put_on(bench: Bench, name: str, below: str) -> Callable[[], None]:
    """Stand one body on the middle of another that lies flat, wherever that is by then."""

    def height(body: str) -> float:
        return float(extents(bench.scene.scenario.bodies[body].shape)[2])

    def put() -> None:
        p = bench.scene.poses[below].translation + np.array([0.0, 0.0, (height(below) + height(name)) / 2 + 5e-4])
        bench.plant.put(name, SE3(np.eye(3), p))

    return put


def with_post(scenario: Scenario, height: float) -> Scenario:
    """The scenario with its box as a slim post, out of the way."""
    body = scenario.bodies["box"]
    top = float(scenario.table.X_WT.translation[2]) + scenario.table.size[2] / 2
    X_WO = SE3(np.eye(3), np.array([0.7, 0.35, top + height / 2]))
    post = replace(body, shape=Box((0.06, 0.06, height)), X_WO=X_WO)
    return replace(scenario, bodies={**scenario.bodies, "box": post})


def with_small_box(*names: str) -> Scenario:
    """Some bodies of fig1, the box so small that it can stand on the sponge between the fingers."""
    scenario = with_pose(scene_with(*names), "box", 0.7, 0.3)
    body = replace(scenario.bodies["box"], shape=Box((0.05, 0.05, 0.07)), mass=0.15)
    return replace(scenario, bodies={**scenario.bodies, "box": body})


def events_of(bench: Bench) -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    bench.context.report = lambda kind, **data: found.append((kind, str(data.get("reason", ""))))
    return found


def test_an_object_moved_while_the_hand_comes_for_it_is_picked_where_it_is_now():
    bench = Bench(scene_with("box"))
    told = events_of(bench)
    assert (
        carried_out(bench, "pick(box, table)", "pre-grasp", 0.5, shifted(bench, "box", -0.08, 0.10)) is Status.SUCCESS
    )
    assert bench.scene.held is not None
    assert bench.scene.held.name == "box"
    assert [reason for kind, reason in told if kind == "refined_again"] == ["box was moved"]


def test_what_moves_as_the_reach_passes_into_the_approach_is_planned_for_with_the_arm_at_rest():
    bench = Bench(scene_with("box"))
    speeds, starts = [], []
    planned = bench.context.refine

    def refine(what):
        speeds.append(np.abs(bench.context.observation.v).max())
        starts.append(bench.context.observation.q)
        return planned(what)

    bench.context.refine = refine
    what = action("pick(box, table)")
    run = ActionRun(what)
    tree = BehaviourTree(bench.skills["pick"].subtree(run, bench.context))
    while not bench.context.controller.passed:
        tree.tick()
        bench.run(1)
    shifted(bench, "box", -0.05, 0.05)()
    bench.run(5)
    while tree.root.status is Status.RUNNING:
        tree.tick()
        bench.run(10)
    assert tree.root.status is Status.SUCCESS
    assert len(speeds) == 2
    assert max(speeds) < AT_REST


def test_what_is_put_on_an_object_while_the_hand_comes_for_it_has_to_go_first():
    bench = Bench(with_small_box("box", "sponge"))
    told = events_of(bench)
    status = carried_out(bench, "pick(sponge, dustpan)", "pre-grasp", 0.5, put_on(bench, "box", "sponge"))
    assert status is Status.FAILURE
    assert isinstance(bench.context.failure, RefinementFailure)
    assert bench.context.failure.culprit_sets == {frozenset({"box"})}
    assert [reason for kind, reason in told if kind == "refined_again"] == ["box came to stand on sponge"]


def test_what_is_put_on_an_object_while_the_fingers_close_is_not_lifted_with_it():
    bench = Bench(with_small_box("box", "sponge"))
    status = carried_out(bench, "pick(sponge, dustpan)", "close", 0.0, put_on(bench, "box", "sponge"))
    assert status is Status.FAILURE
    assert isinstance(bench.context.failure, SceneChanged)
    assert bench.context.failure.reason == "box came to stand on sponge"
    bench.run(300)
    assert bench.scene.held is None


def test_what_is_put_on_an_object_that_the_fingers_hold_already_is_not_lifted_with_it():
    bench = Bench(with_small_box("box", "sponge"))
    run = ActionRun(action("pick(sponge, dustpan)"))
    tree = BehaviourTree(bench.skills["pick"].subtree(run, bench.context))
    while bench.scene.held is None:
        tree.tick()
        bench.run(10)
    put_on(bench, "box", "sponge")()
    while tree.root.status is Status.RUNNING:
        tree.tick()
        bench.run(10)
    assert isinstance(bench.context.failure, SceneChanged)
    assert bench.context.failure.reason == "box came to stand on sponge"


def test_what_was_lifted_with_an_object_can_be_taken_from_it_once_that_is_put_down():
    bench = Bench(with_small_box("box", "carrot", "sponge"))
    carried_out(bench, "pick(sponge, dustpan)", "lift", 0.0, put_on(bench, "box", "sponge"))
    assert isinstance(bench.context.failure, GraspMissed)
    assert place_of(bench.scene, "box") == "table"
    wiped = bench.refine(action("wipe(carrot, table, dustpan)"))
    assert isinstance(wiped, RefinementFailure)
    assert wiped.culprit_sets == {frozenset({"box"})}
    assert bench.do("place(sponge, table)") is Status.SUCCESS, bench.context.failure
    assert supports(bench.scene, "box") == {"sponge"}
    assert bench.do("pick(box, table)") is Status.SUCCESS, bench.context.failure


def test_what_is_put_in_the_way_of_the_hand_is_gone_around_without_touching_it():
    bench = Bench(with_post(scene_with("box", "sponge"), height=0.6))
    told = events_of(bench)
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    lift = bench.skills["place"].refine(
        action("place(sponge, left_bin)"), bench.scene, np.random.default_rng(0), Budget(), Hints()
    )
    assert isinstance(lift, Refinement)
    carry = lift.phases[0].trajectory
    p_WG = [bench.robot.X_WG(carry.at(share * carry.duration)[0]).translation for share in np.linspace(0.3, 0.9, 13)]
    height = bench.scene.poses["box"].translation[2]
    spots = [SE3(np.eye(3), np.array([min(p[0], 0.72), p[1], height])) for p in p_WG if abs(p[1]) < 0.25]
    spot = next(X for X in spots if bench.motion.audit(bench.scene.moved("box", X), carry, lift.phases[0].allowed))
    status = carried_out(bench, "place(sponge, left_bin)", "pre-place", 0.05, lambda: bench.plant.put("box", spot))
    assert status is Status.SUCCESS
    assert place_of(bench.scene, "sponge") == "left_bin"
    assert any(kind == "refined_again" and "box" in reason for kind, reason in told)
    assert np.linalg.norm(bench.scene.poses["box"].translation - spot.translation) < 0.002


@pytest.mark.parametrize(("by", "turn", "is_told"), [(0.004, 3.0, False), (0.013, 0.0, True), (0.0, 9.6, True)])
def test_what_shifts_in_the_hand_is_carried_another_way(by, turn, is_told):
    bench = Bench(scene_with("box"))
    assert bench.do("pick(box, table)") is Status.SUCCESS
    placed = bench.refine(action("place(box, right_bin)"))
    assert isinstance(placed, Refinement)
    watch, held = Watch(bench.motion, placed, bench.scene), bench.scene.held
    assert watch.object_shifted(bench.scene) is None
    slip = SE3(pin.rpy.rpyToMatrix(0.0, np.radians(turn), 0.0), np.array([0.0, 0.0, by]))
    shifted = replace(bench.scene, held=Held("box", held.X_GO * slip))
    assert watch.object_shifted(shifted) == ("box shifted in the hand" if is_told else None)


def test_what_is_put_in_the_way_of_a_stroke_ends_it_before_it_is_hit():
    scene = with_pose(scene_with("box", "carrot", "sponge"), "box", 0.5, 0.3)
    bench = Bench(scene)
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    carrot = bench.scene.poses["carrot"].translation
    box = SE3(np.eye(3), np.array([carrot[0], carrot[1] - 0.2, bench.scene.poses["box"].translation[2]]))
    status = carried_out(bench, "wipe(carrot, table, dustpan)", "stroke", 0.1, lambda: bench.plant.put("box", box))
    assert status is Status.FAILURE
    assert isinstance(bench.context.failure, SceneChanged)
    assert "box" in bench.context.failure.reason
    assert np.linalg.norm(bench.scene.poses["box"].translation - box.translation) < 0.002


def test_what_stirs_beside_the_stroke_does_not_end_it():
    scene = with_pose(scene_with("box", "carrot", "sponge"), "box", 0.5, 0.3)
    bench = Bench(scene)
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    nudge = shifted(bench, "box", 0.004, 0.0)
    assert carried_out(bench, "wipe(carrot, table, dustpan)", "descend", 0.1, nudge) is Status.SUCCESS


def test_a_sponge_that_slips_up_between_the_fingers_ends_the_wipe_before_they_meet_the_table():
    bench = Bench(scene_with("carrot", "sponge"))
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    slippery = partial(bench.plant.set_pad_friction, 0.002)
    assert carried_out(bench, "wipe(carrot, table, dustpan)", "descend", 0.3, slippery) is Status.FAILURE
    assert isinstance(bench.context.failure, GraspSlipped)
    for _ in range(30):
        bench.run(10)
        names = {frozenset((contact.first, contact.second)) for contact in bench.plant.contacts()}
        assert not any("table" in pair and pair & bench.robot.finger_links for pair in names)


def test_a_crumb_moved_while_the_sponge_comes_down_is_not_wiped_for_where_it_was():
    bench = Bench(scene_with("carrot", "sponge"))
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    status = carried_out(bench, "wipe(carrot, table, dustpan)", "descend", 0.3, shifted(bench, "carrot", -0.05, 0.15))
    assert status is Status.FAILURE
    assert isinstance(bench.context.failure, SceneChanged)
    assert bench.context.failure.reason == "carrot was moved"


def wiped_while(share: float, disturb: Callable[[Bench], None]) -> tuple[Bench, Status, float]:
    """The carrot wiped, disturbed in the stroke; how it went, and the seconds from then to its end."""
    bench = Bench(with_pose(scene_with("carrot", "sponge"), "carrot", 0.66, 0.08))
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    since: list[float] = []

    def do() -> None:
        disturb(bench)
        since.append(bench.context.observation.t)

    status = carried_out(bench, "wipe(carrot, table, dustpan)", "stroke", share, do)
    return bench, status, bench.context.observation.t - since[0]


@pytest.mark.parametrize("by", [(0.0, 0.2), (-0.12, -0.1)])
def test_a_stroke_ends_at_once_when_its_crumb_is_put_out_of_it(by):
    bench, status, passed = wiped_while(0.2, lambda bench: shifted(bench, "carrot", *by)())
    assert status is Status.FAILURE
    assert isinstance(bench.context.failure, SceneChanged)
    assert bench.context.failure.reason == "carrot was moved"
    assert passed < 0.15


def test_a_stroke_ends_at_once_when_its_crumb_is_taken_away():
    bench, status, passed = wiped_while(0.2, lambda bench: bench.plant.take_away("carrot"))
    assert status is Status.FAILURE
    assert isinstance(bench.context.failure, SceneChanged)
    assert bench.context.failure.reason == "carrot is gone"
    assert passed < 0.2


def test_a_crumb_put_elsewhere_before_the_sponge_is_wiped_all_the_same():
    bench, status, _ = wiped_while(0.2, lambda bench: shifted(bench, "carrot", 0.02, -0.1)())
    assert status is Status.SUCCESS, bench.context.failure


def test_a_crumb_put_into_the_dustpan_by_someone_else_does_not_end_the_stroke():
    bench, status, _ = wiped_while(
        0.2, lambda bench: bench.plant.put("carrot", bench.scene.scenario.regions["dustpan"].X_WR)
    )
    assert status is Status.SUCCESS, bench.context.failure
