"""Runs that something befalls: what is done is done to the world, told, and the same for the same seed."""

import json

import numpy as np
import pytest

from bt_tamp.cli import main
from bt_tamp.disturb.classes import KINDS, amended
from bt_tamp.disturb.names import CLASSES, can_be_reached, chosen
from bt_tamp.report.film import Filming, Recording, Shot
from bt_tamp.report.result import RunResult
from scenarios.library import scenario_path
from scenarios.load import load_scenario

CAN = "{cylinder: {radius: 0.033, height: 0.12}}"

DECLARED = """
disturbances:
  - {at: 0.1, move: {object: cube, by: [0.0, 0.03, 0.0]}}
  - {at: 0.2, take: {object: sponge}}
  - {phase: pre-grasp, push: {force: [100, 0, 0], seconds: 0.1}}
  - {at: 0.6, shift: {region: left_bin, by: [0.05, 0.10, 0.0]}}
  - {at: 1.2, bring: {object: sponge}}
  - {at: 1.4, goal: "(in_bin sponge left_bin)"}
  - {phase: stroke, action: wipe, take: {object: cube}}
  - {phase: pre-grasp, nth: 40, take: {object: cube}}
  - {at: 90, take: {object: cube}}
  - {at: 0.3, bring: {object: cube}}
"""


def test_at_most_one_class_in_ten_is_hopeless_and_each_is_declared_and_done():
    assert KINDS.keys() == CLASSES.keys()
    hopeless = [name for name, declared in CLASSES.items() if not declared.is_reachable]
    assert 0 < len(hopeless) <= len(CLASSES) / 10
    assert can_be_reached(("moved", "push"))
    assert not can_be_reached(("moved", "taken-for-good"))


def test_classes_are_chosen_by_name_all_or_none():
    assert chosen("moved, push,moved") == ("moved", "push")
    assert chosen("all") == tuple(CLASSES)
    assert chosen("none") == ()


def test_what_will_come_is_part_of_the_scene_and_wanted_late():
    scenario = amended(load_scenario("fig2"), ("new-object", "path-blocked"))
    assert scenario.late == scenario.bodies.keys() - load_scenario("fig2").bodies.keys()
    assert "(in_bin stray_box left_bin)" in scenario.goal
    assert "post" not in scenario.goal


@pytest.fixture(scope="module")
def declared(tmp_path_factory):
    """Two short runs of a scene that declares disturbances."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "scene.yaml").write_text(scenario_path("fig2").read_text() + DECLARED)
    for name in ("one", "two"):
        run = ["run", str(folder / "scene.yaml"), "--max-sim-time", "2.2", "--out", str(folder / name)]
        assert main(run) in (0, 12)
    return folder


def test_a_scenes_disturbances_befall_its_run_in_order_and_are_recorded(declared):
    result = RunResult.from_json((declared / "one" / "result.json").read_text())
    times = {one.sentence: round(one.t, 1) for one in result.disturbances}
    said = list(times)
    assert sorted(times.values()) == list(times.values())
    assert (times["cube was moved by 3 cm"], times["sponge was taken away"]) == (0.1, 0.2)
    assert "sponge appeared" in said
    assert result.goal == {"in_bin(sponge, left_bin)": False}
    assert set(json.loads((declared / "one" / "scenario.json").read_text())["late"]) == set()


def test_a_disturbed_run_is_the_same_run_again(declared):
    assert (declared / "one" / "events.jsonl").read_bytes() == (declared / "two" / "events.jsonl").read_bytes()


def test_the_story_tells_what_was_done(declared, capsys):
    assert main(["explain", str(declared / "one")]) == 0
    told = capsys.readouterr().out
    assert "DISTURBANCE" in told
    assert "cube was moved" in told


def test_the_story_tells_what_was_declared_and_did_not_come(declared, capsys):
    assert main(["explain", str(declared / "one")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "Disturbances[6] of the scene did not come: wipe's phase 'stroke' did not begin; those that did:" in told
    assert "pre-grasp" in told.partition("those that did: ")[2].partition(".")[0]
    assert "Disturbances[7] of the scene did not come: phase 'pre-grasp' began " in told
    assert "Disturbances[8] of the scene did not come: the run was over before 90 s." in told
    assert "Disturbances[9] of the scene did not come: there was nothing that it could be done to, or no room." in told
    assert "Disturbances[0]" not in told


def test_the_film_shows_what_was_there(declared, tmp_path):
    with Filming(Recording.load(declared / "one")) as filming:
        assert (filming.take(Shot(0.15, 1.0)) != filming.take(Shot(0.8, 1.0))).any()
    captions = Recording.load(declared / "one").timeline.notes
    assert any("sponge was taken away" in words for note in captions for words in note.sentences)


def test_the_film_shows_a_bin_where_it_was_shifted_to(declared):
    recording = Recording.load(declared / "one")
    before, after = (recording.scene_at(t).regions["left_bin"].X_WR.translation for t in (0.5, 0.8))
    assert after - before == pytest.approx([0.05, 0.10, 0.0])
    with Filming(recording) as filming:
        still, moved = (filming.take(Shot(t, 1.0)) for t in (0.5, 0.8))
        corners = np.array([[x, y, 0.06] for x in (-0.17, 0.17) for y in (-0.17, 0.17)]) + after
        spots = filming.backdrop.camera.project(corners)[:, :2].round().astype(int)
    changed = [(moved[y - 3 : y + 3, x - 3 : x + 3] != still[y - 3 : y + 3, x - 3 : x + 3]).any() for x, y in spots]
    assert all(changed)


@pytest.mark.parametrize("name", ["push", "new-object", "task-planner"])
def test_a_class_befalls_a_run_and_says_so(name, tmp_path):
    run = ["run", "fig2", "--seed", "7", "--disturb", name, "--max-sim-time", "1.5", "--out", str(tmp_path / "run")]
    assert main(run) in (0, 12)
    result = RunResult.from_json((tmp_path / "run" / "result.json").read_text())
    assert result.torque_limit_violations == 0
    assert all(one.name == name for one in result.disturbances)
    assert name != "task-planner" or len(result.disturbances) == 1


def test_the_open_loop_baseline_ends_where_its_plan_fails(tmp_path):
    (tmp_path / "scene.yaml").write_text(
        scenario_path("fig2").read_text()
        + "disturbances: [{phase: approach, action: pick, move: {object: sponge, by: [0.1, 0.0, 0.3]}}]\n"
    )
    run = ["run", str(tmp_path / "scene.yaml"), "--no-replan", "--out", str(tmp_path / "run")]
    assert main(run) == 12
    result = RunResult.from_json((tmp_path / "run" / "result.json").read_text())
    assert result.reason.startswith("open loop: pick(sponge, dustpan) failed")
    assert result.replans == 0


def test_a_motion_that_was_broken_off_is_not_judged_by_the_arm_that_stands_and_waits(tmp_path):
    (tmp_path / "scene.yaml").write_text(
        scenario_path("fig3").read_text()
        + "disturbances: [{phase: descend, action: drag, disorder: {what: pose-missing, seconds: 40}}]\n"
    )
    run = ["run", str(tmp_path / "scene.yaml"), "--max-sim-time", "9", "--out", str(tmp_path / "run")]
    assert main(run) == 12
    result = RunResult.from_json((tmp_path / "run" / "result.json").read_text())
    assert result.replans == 1
    assert all(motion.peak_n > 1.0 for motion in result.pressed)


def test_what_the_robot_moves_itself_is_no_consequence_of_eyes_that_fail(tmp_path):
    run = ["run", "fig3", "--disturb", "pose-missing", "--seed", "6", "--no-replan", "--out", str(tmp_path / "run")]
    assert main(run) == 12
    blind, moved = RunResult.from_json((tmp_path / "run" / "result.json").read_text()).disturbances
    assert (blind.phase, blind.mattered) == ("drag", False)
    assert moved.mattered


@pytest.mark.parametrize(("scene", "phase"), [("fig2", "stroke"), ("fig3", "drag")])
def test_a_stroke_is_blocked_while_it_presses_and_nothing_else_is(scene, phase, tmp_path):
    run = ["run", scene, "--disturb", "stroke-blocked", "--max-sim-time", "9", "--out", str(tmp_path / "run")]
    assert main(run) == 12
    (blocked,) = RunResult.from_json((tmp_path / "run" / "result.json").read_text()).disturbances
    assert (blocked.phase, blocked.answer) == (phase, "action_failed")


def test_what_is_brought_back_where_the_arm_waits_for_it_is_put_beside_it(tmp_path):
    text = scenario_path("fig3").read_text().replace("{box: [0.16, 0.22, 0.03]}", CAN)
    declared = "disturbances: [{at: 0.6, take: {object: box}}, {at: 5, bring: {object: box}}]\n"
    (tmp_path / "scene.yaml").write_text(text + declared)
    main(["run", str(tmp_path / "scene.yaml"), "--max-sim-time", "7", "--out", str(tmp_path / "run")])
    _, back = RunResult.from_json((tmp_path / "run" / "result.json").read_text()).disturbances
    assert back.t < 5.1
    assert back.sentence == "box appeared, beside where it was to be: the arm was there"


def test_the_story_tells_that_the_arm_waited_for_what_is_gone(tmp_path, capsys):
    (tmp_path / "scene.yaml").write_text(
        scenario_path("fig3").read_text() + "disturbances: [{at: 0.1, take: {object: box}}]\n"
    )
    assert main(["run", str(tmp_path / "scene.yaml"), "--out", str(tmp_path / "run")]) == 11
    assert main(["explain", str(tmp_path / "run")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "The arm waited for box to turn up again." in told
    assert "The arm had waited in vain since 2." in told
