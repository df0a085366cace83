from dataclasses import replace

import numpy as np
import pytest

from planner.failure import MotionFailure
from planner.motion.clearance import MotionSettings
from planner.motion.exact import ExactChecker
from planner.motion.motion_planner import MotionPlanner
from planner.motion.ompl_ import path_length
from planner.motion.trajectory import Trajectory
from planner.motion.world import Margins
from planner.refinement import Work, pairs
from scenarios.shapes import Box
from sim.scene import SceneState


@pytest.fixture
def goal(planner, down, scene):
    """Gives a collision-free configuration with the hand pointing down at x, y, z."""

    def find(x: float, y: float, z: float, yaw: float = 0.0, where: SceneState = scene) -> np.ndarray:
        return next(q for q in planner.ik(down(x, y, z, yaw)) if planner.free(where, q))

    return find


def _touching(planner, down, scene: SceneState, x: float, y: float, z: float) -> SceneState:
    """The scene with the arm at a pose, collisions or not."""
    return replace(scene, q=planner.ik(down(x, y, z))[0])


def _mirrored(q: np.ndarray) -> np.ndarray:
    """The arm turned about its base from (0.6, −0.2) to (0.6, 0.2)."""
    return q + np.append(2 * np.arctan2(0.2, 0.6), np.zeros(6))


def _clearance(robot, scene: SceneState, trajectory: Trajectory, margin: float) -> set[frozenset[str]]:
    checker = ExactChecker(robot, scene, Margins(margin))
    path = np.array(
        [trajectory.at(t)[0] for t in np.linspace(0.0, trajectory.duration, int(trajectory.duration / 0.005))]
    )
    return {contact.pair for contact in checker.contacts(checker.densified(path))}


@pytest.mark.parametrize("place", [(0.6, 0.25, 0.15), (0.73, -0.08, 0.3), (0.05, 0.62, -0.08), (0.05, -0.62, -0.05)])
def test_a_move_leads_from_the_start_to_the_goal_free_of_everything(robot, scene, planner, goal, place):
    end = goal(*place)
    trajectory = planner.move(scene, [end])
    assert isinstance(trajectory, Trajectory)
    assert np.allclose(trajectory.start, scene.q)
    assert np.allclose(trajectory.end, end)
    assert _clearance(robot, scene, trajectory, 0.0005) == set()


def test_moves_on_from_wherever_the_last_one_ended(robot, scene, planner, goal):
    places = [(0.05, 0.62, -0.08), (0.75, 0.3, 0.12), (0.05, -0.62, -0.08), (0.5, -0.2, 0.2)]
    for place in places:
        end = goal(*place)
        trajectory = planner.move(scene, [end])
        assert isinstance(trajectory, Trajectory)
        assert _clearance(robot, scene, trajectory, 0.0005) == set()
        scene = replace(scene, q=end)


def test_a_held_body_is_carried_around_what_stands_in_the_way(robot, sponge_in_hand, planner, goal):
    start = replace(sponge_in_hand, q=goal(0.6, -0.25, 0.13, where=sponge_in_hand))
    end = goal(0.75, 0.2, 0.13, where=sponge_in_hand)
    trajectory = planner.move(start, [end])
    assert isinstance(trajectory, Trajectory)
    assert _clearance(robot, sponge_in_hand, trajectory, 0.0005) == set()


def test_the_first_goal_that_a_straight_move_reaches_is_taken(scene, planner, goal):
    near, far = goal(0.6, 0.2, 0.3), goal(0.05, -0.62, -0.05)
    trajectory = planner.move(scene, [near, far])
    assert isinstance(trajectory, Trajectory)
    assert np.allclose(trajectory.end, near)


def test_goals_in_collision_are_passed_over(scene, planner, down, goal):
    blocked, free = planner.ik(down(0.73, -0.08, 0.1))[0], goal(0.6, 0.2, 0.3)
    trajectory = planner.move(scene, [blocked, free])
    assert isinstance(trajectory, Trajectory)
    assert np.allclose(trajectory.end, free)


def test_a_goal_inside_a_movable_body_names_it_as_culprit(scene, planner, down):
    result = planner.move(scene, [planner.ik(down(0.73, -0.03, 0.12))[0]])
    assert isinstance(result, MotionFailure)
    assert result.culprits == {"box"}
    assert "box" in result.reason


def test_a_goal_inside_the_table_has_no_culprit_even_if_a_body_is_hit_too(scene, planner, down):
    result = planner.move(scene, [planner.ik(down(0.73, 0.08, 0.02))[0]])
    assert isinstance(result, MotionFailure)
    assert result.culprits == frozenset()
    assert "table" in result.reason


def test_a_goal_beyond_the_joint_limits_is_refused(robot, scene, planner):
    result = planner.move(scene, [robot.q_max + 0.1])
    assert isinstance(result, MotionFailure)
    assert "limit" in result.reason


def test_bodies_in_the_only_way_found_are_the_culprits(table, at, planner, goal, scene):
    # One check is no search: only the straight move is left, and the wall stands across it.
    wall = ("wall", Box((0.3, 0.02, 0.4)), at(0.6, 0.0, 0.26))
    aside = ("aside", Box((0.05, 0.05, 0.05)), at(0.5, 0.35, 0.08))
    walled = SceneState.initial(table([wall, aside]), 0.1)
    start = replace(walled, q=goal(0.6, -0.2, 0.2, where=walled))
    end = _mirrored(start.q)
    result = planner.move(start, [end], max_checks=1)
    assert isinstance(result, MotionFailure)
    assert result.culprits == {"wall"}


def test_with_a_budget_the_way_around_the_same_wall_is_found(robot, table, at, planner, goal):
    wall = ("wall", Box((0.3, 0.02, 0.4)), at(0.6, 0.0, 0.26))
    walled = SceneState.initial(table([wall]), 0.1)
    start = replace(walled, q=goal(0.6, -0.2, 0.2, where=walled))
    trajectory = planner.move(start, [_mirrored(start.q)])
    assert isinstance(trajectory, Trajectory)
    assert _clearance(robot, walled, trajectory, 0.0005) == set()


def test_whatever_chance_draws_a_way_over_a_wall_leads_not_far_about(robot, table, at, planner, down):
    scene = SceneState.initial(table([("wall", Box((0.4, 0.02, 0.5)), at(0.6, 0.05, 0.3))]), 0.06)
    start, end = (next(q for q in planner.ik(down(0.6, y, 0.12)) if planner.free(scene, q)) for y in (0.25, -0.2))
    ways = [MotionPlanner(robot, seed).way(replace(scene, q=start), [end]) for seed in range(20)]
    assert max(path_length(way) for way in ways) < 1.3 * np.linalg.norm(end - start)


def test_a_fixed_obstacle_in_the_only_way_is_nobody_s_fault(scene, planner, goal):
    start = replace(scene, q=goal(0.05, 0.62, -0.08))
    result = planner.move(start, [goal(0.05, -0.62, -0.08)], max_checks=1)
    assert isinstance(result, MotionFailure)
    assert result.culprits == frozenset()


def test_the_arm_may_start_nearer_than_the_margin_but_come_no_nearer(robot, scene, planner, down, goal):
    # A finger two millimetres beside the box.
    beside = _touching(planner, down, scene, 0.73, 0.012, 0.12)
    assert not planner.free(beside, beside.q)
    assert planner.free(beside, beside.q, margin=0.0015)
    trajectory = planner.move(beside, [goal(0.6, 0.2, 0.3)])
    assert isinstance(trajectory, Trajectory)
    assert _clearance(robot, beside, trajectory, 0.001) == set()


@pytest.mark.parametrize("room", [0.003, 0.006, 0.009])
def test_a_hand_among_narrow_things_is_drawn_straight_back_first(robot, table, at, planner, down, room):
    X_WO = at(0.05, -0.62, -0.17)
    scenario = table([("block", Box((0.097, 0.05, 0.05)), X_WO)])
    q = planner.ik(down(0.05, -0.62, -0.17, yaw_deg=180.0))[0]
    start = SceneState(scenario, {"block": X_WO}, q, 0.05 + 2.0 * room)
    moved = planner.move(start, [scenario.robot.q0])
    assert isinstance(moved, Trajectory)
    assert np.allclose(moved.end, scenario.robot.q0)
    assert planner.audit(start, moved) is None


@pytest.mark.parametrize("overlap", [0.002, 0.006, 0.012])
def test_fingers_that_overlap_what_they_stand_beside_are_drawn_straight_out(robot, table, at, planner, down, overlap):
    X_WO = at(0.05, -0.62, -0.17)
    scenario = table([("block", Box((0.097, 0.05, 0.05)), X_WO)])
    q = planner.ik(down(0.05, -0.62, -0.17, yaw_deg=180.0))[0]
    start = SceneState(scenario, {"block": X_WO}, q, 0.05 - 2.0 * overlap)
    moved = planner.move(start, [scenario.robot.q0])
    assert isinstance(moved, Trajectory)
    assert np.allclose(moved.end, scenario.robot.q0)
    out = robot.X_WG(q).actInv(robot.X_WG(moved.at(0.3 * moved.duration)[0]))
    assert out.translation[2] < -0.02
    later = [moved.at(t)[0] for t in np.linspace(0.4, 1.0, 20) * moved.duration]
    assert all(planner.free(start, q, margin=0.0005) for q in later)


def test_a_held_body_may_start_pressed_on_what_it_stands_on(sponge_in_hand, planner, down, goal):
    # The sponge reaches 2.5 cm below the fingertips, the table's top is at 5 cm.
    pressed = _touching(planner, down, sponge_in_hand, 0.6, 0.25, 0.074)
    trajectory = planner.move(pressed, [goal(0.6, 0.25, 0.2, where=sponge_in_hand)])
    assert isinstance(trajectory, Trajectory)


def test_an_arm_deep_in_a_body_cannot_start_and_says_in_which(scene, planner, down, goal):
    inside = _touching(planner, down, replace(scene, opening=0.0), 0.73, -0.08, 0.12)
    result = planner.move(inside, [goal(0.6, 0.2, 0.3)])
    assert isinstance(result, MotionFailure)
    assert result.culprits == {"box"}
    assert "starts" in result.reason


def test_to_stay_where_it_is_takes_no_time(scene, planner):
    trajectory = planner.move(scene, [scene.q])
    assert isinstance(trajectory, Trajectory)
    assert trajectory.duration == 0.0


def test_the_same_seed_moves_the_same_way_again(robot, scene, goal):
    start, end = replace(scene, q=goal(0.05, 0.62, -0.08)), goal(0.05, -0.62, -0.08)
    first, again, other = (MotionPlanner(robot, seed).move(start, [end]) for seed in (3, 3, 4))
    assert isinstance(first, Trajectory)
    assert isinstance(again, Trajectory)
    assert isinstance(other, Trajectory)
    assert np.array_equal(first.q, again.q)
    assert first.q.shape != other.q.shape or not np.allclose(first.q, other.q)


def test_another_planner_can_be_asked_for_by_name(robot, scene, goal):
    start, end = replace(scene, q=goal(0.05, 0.62, -0.08)), goal(0.05, -0.62, -0.08)
    settings = MotionSettings(planner="best-of-n-RRT", goal_bias=0.05, restarts=5)
    assert isinstance(MotionPlanner(robot, settings=settings).move(start, [end], max_checks=12000), Trajectory)


def test_lines_are_cut_into_legs_at_their_waypoints(robot, planner, down):
    waypoints = [down(0.6, 0.1, 0.2), down(0.6, 0.1, 0.1), down(0.6, -0.1, 0.1)]
    for path, legs in zip(planner.lines(waypoints), planner.legs(waypoints), strict=True):
        assert len(legs) == 2
        assert np.array_equal(np.concatenate([legs[0], legs[1][1:]]), path)
        assert robot.X_WG(legs[0][-1]).isApprox(waypoints[1], 1e-9)


def test_a_line_names_the_bodies_it_hits(scene, planner, down):
    across = planner.lines([down(0.73, 0.2, 0.07, 90), down(0.73, -0.2, 0.07, 90)])[0]
    closed = replace(scene, opening=0.0)
    failure = planner.line_is_free(closed, across)
    assert failure is not None
    assert failure.culprits == {"box", "carrot"}
    assert planner.line_is_free(closed.without(frozenset({"box", "carrot"})), across) is None


def test_a_line_that_hits_the_table_too_has_no_culprits(scene, planner, down):
    low = planner.lines([down(0.73, 0.2, 0.03, 90), down(0.73, -0.2, 0.03, 90)])[0]
    failure = planner.line_is_free(scene, low)
    assert failure is not None
    assert failure.culprits == frozenset()


def test_allowed_pairs_make_a_line_free(robot, scene, planner, down):
    onto = planner.lines([down(0.73, -0.08, 0.3), down(0.73, -0.08, 0.16)])[0]
    narrow = replace(scene, opening=0.05)
    assert planner.line_is_free(narrow, onto) is not None
    assert planner.line_is_free(narrow, onto, pairs(robot.finger_links, "box")) is None


def test_an_audit_names_what_has_come_into_the_way(scene, planner, goal, at):
    start = replace(scene, q=goal(0.6, -0.2, 0.25))
    trajectory = planner.move(start, [_mirrored(start.q)])
    assert isinstance(trajectory, Trajectory)
    assert planner.audit(start, trajectory) is None
    middle = planner.robot.X_WG(trajectory.at(trajectory.duration / 2)[0]).translation
    intruded = start.moved("carrot", at(*middle))
    failure = planner.audit(intruded, trajectory)
    assert failure is not None
    assert failure.culprits == {"carrot"}


def test_an_audit_of_the_rest_ignores_what_the_arm_has_passed(scene, planner, goal, at):
    start = replace(scene, q=goal(0.6, -0.2, 0.25))
    trajectory = planner.move(start, [_mirrored(start.q)])
    assert isinstance(trajectory, Trajectory)
    quarter = planner.robot.X_WG(trajectory.at(trajectory.duration / 4)[0]).translation
    intruded = start.moved("carrot", at(*quarter))
    assert planner.audit(intruded, trajectory) is not None
    assert planner.audit(intruded, trajectory, since=0.7 * trajectory.duration) is None


def test_work_is_counted(robot, scene, down):
    work = Work()
    planner = MotionPlanner(robot, work=work)
    planner.move(scene, [planner.ik(down(0.6, 0.2, 0.3))[0]])
    assert work.counts["ik"] == 1
    assert work.counts["checks"] > 20


def test_the_hand_alone_tells_what_it_would_hit(robot, scene, planner, down):
    assert planner.hand_hits(scene, down(0.73, -0.08, 0.3)) == frozenset()
    assert planner.hand_hits(replace(scene, opening=0.05), down(0.73, -0.08, 0.16)) == {"box"}
    assert planner.hand_hits(replace(scene, opening=0.05), down(0.73, -0.08, 0.16), pairs("finger_left", "box")) == {
        "box"
    }
    touching = pairs(robot.finger_links, "box")
    assert planner.hand_hits(replace(scene, opening=0.05), down(0.73, -0.08, 0.16), touching) == frozenset()
