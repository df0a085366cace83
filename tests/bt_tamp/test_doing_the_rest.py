"""What is proven out of reach while the robot is at work doesn't keep it from the rest."""

import json

import pytest

from bt_tamp.cli import main

SCENE = """
version: 1
name: two
robot: {model: iiwa14_wsg50, base: {xyz: [0, 0, 0]}}
table: {size: [0.44, 0.68, 0.05], pose: {xyz: [0.62, 0.06, 0.025]}, friction: 0.5}
regions:
  crate: {kind: bin, size: [0.36, 0.36, 0.13], wall: 0.01, pose: {xyz: [0.05, -0.62, -0.145]}}
objects:
  can: {shape: {box: [0.05, 0.05, 0.1]}, mass: 0.3, friction: 0.6, pose: {on: table, xy: [0.6, 0.1]}}
  jar: {shape: {box: [0.05, 0.05, 0.1]}, mass: 0.3, friction: 0.6, pose: {on: table, xy: [0.6, -0.1]}}
goal: clear-table
disturbances:
  - {at: 0.6, move: {object: can, by: [2.5, 0, -0.2]}}
"""


@pytest.fixture(scope="module")
def thrown_away(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    (folder / "two.yaml").write_text(SCENE)
    assert main(["run", str(folder / "two.yaml"), "--out", str(folder / "run")]) == 10
    return folder / "run"


def test_the_rest_is_done_before_the_verdict_is_given(thrown_away):
    result = json.loads((thrown_away / "result.json").read_text())
    assert result["places"] == {"can": "floor", "jar": "crate"}
    assert result["goal"] == {"put_away(can)": False, "put_away(jar)": True}
    assert result["reason"].startswith("no sequence of actions leads to put_away(can): can lies neither on")
    assert result["reason"].endswith("; the rest is done")


def test_the_story_says_so(thrown_away, capsys):
    assert main(["explain", str(thrown_away)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "There was no way to put_away(can): " in told
    assert "The rest was to be done first." in told
    assert "The plan was dropped: with the rest done, a way for can is looked for once more. A new one" in told


def test_before_anything_has_moved_it_is_told_at_once(tmp_path):
    (tmp_path / "two.yaml").write_text(SCENE.replace("mass: 0.3", "mass: 30.0", 1))
    assert main(["run", str(tmp_path / "two.yaml"), "--out", str(tmp_path / "run")]) == 10
    assert json.loads((tmp_path / "run" / "result.json").read_text())["executed"] == []


def test_what_only_samples_speak_against_is_put_off_too(tmp_path):
    covered = """
  covered: {kind: bin, size: [0.3, 0.3, 0.13], wall: 0.01, pose: {xyz: [0.05, 0.62, -0.145]}}
fixed:
  lid: {shape: {box: [0.4, 0.4, 0.02]}, pose: {xyz: [0.05, 0.62, -0.03]}}
objects:"""
    goal = '{at: 0.6, goal: "(and (in_bin can covered) (in_bin jar crate))"}'
    scene = SCENE.replace("\nobjects:", covered, 1).partition("disturbances:")[0] + f"disturbances:\n  - {goal}\n"
    (tmp_path / "two.yaml").write_text(
        scene.replace("goal: clear-table", 'goal: "(and (in_bin can crate) (in_bin jar crate))"')
    )
    code = main(["run", str(tmp_path / "two.yaml"), "--out", str(tmp_path / "run")])
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert code in (10, 11)
    assert result["goal"] == {"in_bin(can, covered)": False, "in_bin(jar, crate)": True}
    assert result["reason"].endswith("; the rest is done")


def test_no_verdict_is_given_on_what_has_changed_while_it_was_thought_over(tmp_path):
    far = SCENE.replace("[0.05, -0.62, -0.145]", "[0.05, -2.62, -0.145]")
    shift = "{at: 1.0, shift: {region: crate, by: [0, 2.0, 0]}}"
    (tmp_path / "far.yaml").write_text(far.replace("{at: 0.6, move: {object: can, by: [2.5, 0, -0.2]}}", shift))
    assert main(["run", str(tmp_path / "far.yaml"), "--out", str(tmp_path / "run")]) == 0
