"""Dragging over an edge: what is planned, and what becomes of it in PyBullet."""

from dataclasses import replace

import numpy as np
import pytest
from bench import Bench, action, scene_with, with_pose
from pinocchio import SE3
from py_trees.common import Status

from bt_tamp.executive.build import build_planner
from bt_tamp.executive.force_audit import ForceAudit
from bt_tamp.options import RunOptions
from planner.failure import RefinementFailure
from planner.refinement import Budget, Hints, Refinement, Work
from planner.task.facts import goal_facts, place_of
from scenarios.scenario import Fixture
from scenarios.shapes import Box, Compound, Cylinder, Hull, Sphere, bounds
from skills.drag import OVERHANGS, Pull, edge_normal, ends, standing_out
from skills.pick import Pick
from skills.pressing import in_order
from skills.towing import (
    EDGE_MARGIN,
    GREATEST_FORCE,
    has_level_top,
    is_on_top,
    margin_inside,
    needed_force,
    press_pose,
    pressings,
    tip_points,
)

DRAG, PICK = action("drag(book, table)"), action("pick(book, table)")


def with_book(scenario, **changes):
    return replace(scenario, bodies={**scenario.bodies, "book": replace(scenario.bodies["book"], **changes)})


def rough(table_friction, mass):
    """The book on a rougher table, and heavier, than anyone believes; and the scene that is believed in."""
    believed = with_pose(scene_with("book"), "book", 0.6, 0.12, 0.3)
    true = replace(believed, table=replace(believed.table, friction=table_friction))
    return with_book(true, mass=mass), believed


@pytest.fixture(scope="module")
def book():
    return Bench(with_pose(scene_with("book"), "book", 0.6, 0.12, 0.4))


def dragged(bench, seed=0):
    found = bench.skills["drag"].refine(DRAG, bench.scene, np.random.default_rng(seed), Budget(), Hints())
    assert isinstance(found, Refinement), found
    return found


def test_a_flat_book_is_dragged_to_an_overhang_and_can_then_be_picked():
    bench = Bench(with_pose(scene_with("book"), "book", 0.6, -0.05, 0.7))
    assert bench.do("drag(book, table)") is Status.SUCCESS
    assert place_of(bench.scene, "book") == "table"
    assert bench.peak_force < 30.0
    assert bench.do("pick(book, table)") is Status.SUCCESS
    assert bench.do("place(book, right_bin)") is Status.SUCCESS
    assert place_of(bench.scene, "book") == "right_bin"


@pytest.mark.parametrize("seed", range(3))
def test_a_drag_ends_where_a_grasp_is_reachable(book, seed):
    found = dragged(book, seed)
    after = book.skills["drag"].predict(book.scene, found)
    grasp = Pick(book.skills["pick"]._kit).refine(PICK, after, np.random.default_rng(seed), Budget(), Hints())
    assert isinstance(grasp, Refinement)


def test_every_end_keeps_the_centre_of_mass_above_the_table_and_lets_the_object_stand_out_on_one_side(book):
    body, table, X_WO = book.scene.scenario.bodies["book"], book.scene.scenario.table, book.scene.poses["book"]
    by_edge = ends(body, X_WO, table, np.random.default_rng(0))
    assert all(by_edge), "every edge of a table is one that something can be dragged to"
    for edge, found in enumerate(by_edge):
        assert {end.overhang for _, end in found} <= set(OVERHANGS)
        for _, end in found:
            X_WO_end = end.pose(body, X_WO, table)
            out = [standing_out(body, X_WO_end, table, other) for other in range(4)]
            assert out[edge] == pytest.approx(end.overhang)
            assert max(out[:edge] + out[edge + 1 :]) <= 1e-6
            assert margin_inside(table, X_WO_end.translation) >= EDGE_MARGIN
            assert np.allclose(X_WO_end.rotation, X_WO.rotation)


def test_the_fingertips_press_on_the_object_and_above_the_table_all_the_way(book):
    body, table, X_WO = book.scene.scenario.bodies["book"], book.scene.scenario.table, book.scene.poses["book"]
    found = dragged(book)
    pull: Pull = found.sample
    way = pull.end.pose(body, X_WO, table).translation - X_WO.translation
    for point in tip_points(press_pose(body, X_WO, way, pull.tips), book.robot.gripper):
        assert np.all(np.abs(X_WO.actInv(point))[:2] < np.array(body.shape.size)[:2] / 2)
    path = next(phase for phase in found.phases if phase.kind == "slide").trajectory
    for t in np.linspace(0.0, path.duration, 30):
        q = path.at(t)[0]
        assert all(
            margin_inside(table, p) > EDGE_MARGIN - 1e-3 for p in tip_points(book.robot.X_WG(q), book.robot.gripper)
        )


@pytest.mark.parametrize(("x", "y", "edge"), [(0.6, 0.27, "+y"), (0.6, -0.14, "-y"), (0.54, 0.06, "-x")])
def test_the_edge_is_the_near_one_wherever_the_book_lies(x, y, edge):
    bench = Bench(with_pose(scene_with("book"), "book", x, y))
    sample: Pull = dragged(bench).sample
    assert ("+x", "-x", "+y", "-y")[sample.end.edge] == edge
    assert edge_normal(bench.scene.scenario.table, sample.end.edge) @ np.ones(3) == (1.0 if edge[0] == "+" else -1.0)


def test_what_fits_the_hand_nowhere_is_dragged_to_no_edge():
    crate = with_book(scene_with("book"), shape=Box((0.16, 0.22, 0.12)))
    failure = Bench(crate).refine(DRAG)
    assert isinstance(failure, RefinementFailure)
    assert "grasped there" in failure.reason
    assert not failure.culprit_sets


def test_what_stands_in_the_way_of_the_grasp_alone_keeps_no_drag_from_being_tried():
    walls = scene_with("book", "box")
    bench = Bench(with_pose(with_pose(walls, "book", 0.58, 0.21), "box", 0.5, 0.365))
    found = dragged(bench)
    after = bench.skills["drag"].predict(bench.scene, found)
    assert (
        standing_out(bench.scene.scenario.bodies["book"], after.poses["book"], walls.table, found.sample.end.edge) > 0
    )


def test_a_drag_that_finds_no_friction_is_refused():
    scenario = scene_with("book")
    failure = Bench(replace(scenario, table=replace(scenario.table, friction=1.3))).refine(DRAG)
    assert isinstance(failure, RefinementFailure)
    assert "friction" in failure.reason


def test_a_drag_that_would_have_to_press_beyond_the_limit_is_refused():
    failure = Bench(with_book(scene_with("book"), mass=9.0)).refine(DRAG)
    assert isinstance(failure, RefinementFailure)
    assert f"the limit is {GREATEST_FORCE:.0f} N" in failure.reason


def test_a_ball_offers_no_top_to_press_on():
    failure = Bench(with_book(scene_with("book"), shape=Sphere(0.06))).refine(DRAG)
    assert isinstance(failure, RefinementFailure)
    assert "no level top" in failure.reason


def test_the_force_follows_from_friction_and_weight(book):
    body, table = book.scene.scenario.bodies["book"], book.scene.scenario.table
    needed = needed_force(body, table, 1.2)
    assert needed == pytest.approx(0.5 * 0.4 * 9.81 / (1.2 - 0.5))
    assert needed_force(replace(body, mass=0.8), table, 1.2) == pytest.approx(2 * needed)
    assert needed_force(body, replace(table, friction=1.2), 1.2) is None


def test_ways_of_pressing_grow_harder_up_to_the_limit_and_what_failed_comes_last():
    sets = pressings(10.0, (1000.0,) * 6)
    forces = [one.force for one in sets]
    assert forces[0] == 20.0
    assert max(forces) == GREATEST_FORCE
    assert len(set(sets)) == len(sets)

    def hints(done=(), failed=()):
        pulls = [[Pull(None, None, one) for one in group] for group in (done, failed)]  # pyright: ignore
        return Hints(done=tuple(pulls[0]), failed=tuple(pulls[1]))

    assert in_order(sets, hints()) == sets
    assert in_order(sets, hints(failed=sets[:1])) == [*sets[1:], sets[0]]
    assert in_order(sets, hints(done=sets[2:3]))[0] == sets[2]


def test_a_book_that_slips_is_pressed_harder_on_the_way_and_still_comes_to_where_it_was_to_be():
    true, believed = rough(0.9, 0.4)
    bench = Bench(true)
    bench.believe(believed)
    told = []
    bench.context.report = lambda kind, **data: told.append(data["force"]) if kind == "pressed_harder" else None
    before, found = bench.scene, []
    refine = bench.context.refine
    bench.context.refine = lambda what: (found.append(refine(what)[0]), (found[-1], 0.0))[1]
    audit = ForceAudit(bench.robot)
    run = bench.run

    def watched(ticks):
        for _ in range(ticks // 5):
            run(5)
            audit.look(bench.context.observation.t, bench.plant.contacts(), bench.context, "drag")

    bench.run = watched
    assert bench.do("drag(book, table)") is Status.SUCCESS
    assert told == [16.0]
    assert audit.found[-1].target_n == 16.0
    assert all(motion.rms_error_n < 0.2 * motion.target_n for motion in audit.found)
    meant = bench.skills["drag"].predict(before, found[0]).poses["book"].translation
    assert np.linalg.norm(bench.scene.poses["book"].translation - meant) < 0.01
    assert bench.peak_force < 25.0


def test_where_the_first_force_fails_a_greater_one_works_and_is_kept_for_the_next_drag():
    true, believed = rough(1.0, 0.75)
    bench = Bench(true)
    bench.believe(believed)
    planner = build_planner(believed, RunOptions(), bench.robot, lambda kind, **data: None).planner
    begun = []

    def refine(what):
        outcome, _ = planner.refine(what, bench.scene)
        begun.append(outcome.sample.pressing.force)
        return outcome, 0.0

    bench.context.refine = refine
    assert bench.do("drag(book, table)") is Status.FAILURE
    assert bench.context.failure is not None
    assert bench.context.failure.kind == "DragSlipped"
    planner.search.learn(bench.context.failure, bench.scene)
    bench.context.failure = None
    assert bench.do("drag(book, table)") is Status.SUCCESS
    assert begun == [8.0, 16.0]

    assert bench.latest is not None
    planner.search.learn_success(bench.latest.refinement)
    worked = bench.latest.refinement.sample.pressing.force
    assert worked > 16.0
    bench.plant.put("book", believed.bodies["book"].X_WO)
    bench.run(20)
    solution = planner.search.plan(bench.scene, goal_facts("(holding book)"), np.random.default_rng(0), Work())
    assert [refinement.action for refinement in solution.refinements] == [DRAG, PICK]
    assert solution.refinements[0].sample.pressing.force == worked


def slab():
    """A mesh as large as the book, its top smaller than its base."""
    rims = [(x, y, z) for x, y, z in ((0.08, 0.11, 0.0), (0.07, 0.1, 0.03))]
    return Hull.of(np.array([(i * x, j * y, z) for x, y, z in rims for i in (-1, 1) for j in (-1, 1)]))[0]


def board():
    """A compound: a board with a lower strip along one side."""
    parts = [
        (Box((0.14, 0.2, 0.03)), SE3.Identity()),
        (Box((0.02, 0.2, 0.015)), SE3(np.eye(3), np.array([0.08, 0, -0.0075]))),
    ]
    return Compound.of(parts)[0]


def lying(shape):
    """The book with another shape, where it lies."""
    scenario = with_pose(scene_with("book"), "book", 0.6, -0.05, 0.7)
    X_WO = scenario.bodies["book"].X_WO.copy()
    X_WO.translation[2] = 0.05 - bounds(shape)[0][2]
    return with_book(scenario, shape=shape, X_WO=X_WO)


@pytest.mark.parametrize("shape", [slab(), board(), Cylinder(0.08, 0.015)], ids=["mesh", "compound", "disc"])
def test_a_flat_mesh_compound_or_disc_is_dragged_and_picked_as_a_box_is(shape):
    bench = Bench(lying(shape))
    assert bench.do("drag(book, table)") is Status.SUCCESS
    assert bench.peak_force < 30.0
    assert bench.do("pick(book, table)") is Status.SUCCESS


def test_a_drum_that_is_wider_than_high_does_not_chatter_under_the_fingertips():
    bench = Bench(lying(Cylinder(0.07, 0.08)))
    assert bench.do("drag(book, table)") is Status.SUCCESS
    assert bench.peak_force < 30.0


def test_only_the_highest_flat_faces_are_pressed_on():
    flat, knobbed = (
        slab(),
        Compound.of([(slab(), SE3.Identity()), (Cylinder(0.02, 0.02), SE3(np.eye(3), np.array([0, 0, 0.03])))])[0],
    )
    body, X_WO = lying(flat).bodies["book"], SE3.Identity()
    assert has_level_top(body, X_WO)
    assert is_on_top(body, X_WO, np.array([[0.06, 0.09, 0.0]]))
    assert not is_on_top(body, X_WO, np.array([[0.07, 0.09, 0.0]])), "over the slope beside the top"
    with_knob = replace(body, shape=knobbed)
    assert is_on_top(with_knob, X_WO, np.array([[0.01, 0.0, 0.0]]))
    assert not is_on_top(with_knob, X_WO, np.array([[0.05, 0.0, 0.0]])), "beside the knob"
    roof = Hull.of(
        np.array([(x, y, 0.0) for x in (-0.05, 0.05) for y in (-0.05, 0.05)] + [(0.0, y, 0.04) for y in (-0.05, 0.05)])
    )[0]
    assert not has_level_top(replace(body, shape=roof), X_WO)


def test_walls_along_all_edges_are_named_as_what_keeps_an_object_from_being_dragged_over_one():
    scenario = with_pose(scene_with("book"), "book", 0.6, -0.05)
    (x, y, _), (width, depth, _) = scenario.table.X_WT.translation, scenario.table.size
    sides = [(x + s * (width / 2 - 0.006), y, (0.012, depth, 0.05)) for s in (-1, 1)]
    sides += [(x, y + s * (depth / 2 - 0.006), (width, 0.012, 0.05)) for s in (-1, 1)]
    walls = {
        f"wall_{k}": Fixture(f"wall_{k}", Box(size), SE3(np.eye(3), np.array([x, y, 0.075])), 0.5, (1.0, 1.0, 1.0, 1.0))
        for k, (x, y, size) in enumerate(sides)
    }
    bench = Bench(replace(scenario, fixtures=walls))
    failure = bench.refine(DRAG)
    assert isinstance(failure, RefinementFailure)
    assert "wall_" in failure.reason
    assert not failure.culprit_sets


def test_what_lies_on_something_else_is_not_dragged_off_it():
    scene = scene_with("book", "box")
    base = replace(scene.bodies["box"], shape=Box((0.18, 0.24, 0.02)), X_WO=SE3(np.eye(3), np.array([0.6, 0.1, 0.06])))
    scene = with_book(scene, X_WO=SE3(np.eye(3), np.array([0.6, 0.1, 0.085])))
    bench = Bench(replace(scene, bodies={**scene.bodies, "box": base}))
    for name in ("drag", "drag_aside"):
        failure = bench.refine(action(f"{name}(book, table)"))
        assert isinstance(failure, RefinementFailure)
        assert failure.reason == "book lies on box, not on the table"
        assert not failure.culprit_sets


def test_a_hand_whose_fingers_stand_about_the_object_is_drawn_back_before_they_close():
    overhanging = with_pose(scene_with("box", scene="fig3"), "box", 0.6, -0.23)
    picking = Bench(overhanging).refine(action("pick(box, table)"))
    assert isinstance(picking, Refinement), picking
    about = picking.phases[1].trajectory.end
    pushed_back = with_pose(overhanging, "box", 0.6, -0.19)
    bench = Bench(replace(pushed_back, robot=replace(pushed_back.robot, q0=about)))
    assert bench.do("drag(box, table)") is Status.SUCCESS, bench.context.failure
    assert bench.latest.has("draw back")
    assert bench.do("pick(box, table)") is Status.SUCCESS


def test_a_hand_that_stands_free_closes_its_fingers_where_it_is():
    bench = Bench(scene_with("box", scene="fig3"))
    found = bench.refine(action("drag(box, table)"))
    assert isinstance(found, Refinement)
    assert found.phases[0].name == "close"
