import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from bt_tamp.report.folder import FolderError, RunFolder, replacing
from bt_tamp.report.recorder import RunRecorder
from bt_tamp.report.scenario_json import scenario_from_json, scenario_to_json
from bt_tamp.report.signals import Contact, Reference, Signals, SignalTable
from scenarios.library import list_scenarios
from scenarios.load import load_scenario
from sim.plant import Observation
from sim.wrench import Wrench

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def observation(t: float) -> Observation:
    return Observation(
        t=t,
        q=np.arange(7) + t,
        v=np.zeros(7),
        tau=np.ones(7),
        opening=0.05,
        opening_velocity=0.0,
        grip_force=3.0,
        wrist=Wrench(np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0])),
        poses={"cube": pin.SE3(np.eye(3), np.array([0.1, 0.2, t]))},
        velocities={"cube": np.zeros(6)},
    )


@pytest.mark.parametrize("name", list_scenarios())
def test_a_scenario_comes_back_from_its_json(name: str) -> None:
    text = scenario_to_json(load_scenario(name, seed=5))
    again = scenario_to_json(scenario_from_json(text))
    assert NUMBER.sub("", again) == NUMBER.sub("", text)
    assert [*map(float, NUMBER.findall(again))] == pytest.approx([*map(float, NUMBER.findall(text))], abs=1e-12)


def test_what_is_no_recorded_scenario_is_refused() -> None:
    with pytest.raises(ValueError, match="not a recorded scenario"):
        scenario_from_json("{}")


def test_signals_come_back_from_their_file(tmp_path: Path) -> None:
    table = SignalTable(["cube"])
    times = np.arange(3000) * 0.01
    for t in times:
        table.add(observation(float(t)), Reference(np.zeros(7), np.array([0.1, 0.2, 0.3]), 10.0), 9.5)
    table.add_contacts(0.5, [Contact("cube", "table", np.zeros(3), np.array([0.0, 0.0, 2.0]))])
    table.save(tmp_path / "signals.npz")

    signals = Signals.load(tmp_path / "signals.npz")

    np.testing.assert_allclose(signals.t, times)
    np.testing.assert_allclose(signals.q[-1], np.arange(7) + times[-1])
    np.testing.assert_allclose(signals.wrist[0], [1, 2, 3, 4, 5, 6])
    np.testing.assert_allclose(signals.poses[:, 0, 2], times)
    np.testing.assert_allclose(signals.force_ref, 10.0)
    assert [str(signals.contact_names[index]) for index in signals.contact_pair[0]] == ["cube", "table"]
    np.testing.assert_allclose(signals.contact_f, [[0.0, 0.0, 2.0]])


def test_a_recorder_samples_at_its_rate_however_often_it_is_called(tmp_path: Path) -> None:
    scenario = load_scenario("fig2")
    poses = {name: body.X_WO for name, body in scenario.bodies.items()}
    folder = RunFolder(tmp_path / "run")
    with RunRecorder(scenario, folder, rate=100.0) as recorder:
        recorder.event("run_started", 0.0, scene="fig2", seed=0)
        for tick in range(500):
            seen = replace(observation(tick * 0.002), poses=poses)
            recorder.sample(seen, Reference(np.zeros(7)), 0.0)
    assert len(Signals.load(tmp_path / "run" / "signals.npz").t) == 100


def test_a_folder_is_made_at_the_first_write_only(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "run")
    folder.check()
    assert not (tmp_path / "run").exists()
    folder.write("note.txt", "hello")
    assert (tmp_path / "run" / "note.txt").read_text() == "hello"


def test_force_clears_the_run_that_lies_there_and_nothing_else(tmp_path: Path) -> None:
    for name in ("result.json", "video.mp4", "my-notes.txt"):
        (tmp_path / name).write_text("old")
    RunFolder(tmp_path, force=True).open()
    assert sorted(path.name for path in tmp_path.iterdir() if path.is_file()) == ["my-notes.txt"]


def test_a_folder_with_a_result_is_refused(tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text("{}")
    with pytest.raises(FolderError, match="--force"):
        RunFolder.for_run("scene", 0, tmp_path, force=False)


@pytest.mark.parametrize("force", [False, True])
def test_a_folder_of_other_things_is_refused_and_left_alone(tmp_path: Path, force: bool) -> None:
    (tmp_path / "plans").mkdir()
    (tmp_path / "plans" / "mine.txt").write_text("dear")
    with pytest.raises(FolderError, match="holds other things than a run"):
        RunFolder(tmp_path, force=force).write("result.json", "{}")
    assert (tmp_path / "plans" / "mine.txt").read_text() == "dear"


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path: Path) -> None:
    target = tmp_path / "file.txt"
    target.write_text("old")

    def write_and_fail() -> None:
        with replacing(target) as partial:
            partial.write_text("half")
            raise RuntimeError("on purpose")

    with pytest.raises(RuntimeError, match="on purpose"):
        write_and_fail()
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]
