from dataclasses import replace

import numpy as np
import pytest
from pinocchio import SE3, rpy

from planner.failure import MotionFailure
from planner.motion.collision import FastChecker
from planner.motion.enclosed import enclosed_end
from planner.motion.motion_planner import MotionPlanner
from planner.motion.ompl_ import Query
from scenarios.scenario import Body
from scenarios.shapes import Box
from sim.scene import SceneState

AROUND = 0.155
"""Metres from the forearm's axis to the middle of a wall."""


@pytest.fixture(scope="module")
def caged(robot, table) -> SceneState:
    """Four walls close about the forearm, where the arm starts."""
    poses = robot.link_poses(table([]).robot.q0, 0.0)
    elbow, wrist = poses["link_4"].translation, poses["link_6"].translation
    z = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    y = np.array([0.0, 1.0, 0.0])  # across the plane in which the arm is bent
    X_WF = SE3(np.column_stack([np.cross(y, z), y, z]), (elbow + wrist) / 2)
    turns = [SE3(rpy.rpyToMatrix(0.0, 0.0, k * np.pi / 2), np.zeros(3)) for k in range(4)]
    wall = SE3(np.eye(3), np.array([AROUND, 0.0, 0.0]))
    return SceneState.initial(
        table([(f"wall{k}", Box((0.02, 0.3, 0.26)), X_WF * turn * wall) for k, turn in enumerate(turns)]), 0.03
    )


def _query(robot, scene: SceneState) -> Query:
    away = scene.q + np.array([1.2, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    return Query(scene.q, [away], np.stack([robot.q_min, robot.q_max]), seed=1, max_checks=4000)


def test_a_hand_in_a_cage_is_enclosed_at_the_start(robot, caged):
    found = enclosed_end(FastChecker(robot, caged), _query(robot, caged))
    assert found is not None
    assert found.which == "start"


def test_the_same_from_the_other_side_is_enclosed_at_the_goal(robot, caged):
    query = _query(robot, caged)
    found = enclosed_end(FastChecker(robot, caged), replace(query, start=query.goals[0], goals=[query.start]))
    assert found is not None
    assert found.which == "goal"


def test_with_one_goal_outside_nothing_is_enclosed(robot, caged):
    query = _query(robot, caged)
    outside = query.goals[0]
    both = replace(query, start=outside, goals=[query.start, outside + 0.05])
    assert enclosed_end(FastChecker(robot, caged), both) is None


@pytest.mark.parametrize("wall", ["wall0", "wall1", "wall2"])
def test_three_walls_enclose_nobody_whatever_chance_draws(robot, caged, wall):
    scene = caged.without(frozenset({wall}))
    for seed in range(10):
        assert enclosed_end(FastChecker(robot, scene), replace(_query(robot, scene), seed=seed)) is None


def test_an_open_table_encloses_nobody(robot, scene):
    assert enclosed_end(FastChecker(robot, scene), _query(robot, scene)) is None


def test_who_is_walled_in_by_what_can_be_moved_aside_has_culprits(robot, caged):
    failure = MotionPlanner(robot).move(caged, _query(robot, caged).goals)
    assert isinstance(failure, MotionFailure)
    assert failure.culprits
    assert all(name.startswith("wall") for name in failure.culprits)


def test_a_hand_about_something_is_not_drawn_back_for_a_goal_in_a_cage(robot, caged):
    away = _query(robot, caged).goals[0]
    block = Body("block", Box((0.03, 0.03, 0.03)), 0.1, 0.5, (1.0, 0.0, 0.0, 1.0), robot.X_WG(away))
    scenario = replace(caged.scenario, bodies={**caged.scenario.bodies, "block": block})
    about = replace(SceneState.initial(scenario, 0.05), q=away)

    def checks(scene):
        planner = MotionPlanner(robot)
        # The walk by which a cage is known takes some for open.
        assert all(isinstance(planner.move(scene, [caged.q]), MotionFailure) for _ in range(5))
        return planner.work.counts["checks"]

    assert checks(about) < 3.5 * checks(about.without(frozenset({"block"})))
