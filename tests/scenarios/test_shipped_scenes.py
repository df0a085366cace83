"""The scenes that ship: they load, with any noise, and say what the paper's figures show."""

import numpy as np
import pytest

from scenarios.goal import is_crumb, parse_goal
from scenarios.library import list_scenarios
from scenarios.load import load_scenario
from scenarios.robots import ROBOTS
from scenarios.shapes import extents
from sim.robot import MODELS, RobotModel

SCENES = ("fig1", "fig1_wipe", "fig2", "fig3")


def test_the_papers_scenes_are_listed():
    assert set(SCENES) <= set(list_scenarios())


@pytest.mark.parametrize("scene", list_scenarios())
def test_every_shipped_scene_loads_with_noise(scene):
    for seed in range(8):
        loaded = load_scenario(scene, seed)
        assert (loaded.name, loaded.seed) == (scene, seed)


def test_a_hundred_draws_of_fig1_all_find_a_place():
    nominal = load_scenario("fig1").bodies
    spread = []
    for seed in range(1, 101):
        drawn = load_scenario("fig1", seed).bodies
        spread.append([drawn[n].X_WO.translation - nominal[n].X_WO.translation for n in nominal])
    reach = np.abs(spread).max(axis=(0, 1))
    assert 0.014 < reach[:2].min() <= reach[:2].max() <= 0.015
    assert reach[2] == 0.0


def test_fig1_is_the_papers_table():
    fig1 = load_scenario("fig1")
    crumbs = {name for name, body in fig1.bodies.items() if is_crumb(body, fig1.robot.model)}
    assert crumbs == {"carrot", "tomato"}
    assert all(np.allclose(extents(fig1.bodies[name].shape), 0.025) for name in crumbs)
    assert {n: r.kind for n, r in fig1.regions.items()} == {"left_bin": "bin", "right_bin": "bin", "dustpan": "dustpan"}
    assert fig1.regions["left_bin"].X_WR.translation[1] > 0 > fig1.regions["right_bin"].X_WR.translation[1]
    pan, sponge = fig1.regions["dustpan"].X_WR, fig1.bodies["sponge"].X_WO
    assert np.all(np.abs(pan.actInv(sponge.translation)[:2]) < np.array(fig1.regions["dustpan"].size[:2]) / 2)
    assert set(parse_goal(fig1.goal)) == {
        ("in_bin", ("box", "right_bin")),
        ("in_bin", ("book", "right_bin")),
        ("in_bin", ("carrot", "dustpan")),
        ("in_bin", ("tomato", "dustpan")),
        ("in_bin", ("sponge", "left_bin")),
    }


def test_fig1_wipe_is_the_same_table_with_a_smaller_goal():
    fig1, wipe = load_scenario("fig1", 5), load_scenario("fig1_wipe", 5)
    assert {n: b.X_WO for n, b in fig1.bodies.items()} == {n: b.X_WO for n, b in wipe.bodies.items()}
    assert fig1.bodies.keys() == wipe.bodies.keys()
    assert set(parse_goal(wipe.goal)) < set(parse_goal(fig1.goal))
    assert {args[0] for _, args in parse_goal(wipe.goal)} == {"carrot", "tomato", "sponge"}


def test_the_flat_box_of_fig3_is_wider_than_the_gripper_opens_both_ways():
    fig3 = load_scenario("fig3")
    (box,) = fig3.bodies.values()
    assert extents(box.shape)[:2].min() > RobotModel(fig3.robot.model).gripper.stroke


@pytest.mark.parametrize("model", sorted(ROBOTS))
def test_what_scenes_assume_of_a_robot_is_what_the_robot_is(model):
    robot, facts = RobotModel(model), ROBOTS[model]
    assert facts.crumb_extent == robot.gripper.min_grasp_extent
    assert facts.links == set(robot.links)
    np.testing.assert_allclose(np.degrees(robot.q_max), facts.q_max_deg, atol=0.01)
    np.testing.assert_allclose(np.degrees(robot.q_min), -np.array(facts.q_max_deg), atol=0.01)


def test_scenes_and_simulation_know_the_same_robots():
    assert ROBOTS.keys() == MODELS.keys()
