"""Dragging aside what can't be taken up."""

from dataclasses import replace

import numpy as np
import pytest
from bench import Bench, action, scene_with, with_pose
from py_trees.common import Status

from bt_tamp.executive.build import build_planner
from bt_tamp.options import RunOptions
from planner.failure import RefinementFailure
from planner.refinement import Budget, Hints, Refinement
from planner.search_then_sample import Solution
from planner.task.facts import place_of
from scenarios.shapes import Box, extents
from sim.scene import SceneState
from skills.drag_aside import GAP, RIM
from skills.towing import footprint, margin_inside

ASIDE = action("drag_aside(box, table)")
WIDE = Box((0.14, 0.15, 0.12))


def wide_box(*names):
    """The box of fig1, too wide for the hand whichever way it is taken."""
    scenario = scene_with("box", *names)
    return replace(scenario, bodies={**scenario.bodies, "box": _wide(scenario.bodies["box"])})


def _wide(body):
    X_WO = body.X_WO.copy()
    X_WO.translation[2] = 0.05 + WIDE.size[2] / 2
    return replace(body, shape=WIDE, X_WO=X_WO)


def test_what_is_too_wide_to_grasp_is_dragged_aside_and_nothing_else_moves():
    bench = Bench(wide_box("book", "carrot"))
    before = bench.scene
    assert isinstance(bench.refine(action("pick(box, table)")), RefinementFailure)
    assert isinstance(bench.refine(action("drag(box, table)")), RefinementFailure)
    assert bench.do("drag_aside(box, table)") is Status.SUCCESS
    shifts = {
        name: np.linalg.norm(X.translation - before.poses[name].translation) for name, X in bench.scene.poses.items()
    }
    assert shifts["box"] > 0.05
    assert max(shifts["book"], shifts["carrot"]) < 0.002
    assert place_of(bench.scene, "box") == "table"
    assert bench.peak_force < 40.0


@pytest.mark.parametrize("seed", range(4))
def test_it_ends_on_the_table_and_clear_of_everything_else(seed):
    bench = Bench(wide_box("book", "carrot", "tomato"))
    found = bench.skills["drag_aside"].refine(ASIDE, bench.scene, np.random.default_rng(seed), Budget(), Hints())
    assert isinstance(found, Refinement)
    after = bench.skills["drag_aside"].predict(bench.scene, found)
    body, X_WO = bench.scene.scenario.bodies["box"], after.poses["box"]
    assert min(margin_inside(bench.scene.scenario.table, corner) for corner in footprint(body, X_WO)) >= RIM - 1e-6
    for name in ("book", "carrot", "tomato"):
        assert gap(bench.scene.scenario, after, name) >= GAP - 1e-3


def gap(scenario, scene, name):
    """Metres between the box and another body along that level axis of either on which they are farthest apart."""
    corners = {who: np.array(footprint(scenario.bodies[who], scene.poses[who]))[:, :2] for who in ("box", name)}
    axes = [scene.poses[who].rotation[:2, i] for who in corners for i in range(2)]
    spans = [[(points @ axis).min(), (points @ axis).max()] for axis in axes for points in corners.values()]
    return max(max(b[0] - a[1], a[0] - b[1]) for a, b in zip(spans[::2], spans[1::2], strict=True))


def test_a_wide_box_in_a_strokes_way_is_dragged_aside_before_the_crumb_is_wiped():
    scenario = replace(wide_box("carrot", "sponge"), goal="(and (in_bin carrot dustpan))")
    scenario = with_pose(scenario, "box", 0.68, -0.1)
    scene = SceneState.initial(scenario, 0.11)
    bench = Bench(scenario)
    thinker = build_planner(scenario, RunOptions(), bench.robot, lambda kind, **data: None)
    planner = thinker.planner
    solution = planner.search.plan(scene, thinker.goal, np.random.default_rng(0), planner.thinking.work)
    assert isinstance(solution, Solution), solution
    names = [step.name for step in solution.plan.actions]
    assert names == ["drag_aside", "pick", "wipe"]
    moved = solution.scenes[0].poses["box"].translation - scene.poses["box"].translation
    assert np.linalg.norm(moved) > 0.05
    assert extents(scenario.bodies["box"].shape).min() > bench.robot.gripper.stroke
