import ctypes
import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path
from threading import Timer

import pytest
from rich.console import Console

from bt_tamp.cli import main
from bt_tamp.commands.sweep import seeds
from bt_tamp.errors import UserError
from bt_tamp.options import RunOptions
from bt_tamp.report.result import Befallen, RunResult
from bt_tamp.sweep import Finished, Job, patience, run_jobs
from bt_tamp.sweep_store import SweepStore
from bt_tamp.sweep_table import print_table, summaries


def job(seed: int, scene: str = "fig2") -> Job:
    return Job(scene, RunOptions(seed=seed))


def reached(seed: int, robot_s: float) -> Finished:
    result = RunResult("fig2", seed, "goal_reached", "", {}, robot_s=robot_s)
    return Finished(job(seed), "goal_reached", "", result.to_json())


def test_seeds_are_a_half_open_range_or_one_number() -> None:
    assert list(seeds("2:5")) == [2, 3, 4]
    assert list(seeds("7")) == [7]


def test_a_process_that_vanishes_and_one_that_fails_cost_no_other_run() -> None:
    def work(given: Job) -> Finished:
        if given.options.seed == 1:
            os._exit(9)
        if given.options.seed == 2:
            raise RuntimeError("broken on purpose")
        return Finished(given, "goal_reached", "")

    outcomes = {done.job.options.seed: done.outcome for done in run_jobs(map(job, range(5)), 2, work)}

    assert outcomes == {0: "goal_reached", 1: "killed", 2: "crashed", 3: "goal_reached", 4: "goal_reached"}


def test_a_process_that_vanishes_between_two_runs_costs_neither() -> None:
    def work(given: Job) -> Finished:
        Timer(0.3, os._exit, (9,)).start()
        return Finished(given, "goal_reached", "")

    outcomes = []
    for done in run_jobs(map(job, range(2)), 1, work):
        outcomes.append(done.outcome)
        time.sleep(1.5)

    assert outcomes == ["goal_reached", "goal_reached"]


def test_a_sweep_whose_progress_nobody_reads_any_more_comes_to_its_end(tmp_path: Path) -> None:
    store = tmp_path / "s.db"
    command = [sys.executable, "-m", "bt_tamp", "sweep", "fig2", "--seeds", "0:2", "--max-sim-time", "0.1"]
    command += ["--jobs", "1", "--store", str(store)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as sweep:
        assert sweep.stderr is not None
        sweep.stderr.close()
        assert sweep.wait() == 0
    with SweepStore(store) as opened:
        assert len(opened.everything()) == 2


def test_a_run_that_hangs_in_native_code_is_ended_recorded_and_costs_no_other() -> None:
    def work(given: Job) -> Finished:
        if given.options.seed == 1:
            # Unlike CDLL it keeps the interpreter's lock: no thread of the process runs any more.
            ctypes.PyDLL(None).sleep(600)
        return Finished(given, "goal_reached", "", str(os.getpid()))

    def allowed(given: Job) -> float:
        return 3.0 if given.options.seed == 1 else 120.0

    found = {done.job.options.seed: done for done in run_jobs(map(job, range(4)), 1, work, allowed)}
    assert [found[seed].outcome for seed in range(4)] == ["goal_reached", "killed", "goal_reached", "goal_reached"]
    assert found[1].reason == "it had not come to its end after 3 s of real time, and was ended"
    assert found[1].tries == 1
    wait_for_the_end_of([int(found[0].result or 0)])


def test_ctrl_c_reaches_the_parent_alone_which_decides_what_ends() -> None:
    def work(given: Job) -> Finished:
        is_deaf = signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())
        return Finished(given, "goal_reached", "deaf" if is_deaf else "listening")

    assert [done.reason for done in run_jobs(map(job, range(3)), 2, work)] == ["deaf"] * 3
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_a_run_gets_more_real_time_the_longer_it_may_simulate() -> None:
    short, long = (patience(Job("fig2", RunOptions(max_sim_time=seconds))) for seconds in (10.0, 1000.0))
    assert 60.0 < short < long
    assert long > 3 * 1000.0


def test_the_libraries_of_a_run_keep_to_one_thread() -> None:
    def work(given: Job) -> Finished:
        return Finished(given, os.environ["OMP_NUM_THREADS"], "")

    assert [done.outcome for done in run_jobs([job(0)], 1, work)] == ["1"]


def test_a_result_is_found_again_by_scene_seed_and_options(tmp_path: Path) -> None:
    with SweepStore(tmp_path / "s.db") as store:
        store.add(reached(3, 12.5))
    with SweepStore(tmp_path / "s.db") as store:
        row = store.get(job(3))
        others = [job(4), job(3, "fig1"), Job("fig2", RunOptions(seed=3, contact="impedance"))]
        others += [Job("fig2", RunOptions(seed=3), digest="of another text")]

        assert row is not None
        assert json.loads(row.result or "")["robot_s"] == 12.5
        assert store.stored(others) == {}


def test_a_repeated_run_replaces_the_one_that_was_killed(tmp_path: Path) -> None:
    with SweepStore(tmp_path / "s.db") as store:
        store.add(Finished(job(0), "killed", "its process vanished"))
        store.add(reached(0, 1.0))

        assert [row.outcome for row in store.stored([job(0)]).values()] == ["goal_reached"]


def test_a_file_that_is_no_store_is_refused(tmp_path: Path) -> None:
    (tmp_path / "s.db").write_text("no database, " * 100)
    with pytest.raises(UserError, match=r"s\.db"):
        SweepStore(tmp_path / "s.db")


def test_the_table_counts_goals_takes_medians_and_names_failures(tmp_path: Path) -> None:
    with SweepStore(tmp_path / "s.db") as store:
        for done in (reached(0, 10.0), reached(1, 30.0), reached(2, 20.0), Finished(job(3), "killed", "gone")):
            store.add(done)
        rows = store.stored(map(job, range(5)))

    (one,) = summaries(rows)
    assert (one.runs, one.succeeded, one.robot_s) == (4, 3, 20.0)
    assert one.failures == ((3, "killed: gone"),)
    with (tmp_path / "table.txt").open("w") as file:
        print_table(Console(file=file, width=100), rows)
    assert "fig2, seed 3: killed: gone" in (tmp_path / "table.txt").read_text()


def test_the_table_counts_the_right_verdict_where_the_goal_is_out_of_reach_and_tells_who_did_not_look(
    tmp_path: Path,
) -> None:
    def done(replan: bool, reason: str) -> Finished:
        options = RunOptions(seed=0, disturb=("taken-for-good",), replan=replan)
        befell = Befallen(1.0, "taken-for-good", "cup was taken away for good", "", bodies=("cup",))
        result = RunResult("fig2", 0, "no_plan", reason, {}, disturbances=(befell,))
        return Finished(Job("fig2", options), "no_plan", reason, result.to_json())

    runs = [done(True, "cup is nowhere to be seen"), done(False, "open loop: the fingers closed on nothing")]
    with SweepStore(tmp_path / "s.db") as store:
        stored = {run.job: store.add(run) for run in runs}

    assert [(one.befell, one.succeeded) for one in summaries(stored)] == [
        (("taken-for-good",), 1),
        (("taken-for-good", "open loop"), 0),
    ]


def test_a_sweep_stores_real_runs_and_goes_on_only_when_told_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sweep = ["sweep", "fig2", "--seeds", "0:2", "--jobs", "1", "--max-sim-time", "0.1", "--store", str(tmp_path / "s")]

    assert main(sweep) == 0
    said = capsys.readouterr()
    assert "fig2, seed 1: gave up" in said.out
    assert main(sweep) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*sweep, "--resume"]) == 0
    assert "fig2, seed 1: gave up" in capsys.readouterr().out


def test_a_sweep_that_was_killed_leaves_no_process_and_goes_on_without_losing_or_repeating_a_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "s.db"
    sweep = ["sweep", "fig2", "--seeds", "0:3", "--jobs", "1", "--max-sim-time", "0.3", "--store", str(path)]
    with subprocess.Popen([sys.executable, "-m", "bt_tamp", *sweep], stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("1/3")
        workers = children(process.pid)
        process.send_signal(signal.SIGKILL)
    before = stored_at(path)
    assert workers
    wait_for_the_end_of(workers)
    assert main([*sweep, "--resume"]) == 0
    after = stored_at(path)
    assert [seed for seed, _ in after] == [0, 1, 2]
    assert 0 < len(before) < 3
    assert after[: len(before)] == before


def children(pid: int) -> list[int]:
    found = subprocess.run(["pgrep", "-P", str(pid), "-f", "Loky"], capture_output=True, text=True, check=False)
    return [int(line) for line in found.stdout.split()]


def wait_for_the_end_of(pids: list[int]) -> None:
    for _ in range(400):
        if not any(Path(f"/proc/{pid}").exists() for pid in pids):
            return
        time.sleep(0.05)
    raise AssertionError(f"{pids} outlive their sweep")


def stored_at(path: Path) -> list[tuple[int, str]]:
    with sqlite3.connect(path) as connection:
        return connection.execute("SELECT seed, stored_at FROM runs ORDER BY seed").fetchall()
