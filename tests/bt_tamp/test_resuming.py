"""Going on from where another run ended."""

import json
import shutil
import signal
import subprocess
import sys
import time

import pytest

from bt_tamp.cli import main
from bt_tamp.report.scenario_json import scenario_from_json
from bt_tamp.report.state import RunState


@pytest.fixture(scope="module")
def cut_short(tmp_path_factory):
    """A run that ended with the sponge in the hand."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    assert main(["run", "fig2", "--max-sim-time", "3.6", "--out", str(folder)]) == 12
    assert RunState.from_json((folder / "state.json").read_text()).held == "sponge"
    return folder


def test_a_run_goes_on_with_what_was_in_the_hand(cut_short, tmp_path, capsys):
    before = RunState.from_json((cut_short / "state.json").read_text())
    again = tmp_path / "again"
    assert main(["run", "--resume", str(cut_short), "--max-sim-time", "1.0", "--out", str(again)]) == 12
    result = json.loads((again / "result.json").read_text())
    assert not any(action.startswith("pick") for action in result["plan"])
    assert result["plan"][0].startswith("wipe")
    after = RunState.from_json((again / "state.json").read_text())
    assert after.held == "sponge"
    assert after.poses["cube"] == pytest.approx(before.poses["cube"], abs=1e-3)


def test_a_state_is_read_as_it_was_written_and_fits_its_scene_only(cut_short):
    text = (cut_short / "state.json").read_text()
    state = RunState.from_json(text)
    assert state.to_json() == text
    scenario = scenario_from_json((cut_short / "scenario.json").read_text())
    assert state.applied(scenario).goal == scenario.goal
    bodies = {name: body for name, body in scenario.bodies.items() if name != "cube"}
    with pytest.raises(ValueError, match="another scene: it knows no cube"):
        state.applied(type(scenario)(**(vars(scenario) | {"bodies": bodies})))


@pytest.mark.parametrize("arguments", [[], ["fig2", "--resume", "runs/x"]])
def test_a_run_begins_with_a_scene_or_where_another_ended(arguments, capsys):
    assert main(["run", *arguments]) == 2
    assert capsys.readouterr().err == "bt-tamp: expected either a SCENE or --resume DIR\n"


def test_a_run_goes_on_with_the_options_it_began_with_but_for_those_given(tmp_path, capsys):
    def choices(*arguments):
        assert main(["run", *map(str, arguments), "--max-sim-time", "0.1"]) == 12
        begun = (tmp_path / arguments[-1].name / "events.jsonl").read_text().splitlines()[0]
        return json.loads(begun)["choices"]

    first = choices("fig2", "--no-replan", "--tries", 7, "--out", tmp_path / "first")
    assert first == {"tries": 7, "replan": False, "max_sim_time": 0.1}
    assert "Again: bt-tamp run fig2 --seed 0 --tries 7 --no-replan --max-sim-time 0.1\n" in capsys.readouterr().out
    again = choices("--resume", tmp_path / "first", "--tries", 9, "--out", tmp_path / "again")
    assert again == {"tries": 9, "replan": False, "max_sim_time": 0.1}


def test_a_run_that_goes_on_has_its_seed(tmp_path, capsys):
    assert main(["run", "--resume", str(tmp_path), "--seed", "3"]) == 2
    assert "--seed 3: can't go with --resume" in capsys.readouterr().err


@pytest.mark.parametrize("choices", ['{"speed": 3}', '{"tries": 0}', "7", '{"domain": "a.pddl"}'])
def test_choices_that_no_run_wrote_are_refused(choices, cut_short, tmp_path, capsys):
    folder = tmp_path / "run"
    shutil.copytree(cut_short, folder)
    (folder / "events.jsonl").write_text(f'{{"t": 0, "kind": "run_started", "choices": {choices}}}\n')
    assert main(["run", "--resume", str(folder), "--out", str(tmp_path / "again")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "again").exists()


def test_a_folder_without_a_state_is_refused(tmp_path, capsys):
    (tmp_path / "events.jsonl").write_text("")
    assert main(["run", "--resume", str(tmp_path)]) == 2
    assert "scenario.json" in capsys.readouterr().err


def test_a_run_that_was_killed_goes_on_from_its_last_action(tmp_path):
    folder = tmp_path / "run"
    command = [sys.executable, "-m", "bt_tamp", "run", "fig2", "--out", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        while run.poll() is None:
            events = folder / "events.jsonl"
            # In the middle of the next action: while the state is being written half of it may lie beside it.
            if events.is_file() and '"phase"' in events.read_text().partition('"action_done"')[2]:
                run.send_signal(signal.SIGKILL)
            time.sleep(0.02)
    assert run.returncode == -signal.SIGKILL
    assert not (folder / "result.json").exists()
    assert not list(folder.glob(".state*"))
    assert RunState.from_json((folder / "state.json").read_text()).held == "sponge"
    again = tmp_path / "again"
    assert main(["run", "--resume", str(folder), "--max-sim-time", "0.6", "--out", str(again)]) == 12
    assert json.loads((again / "result.json").read_text())["plan"][0].startswith("wipe")
