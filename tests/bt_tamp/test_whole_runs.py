"""Whole runs through the command line, in processes of their own."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from skills.catalogue import phases

PAPER_PLAN = {
    "drag(book, table)",
    "pick(book, table)",
    "place(book, right_bin)",
    "pick(box, table)",
    "place(box, right_bin)",
    "pick(sponge, dustpan)",
    "wipe(carrot, table, dustpan)",
    "wipe(tomato, table, dustpan)",
    "place(sponge, left_bin)",
}


def start(scene, folder, hash_seed, *options):
    """A run in the background."""
    command = [sys.executable, "-m", "bt_tamp", "run", scene, "--out", str(folder), *options]
    environment = {**os.environ, "PYTHONHASHSEED": str(hash_seed), "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def finished(process):
    """Exit code 0, or the run's own words."""
    output, _ = process.communicate(timeout=900)
    assert process.returncode == 0, output[-3000:]
    return output


@pytest.fixture(scope="module")
def fig1(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "fig1"
    finished(start("fig1", folder, 0))
    return folder


def test_fig1_goes_from_a_scene_file_to_a_clean_table_by_the_papers_nine_actions(fig1):
    result = json.loads((fig1 / "result.json").read_text())
    assert result["outcome"] == "goal_reached"
    assert all(result["goal"].values())
    assert len(result["plan"]) == 9
    assert set(result["plan"]) == PAPER_PLAN
    assert result["executed"] == result["plan"]
    assert any(sentence.startswith("book cannot be grasped as it lies") for sentence in result["learned"])
    assert result["torque_limit_violations"] == 0
    assert result["unintended_contacts"] == []
    assert result["peak_contact_force_n"] < 60.0


def test_every_phase_of_fig1_is_one_that_its_skill_declares_in_that_order(fig1):
    events = [json.loads(line) for line in (fig1 / "events.jsonl").read_text().splitlines()]
    begun = {}
    for event in events:
        if event["kind"] == "phase":
            begun.setdefault(event["action"], []).append(event["phase"])
    assert len(begun) == 9
    for action, names in begun.items():
        declared = phases()[action.partition("(")[0]]
        # Fingers that stand about nothing need not be drawn back.
        assert names == [name for name in declared if name != "draw back"]


def test_fig1_leaves_a_complete_folder(fig1):
    assert (fig1 / "events.jsonl").stat().st_size > 0
    assert len(list((fig1 / "pddl").glob("round-*-domain.pddl"))) == 2
    assert len(list((fig1 / "plans").glob("*.txt"))) == 2
    assert list((fig1 / "trees").glob("*end*.svg"))
    with np.load(fig1 / "signals.npz") as signals:
        assert len(signals["t"]) > 3000


def test_fig1_truly_wiped_with_the_force_that_was_asked_for(fig1):
    pressed = json.loads((fig1 / "result.json").read_text())["pressed"]
    strokes = [motion for motion in pressed if motion["action"].startswith("wipe")]
    assert len(strokes) == 2
    for stroke in strokes:
        assert abs(stroke["mean_n"] - stroke["target_n"]) < 0.05 * stroke["target_n"]
        assert stroke["rms_error_n"] < 0.1 * stroke["target_n"]


def test_the_same_seed_gives_the_same_run_whatever_the_hash_seed(tmp_path):
    folders = [tmp_path / "one", tmp_path / "two"]
    runs = [start("fig3", folder, seed, "--seed", "5") for seed, folder in zip((1, 2), folders, strict=True)]
    for run in runs:
        finished(run)
    first, second = folders
    assert (first / "events.jsonl").read_bytes() == (second / "events.jsonl").read_bytes()
    with np.load(first / "signals.npz") as one, np.load(second / "signals.npz") as two:
        assert np.array_equal(one["poses"], two["poses"])
        assert np.array_equal(one["tau"], two["tau"])
