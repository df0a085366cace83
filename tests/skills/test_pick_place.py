"""Pick and place, carried out in PyBullet."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from bench import Bench, action, scene_with, with_pose
from pinocchio import SE3
from py_trees.common import Status

from planner.failure import RefinementFailure
from planner.placements import Placement
from planner.refinement import Budget, Hints, Refinement, pairs
from planner.task.facts import place_of
from scenarios.shapes import Box, Cylinder, Hull, reach
from sim.scene import Held, pose_distance


@pytest.mark.parametrize(("x", "y", "yaw"), [(0.68, -0.08, 0.0), (0.55, 0.2, 0.6)])
def test_a_standing_box_is_picked_and_placed_in_a_bin_wherever_it_stands(x, y, yaw):
    bench = Bench(with_pose(scene_with("box"), "box", x, y, yaw))
    assert bench.do("pick(box, table)") is Status.SUCCESS
    assert bench.scene.held is not None
    assert bench.scene.held.name == "box"
    assert bench.scene.poses["box"].translation[2] > 0.05 + 0.075 + 0.05
    assert bench.do("place(box, right_bin)") is Status.SUCCESS
    assert bench.scene.held is None
    assert place_of(bench.scene, "box") == "right_bin"


def test_a_wrist_that_rubs_with_3_newton_metres_is_not_taken_for_one_that_is_held():
    bench = Bench(scene_with("box", seed=1), seed=1)
    bench.plant.set_joint_friction(3.0 * np.eye(7)[6])
    assert bench.do("pick(box, table)") is Status.SUCCESS
    assert bench.do("place(box, right_bin)") is Status.SUCCESS


def test_a_held_object_can_be_put_down_on_the_table():
    bench = Bench(scene_with("box"))
    assert bench.do("pick(box, table)") is Status.SUCCESS
    assert bench.do("place(box, table)") is Status.SUCCESS
    assert place_of(bench.scene, "box") == "table"


def test_the_sponge_is_picked_by_its_ends_and_hangs_level():
    bench = Bench(scene_with("sponge", seed=3))
    assert bench.do("pick(sponge, dustpan)") is Status.SUCCESS
    X_WO = bench.scene.poses["sponge"]
    closing_W = bench.robot.X_WG(bench.scene.q).rotation[:, 1]
    assert abs(closing_W @ X_WO.rotation[:, 0]) > 0.99
    assert X_WO.rotation[2, 2] > np.cos(np.radians(3))


def test_a_sponge_longer_than_the_fingers_open_is_picked_by_its_long_sides():
    scene = scene_with("sponge")
    long = replace(
        scene.bodies["sponge"], shape=Box((0.13, 0.07, 0.04)), X_WO=SE3(np.eye(3), np.array([0.6, 0.1, 0.07]))
    )
    found = Bench(replace(scene, bodies={"sponge": long})).refine(action("pick(sponge, table)"))
    assert isinstance(found, Refinement), found
    assert found.sample.width == pytest.approx(0.07)


def test_what_touches_a_neighbour_is_lifted_off_beside_it():
    scene = with_pose(scene_with("sponge", "carrot"), "carrot", 0.6, 0.1425)
    sponge = replace(scene.bodies["sponge"], X_WO=SE3(np.eye(3), np.array([0.6, 0.1, 0.07])))
    bench = Bench(replace(scene, bodies={**scene.bodies, "sponge": sponge}))
    bench.run(100)
    crumb = bench.scene.poses["carrot"].translation.copy()
    assert bench.do("pick(sponge, table)") is Status.SUCCESS
    assert np.linalg.norm(bench.scene.poses["carrot"].translation - crumb) < 0.01


def test_a_flat_book_has_no_grasp_as_it_lies_and_nothing_movable_is_to_blame():
    bench = Bench(scene_with("book", "box"))
    failure = bench.refine(action("pick(book, table)"))
    assert isinstance(failure, RefinementFailure)
    assert not failure.culprit_sets
    assert "table" in failure.reason


def test_what_weighs_other_than_declared_is_told_as_a_missed_grasp():
    bench = Bench(scene_with("box"))
    true_mass = bench.scene.scenario.bodies["box"].mass
    bench.belief_mass("box", true_mass + 0.5)
    assert bench.do("pick(box, table)") is Status.FAILURE
    assert bench.context.failure is not None
    assert bench.context.failure.kind == "GraspMissed"
    assert "weighs" in bench.context.failure.reason


def test_closing_on_nothing_is_told_as_a_missed_grasp():
    bench = Bench(scene_with("box"))
    what = action("pick(box, table)")
    found = bench.refine(what)
    assert not isinstance(found, RefinementFailure)
    elsewhere = Bench(with_pose(scene_with("box"), "box", 0.5, 0.3))
    elsewhere.context.refine = lambda _: (found, 0.0)
    assert elsewhere.do("pick(box, table)") is Status.FAILURE
    assert elsewhere.context.failure is not None
    assert elsewhere.context.failure.kind == "GraspMissed"


def test_what_is_out_of_reach_or_too_heavy_is_proven_so():
    far = Bench(with_pose(scene_with("box"), "box", 1.6, 0.0)).refine(action("pick(box, table)"))
    assert isinstance(far, RefinementFailure)
    assert far.proof == "here"
    scenario = scene_with("box")
    heavy = replace(scenario, bodies={"box": replace(scenario.bodies["box"], mass=30.0)})
    failure = Bench(heavy).refine(action("pick(box, table)"))
    assert isinstance(failure, RefinementFailure)
    assert failure.proof == "anywhere"
    assert "30.00 kg" in failure.reason


def _octagonal_rod(radius: float, length: float) -> Hull:
    around = np.radians(22.5 + 45.0 * np.arange(8))
    rim = radius / np.cos(np.radians(22.5)) * np.column_stack([np.cos(around), np.sin(around)])
    return Hull.of(np.array([[x, y, z] for x, y in rim for z in (0.0, length)]))[0]


@pytest.mark.parametrize("rod", [Cylinder(0.011, 0.24), Box((0.016, 0.014, 0.24)), _octagonal_rod(0.011, 0.24)])
def test_a_thin_rod_is_taken_up_from_where_it_lies(rod):
    scene = scene_with("box")
    R = pin.rpy.rpyToMatrix(np.pi / 2, 0.0, 0.6)
    height = 0.05 + reach(rod, R.T @ np.array([0.0, 0.0, -1.0]))
    lying = replace(scene.bodies["box"], shape=rod, mass=0.06, X_WO=SE3(R, np.array([0.6, 0.1, height])))
    bench = Bench(replace(scene, bodies={"box": lying}))
    assert bench.do("pick(box, table)") is Status.SUCCESS
    assert bench.do("place(box, right_bin)") is Status.SUCCESS
    assert place_of(bench.scene, "box") == "right_bin"


def test_something_light_is_held_so_gently_that_it_does_not_creep_in_the_hand():
    half, rim = 0.0244, ((0.0301, 0.0), (0.0151, 0.0424))
    corners = [[side * x, y, z] for x, z in rim for side in (-1.0, 1.0) for y in (-half, half)]
    wedge, centre = Hull.of(np.array(corners))
    scene = scene_with("box")
    X_WO = SE3(np.eye(3), np.array([0.484, -0.143, 0.05]) + centre)
    light = replace(scene.bodies["box"], shape=wedge, mass=0.05, friction=0.55, X_WO=X_WO)
    bench = Bench(replace(scene, bodies={"box": light}))
    assert bench.do("pick(box, table)") is Status.SUCCESS
    grip = bench.scene.held
    bench.run(1500)
    assert grip is not None
    assert bench.scene.held is not None
    distance, angle = pose_distance(grip.X_GO, bench.scene.held.X_GO)
    assert distance < 0.001
    assert np.degrees(angle) < 5.0


def test_fingers_that_let_go_beside_a_wall_open_no_further_than_there_is_room():
    bench = Bench(scene_with("box"))
    grasped = bench.refine(action("pick(box, table)"))
    assert isinstance(grasped, Refinement)
    scene, place = bench.skills["pick"].predict(bench.scene, grasped), action("place(box, right_bin)")
    assert scene.held is not None
    bin_ = scene.scenario.regions["right_bin"]

    def placed(*first: object) -> Refinement:
        found = bench.skills["place"].refine(place, scene, np.random.default_rng(0), Budget(), Hints(first=first))
        assert isinstance(found, Refinement), found
        return found

    middle = placed().sample
    closing = (middle.X_WO * scene.held.X_GO.inverse()).rotation[:, 1]
    axis = int(np.argmax(np.abs(closing)))
    assert abs(closing[axis]) > 0.99
    # So far that fingers 15 mm off the box's sides would be 3 mm inside the wall.
    wall = bin_.X_WR.translation[axis] + bin_.size[axis] / 2 - bin_.wall
    by = np.zeros(3)
    by[axis] = wall - (scene.opening / 2 + 0.015 + bench.robot.gripper.pad[1]) + 0.003 - middle.X_WO.translation[axis]
    shift = np.concatenate([by, np.zeros(4)])
    beside = Placement(tuple(np.array(middle.release) + shift), tuple(np.array(middle.rest) + shift))
    found = placed(beside)
    assert found.sample == beside
    opened = next(phase for phase in found.phases if phase.name == "open")
    assert scene.opening < opened.opening < scene.opening + 0.03
    let_go = replace(scene.moved("box", beside.X_WO), held=None, opening=opened.opening)
    touching = pairs(bench.robot.hand_links, "box") | pairs("box", "right_bin")
    assert bench.motion.free(let_go, opened.trajectory.end, touching, 0.0)


def test_a_tool_is_laid_down_where_it_can_be_taken_up_again_if_it_comes_to_lie_a_little_otherwise():
    for seed in range(8):
        bench = Bench(scene_with("sponge", seed=seed), seed=seed)
        taken = bench.refine(action("pick(sponge, dustpan)"))
        assert isinstance(taken, Refinement), taken
        bench.context.scene = bench.skills["pick"].predict(bench.scene, taken)
        laid = bench.refine(action("place(sponge, left_bin)"))
        assert isinstance(laid, Refinement), laid
        there = bench.skills["place"].predict(bench.scene, laid)
        X_WO = there.poses["sponge"]
        for yaw in np.radians([-5.0, 5.0]):
            for step in (0.006 * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])).tolist():
                bench.context.scene = there.moved(
                    "sponge", SE3(pin.rpy.rpyToMatrix(0.0, 0.0, yaw) @ X_WO.rotation, X_WO.translation + step)
                )
                again = bench.refine(action("pick(sponge, left_bin)"))
                assert isinstance(again, Refinement), (seed, yaw, step, again.reason)


def _held_by(depth):
    """A bench with the sponge in the hand, the fingertips reaching `depth` metres over it."""
    bench = Bench(scene_with("sponge"))
    half = bench.scene.scenario.bodies["sponge"].shape.size[2] / 2
    # The hand points down, above the table.
    q = next(q for q in bench.motion.ik(SE3(np.diag([1.0, -1.0, -1.0]), np.array([0.6, 0.1, 0.3]))))
    X_GO = SE3(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, half - depth]))
    X_GO = X_GO * SE3(pin.rpy.rpyToMatrix(0.0, 0.0, np.pi / 2), np.zeros(3))
    opening = bench.scene.scenario.bodies["sponge"].shape.size[0]
    there = bench.scene.moved("sponge", bench.robot.X_WG(q) * X_GO)
    bench.context.scene = replace(there, q=q, opening=opening, held=Held("sponge", X_GO))
    return bench


@pytest.mark.parametrize(("depth", "is_tight"), [(0.02, True), (0.009, True), (0.005, False)])
def test_what_hangs_by_the_fingertips_ends_is_carried_no_farther_than_the_table(depth, is_tight):
    bench = _held_by(depth)
    into_bin = bench.refine(action("place(sponge, left_bin)"))
    assert isinstance(into_bin, Refinement) is is_tight, into_bin
    if not is_tight:
        assert into_bin.reason == "sponge hangs by the fingertips' ends, too loosely to be carried off the table"
    assert isinstance(bench.refine(action("place(sponge, table)")), Refinement)


def test_where_nothing_else_was_found_it_is_carried_all_the_same():
    bench = _held_by(0.005)
    into_bin = bench.skills["place"].refine(
        action("place(sponge, left_bin)"), bench.scene, np.random.default_rng(0), Budget().widened(), Hints()
    )
    assert isinstance(into_bin, Refinement), into_bin
