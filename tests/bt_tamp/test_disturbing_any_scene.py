"""Whatever the scene, and however much comes at once: who disturbs never ends a run by an error of its own."""

import json

import numpy as np
import pytest

from bt_tamp.cli import main
from bt_tamp.disturb.classes import KINDS, amended
from bt_tamp.disturb.deed import Occasion
from bt_tamp.executive.build import build
from bt_tamp.options import RunOptions
from planner.motion.motion_planner import MotionPlanner
from scenarios.library import scenario_path
from scenarios.load import load_scenario


def outcome(folder):
    return json.loads((folder / "result.json").read_text())["outcome"]


def run(tmp_path, *arguments):
    main(["run", *map(str, arguments), "--out", str(tmp_path / "run"), "--force"])
    return tmp_path / "run"


@pytest.mark.parametrize("scene", ["fig2", "fig3"])
def test_a_class_that_a_scene_has_no_place_for_does_not_befall_it(scene):
    scenario = amended(load_scenario(scene), KINDS)
    machine = build(scenario, RunOptions(), lambda kind, **data: None, lambda why: None)
    rng = np.random.default_rng(0)
    now = Occasion(0.0, machine.plant.observe(), machine, MotionPlanner(machine.robot), rng)
    drawn = {name: kind.draw(now) for name, kind in KINDS.items() if kind.draw is not None}
    assert drawn["push"] is not None
    assert (drawn["new-crumb"] is None) == (scene == "fig3")
    machine.plant.close()


@pytest.mark.parametrize("second", ["take: {object: box}", "move: {object: box, by: [0.05, 0, 0]}"])
def test_two_things_declared_for_the_same_instant_come_one_after_the_other(second, tmp_path):
    declared = f"\ndisturbances:\n  - {{at: 0.1, take: {{object: box}}}}\n  - {{at: 0.1, {second}}}\n"
    (tmp_path / "scene.yaml").write_text(scenario_path("fig3").read_text() + declared)
    folder = run(tmp_path, tmp_path / "scene.yaml", "--max-sim-time", "0.5")
    assert outcome(folder) == "gave_up"


def test_a_run_that_goes_on_is_disturbed_like_any_other(tmp_path):
    cut_short = run(tmp_path / "first", "fig3", "--max-sim-time", "0.4")
    again = run(tmp_path, "--resume", cut_short, "--disturb", "new-object", "--max-sim-time", "0.4")
    assert outcome(again) == "gave_up"


def test_what_the_scene_knows_already_is_not_brought_into_it_again():
    once = amended(load_scenario("fig3"), ("sponge-covered",))
    assert once.late == {"stray_box"}
    assert "stray_box" not in once.goal
    twice = amended(once, ("new-object", "new-object"))
    assert twice.bodies == once.bodies
    assert twice.goal.count("stray_box") == 1
