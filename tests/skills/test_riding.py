"""What stands on the object in the hand is not driven into anything."""

from dataclasses import replace

import numpy as np
import pytest
from bench import Bench, action, scene_with, with_pose
from pinocchio import SE3

from planner.refinement import Budget, Hints, Refinement
from scenarios.scenario import Fixture
from scenarios.shapes import Box
from sim.scene import SceneState
from skills.riding import driven_into


@pytest.fixture
def laden() -> tuple[Bench, SceneState]:
    """The sponge in the hand as predicted, and a box on it."""
    scenario = with_pose(scene_with("box", "sponge"), "box", 0.7, 0.3)
    small = replace(scenario.bodies["box"], shape=Box((0.05, 0.05, 0.07)), mass=0.15)
    bench = Bench(replace(scenario, bodies={**scenario.bodies, "box": small}))
    grasped = bench.refine(action("pick(sponge, dustpan)"))
    assert isinstance(grasped, Refinement)
    scene = bench.skills["pick"].predict(bench.scene, grasped)
    on_it = scene.poses["sponge"].translation + np.array([0.0, 0.0, 0.02 + 0.035 + 5e-4])
    return bench, scene.moved("box", SE3(np.eye(3), on_it))


def test_what_rides_along_keeps_clear_of_what_stands_there(laden):
    bench, scene = laden
    found = bench.skills["place"].refine(action("place(sponge, table)"), scene, np.random.default_rng(0), *_plain())
    assert isinstance(found, Refinement), found
    moves = [phase.trajectory for phase in found.phases[:2]]
    assert driven_into(bench.robot, scene, {"box"}, moves) is None
    X_WG = bench.robot.X_WG(moves[0].at(0.7 * moves[0].duration)[0])
    X_WB = X_WG * bench.robot.X_WG(scene.q).inverse() * scene.poses["box"]
    post = Fixture("post", Box((0.02, 0.02, 0.02)), X_WB, 0.5, (1.0, 1.0, 1.0, 1.0))
    walled = replace(scene, scenario=replace(scene.scenario, fixtures={"post": post}))
    assert driven_into(bench.robot, walled, {"box"}, moves) == "post"
    again = bench.skills["place"].refine(
        action("place(sponge, table)"), walled, np.random.default_rng(0), *_plain(found.sample)
    )
    assert isinstance(again, Refinement), again
    assert driven_into(bench.robot, walled, {"box"}, [phase.trajectory for phase in again.phases[:2]]) is None


def _plain(*first: object) -> tuple[Budget, Hints]:
    return Budget(), Hints(first=first)
