"""A run that is interrupted, and what goes wrong then."""

import json
import os
import signal

import pytest

from bt_tamp.executive import loop
from bt_tamp.executive.seams import Seams
from bt_tamp.options import RunOptions
from bt_tamp.report.folder import RunFolder
from bt_tamp.report.recorder import RunRecorder
from bt_tamp.report.result import RunResult
from bt_tamp.report.state import RunState
from scenarios.load import load_scenario
from sim.disturbance import DisturbedPlant


def interrupted(plant, monkeypatch, folder):
    """fig2, its plant wrapped in one that interrupts the run."""
    monkeypatch.setattr(loop, "REAL", Seams(plant=plant))
    scenario = load_scenario("fig2")
    with RunRecorder(scenario, RunFolder(folder)) as recorder:
        return loop.run_scenario(scenario, RunOptions(max_sim_time=5.0), recorder)


def calling_at(t, callback):
    """A plant before each of whose steps, from t seconds on, something is called with the step's number from there."""

    def wrapped(plant):
        disturbed, count = DisturbedPlant(plant), iter(range(10**6))
        disturbed.before_step = lambda now: callback(next(count)) if now >= t else None
        return disturbed

    return wrapped


def test_an_error_while_the_arm_is_brought_to_rest_leaves_a_whole_folder(monkeypatch, tmp_path):
    def break_down(number):
        raise KeyboardInterrupt if number == 0 else RuntimeError("broken while braking")

    result = interrupted(calling_at(0.3, break_down), monkeypatch, tmp_path / "run")
    assert result.outcome == "crashed"
    assert "broken while braking" in result.reason
    assert "KeyboardInterrupt" in (tmp_path / "run" / "crash.txt").read_text()
    assert json.loads((tmp_path / "run" / "result.json").read_text())["outcome"] == "crashed"
    assert (tmp_path / "run" / "state.json").exists()
    assert (tmp_path / "run" / "signals.npz").exists()


class ImpatientRecorder(RunRecorder):
    """Somebody presses Ctrl-C just when the folder is written."""

    def finish(self, result, state):
        os.kill(os.getpid(), signal.SIGINT)
        super().finish(result, state)


def test_an_interruption_while_the_folder_is_written_leaves_it_whole(tmp_path):
    scenario = load_scenario("fig2")
    with ImpatientRecorder(scenario, RunFolder(tmp_path / "run")) as recorder:
        result = loop.run_scenario(scenario, RunOptions(max_sim_time=0.1), recorder)
    assert RunResult.from_json((tmp_path / "run" / "result.json").read_text()) == result
    assert (tmp_path / "run" / "state.json").exists()


def test_an_interruption_while_the_fingers_close_again_leaves_the_state_from_which_the_run_went_on(
    monkeypatch, tmp_path
):
    def interrupt(number):
        if number == 0:
            raise KeyboardInterrupt

    scenario = load_scenario("fig2")
    with RunRecorder(scenario, RunFolder(tmp_path / "first")) as recorder:
        loop.run_scenario(scenario, RunOptions(max_sim_time=3.6), recorder)
    start = RunState.from_json((tmp_path / "first" / "state.json").read_text())
    assert start.held == "sponge"
    monkeypatch.setattr(loop, "REAL", Seams(plant=calling_at(0.05, interrupt)))
    now = start.applied(scenario)
    with RunRecorder(now, RunFolder(tmp_path / "second")) as recorder:
        loop.run_scenario(now, RunOptions(), recorder, start)
    assert RunState.from_json((tmp_path / "second" / "state.json").read_text()) == start


def test_what_was_held_is_in_the_state_from_the_very_start(monkeypatch, tmp_path):
    states = []
    scenario = load_scenario("fig2")
    start = RunState((0.0,) * 7, 0.05, "sponge", 20.0, {}, {}, "clear-table", ())
    monkeypatch.setattr(
        loop, "take_up", lambda machine, start: states.append((tmp_path / "run/state.json").read_text())
    )
    with RunRecorder(scenario, RunFolder(tmp_path / "run")) as recorder:
        loop.run_scenario(scenario, RunOptions(max_sim_time=0.01), recorder, start)
    assert RunState.from_json(states[0]) == start


@pytest.mark.parametrize(("times", "said"), [(1, "the arm brought to rest"), (2, "twice, and ended at once")])
def test_an_interruption_ends_the_run_softly_and_a_second_one_at_once(times, said, monkeypatch, tmp_path):
    def interrupt(number):
        if number < times:
            raise KeyboardInterrupt

    result = interrupted(calling_at(0.3, interrupt), monkeypatch, tmp_path / "run")
    assert result.outcome == "interrupted"
    assert said in result.reason
