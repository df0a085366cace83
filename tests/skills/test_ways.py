"""Ways of the hand that are sought again: only what has changed is looked at, and it is looked at."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from bench import Bench, action, scene_with, with_pose
from pinocchio import SE3
from py_trees.common import Status

from planner.refinement import Budget, Hints, Refinement
from sim.scene import SceneState

PICK = action("pick(box, table)")


@pytest.fixture
def bench() -> Bench:
    return Bench(scene_with("box", "carrot"))


def _pick(bench: Bench, scene: SceneState, sample: object = None) -> tuple[Refinement, int]:
    """Box picked in a scene with the sample to be tried first, and the configurations checked for that."""
    counts = bench.motion.work.counts
    before = counts.get("exact_checks", 0) + counts.get("checks", 0)
    hints = Hints(first=() if sample is None else (sample,))
    found = bench.skills["pick"].refine(PICK, scene, np.random.default_rng(0), Budget(), hints)
    assert isinstance(found, Refinement), found
    return found, counts["exact_checks"] + counts["checks"] - before


def _is_free(bench: Bench, scene: SceneState, found: Refinement) -> bool:
    ready = replace(scene, opening=found.phases[0].opening)
    moves = [phase for phase in found.phases if phase.name in ("pre-grasp", "approach")]
    return all(bench.motion.audit(ready, phase.trajectory, phase.allowed) is None for phase in moves)


def test_a_way_that_is_sought_again_costs_next_to_nothing(bench):
    first, checks = _pick(bench, bench.scene)
    again, fewer = _pick(bench, bench.scene, first.sample)
    assert again.phases[0].trajectory is first.phases[0].trajectory
    assert fewer < 0.02 * checks


def test_what_moved_elsewhere_costs_one_look(bench):
    first, checks = _pick(bench, bench.scene)
    X_WO = bench.scene.poses["carrot"]
    aside = bench.scene.moved("carrot", SE3(X_WO.rotation, X_WO.translation + np.array([0.01, 0.0, 0.0])))
    again, fewer = _pick(bench, aside, first.sample)
    assert again.phases[0].trajectory is first.phases[0].trajectory
    assert 0.02 * checks < fewer < checks


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
def test_what_came_to_be_in_the_way_is_avoided(bench, share):
    first, _ = _pick(bench, bench.scene)
    reach = first.phases[0].trajectory
    spot = bench.robot.X_WG(reach.at(share * reach.duration)[0])
    walled = bench.scene.moved("carrot", SE3(np.eye(3), spot.translation + np.array([0.0, 0.0, 0.06])))
    assert not _is_free(bench, walled, first)
    again, _ = _pick(bench, walled, first.sample)
    assert again.phases[0].trajectory is not first.phases[0].trajectory
    assert _is_free(bench, walled, again)


def test_a_shifted_bin_is_looked_at(bench):
    first, _ = _pick(bench, bench.scene)
    reach = first.phases[0].trajectory
    scenario = bench.scene.scenario
    bin_ = scenario.regions["left_bin"]
    spot = bench.robot.X_WG(reach.at(0.6 * reach.duration)[0]).translation
    shifted = replace(bin_, X_WR=SE3(bin_.X_WR.rotation, spot + np.array([0.0, bin_.size[1] / 2, 0.0])))
    scene = replace(bench.scene, scenario=replace(scenario, regions={**scenario.regions, "left_bin": shifted}))
    assert not _is_free(bench, scene, first)
    found = bench.skills["pick"].refine(PICK, scene, np.random.default_rng(0), Budget(), Hints(first=(first.sample,)))
    assert not isinstance(found, Refinement) or _is_free(bench, scene, found)


def test_an_object_that_lies_elsewhere_gets_a_way_of_its_own(bench):
    first, _ = _pick(bench, bench.scene)
    other = Bench(with_pose(scene_with("box", "carrot"), "box", 0.66, 0.1)).scene
    again, _ = _pick(bench, replace(bench.scene, poses=other.poses), first.sample)
    grasp = bench.robot.X_WG(again.phases[1].trajectory.end)
    np.testing.assert_allclose(grasp.homogeneous, (other.poses["box"] * first.sample.X_OG).homogeneous, atol=1e-6)


def test_a_way_with_the_hand_as_open_or_holding_otherwise_is_another(bench):
    lifted = Bench(scene_with("box"))
    assert lifted.do("pick(box, table)") is Status.SUCCESS
    scene, place = lifted.scene, action("place(box, table)")

    def placed(scene: SceneState, sample: object = None) -> Refinement:
        hints = Hints(first=() if sample is None else (sample,))
        found = lifted.skills["place"].refine(place, scene, np.random.default_rng(0), Budget(), hints)
        assert isinstance(found, Refinement), found
        return found

    first = placed(scene)
    assert placed(scene, first.sample).phases[0].trajectory is first.phases[0].trajectory
    held = scene.held
    assert held is not None
    turned = replace(held, X_GO=held.X_GO * SE3(pin.exp3(np.array([0.0, 0.0, 2e-3])), np.zeros(3)))
    for other in (replace(scene, opening=scene.opening + 2e-3), replace(scene, held=turned)):
        assert placed(other, first.sample).phases[0].trajectory is not first.phases[0].trajectory


def test_what_has_come_to_where_the_fingers_will_open_is_avoided():
    bench = Bench(scene_with("sponge", "carrot"))
    grasped = bench.refine(action("pick(sponge, dustpan)"))
    assert isinstance(grasped, Refinement)
    scene, place = bench.skills["pick"].predict(bench.scene, grasped), action("place(sponge, table)")
    first = bench.skills["place"].refine(place, scene, np.random.default_rng(0), Budget(), Hints())
    assert isinstance(first, Refinement)
    X_WG = bench.robot.X_WG({phase.name: phase for phase in first.phases}["descend"].trajectory.end)
    assert scene.held is not None
    aside = X_WG.translation + 0.07 * X_WG.rotation[:, 1]
    height = float((X_WG * scene.held.X_GO).translation[2]) - 0.0075
    beside = scene.moved("carrot", SE3(np.eye(3), np.array([*aside[:2], height])))
    again = bench.skills["place"].refine(
        place, beside, np.random.default_rng(1), Budget(), Hints(first=(first.sample,))
    )
    assert isinstance(again, Refinement)
    assert again.sample != first.sample
