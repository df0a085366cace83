"""What is made of the results of sweeps."""

import csv
import json
import os
import sqlite3
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bt_tamp.cli import main
from bt_tamp.commands.choices import options_of
from bt_tamp.options import RunOptions
from bt_tamp.replay import choices_of, replay_command
from bt_tamp.report.result import Befallen, RunResult
from bt_tamp.sweep import MAX_TRIES, Finished, Job, run_jobs
from bt_tamp.sweep_results import at_95, lines, runs_of, wilson
from bt_tamp.sweep_store import SweepStore

MOVED = Befallen(
    *(3.0, "moved", "book was moved by 5 cm", "approach", "refined_again", 0.1, "pick(book, table)", ("book",)),
    is_urgent=True,
    reacted_after_s=0.16,
)
DONE = {"executed": ("pick(cup, table)", "pick(book, table)"), "executed_s": (3.0, 4.0)}


def finished(seed, robot_s, disturb=(), outcome="goal_reached", reason="", mattered=True, **options) -> Finished:
    befell = tuple(Befallen(**(vars(MOVED) | {"name": name, "mattered": mattered})) for name in disturb)
    result = RunResult("fig2", seed, outcome, reason, {}, robot_s=robot_s, replans=1, disturbances=befell, **DONE)
    job = Job("fig2", RunOptions(seed=seed, disturb=disturb, **options))
    return Finished(job, outcome, reason, result.to_json())


@pytest.fixture
def store(tmp_path: Path) -> Path:
    path = tmp_path / "s.db"
    with SweepStore(path) as opened:
        for seed in range(3):
            opened.add(finished(seed, 20.0 + seed))
        opened.add(finished(0, 24.0, ("moved",)))
        opened.add(finished(1, 27.0, ("moved",)))
        opened.add(finished(2, 9.0, ("moved",), "gave_up", "25 plans were made"))
        opened.add(finished(0, 8.0, ("moved",), "gave_up", "open loop: it failed", replan=False))
        opened.add(finished(0, 30.0, ("taken-for-good",), "no_plan", "book is nowhere to be seen"))
        opened.add(finished(1, 30.0, ("taken-for-good",), "goal_reached"))
    return path


def table(store: Path):
    with SweepStore(store) as opened:
        return {(line.disturb, line.replan): line for line in lines(runs_of(opened.everything()))}


def test_time_is_lost_against_the_undisturbed_run_of_the_same_seed(store):
    found = table(store)
    assert found["moved", True].lost_s == 5.0
    assert found["moved", True].lost_actions == 5.0 / 4.0
    assert (found["moved", True].reacted_s, found["moved", True].reactions) == (0.16, 3)
    assert found["moved", True].succeeded == 2
    assert found["moved", True].reasons == (("gave up: 25 plans were made", 1),)
    assert found["moved", False].succeeded == 0


def test_time_is_set_against_an_undone_action_only_where_the_run_had_to_answer(store):
    with SweepStore(store) as opened:
        calm = finished(2, 22.0, ("moved",))
        data = RunResult.from_json(calm.result)
        unanswered = tuple(replace(one, answer="") for one in data.disturbances)
        opened.add(replace(calm, result=replace(data, disturbances=unanswered).to_json()))
    line = table(store)["moved", True]
    assert (line.succeeded, line.lost_s, line.lost_actions) == (3, 4.0, 5.0 / 4.0)


def test_where_the_goal_cannot_be_reached_the_right_verdict_is_the_success(store):
    assert table(store)["taken-for-good", True].succeeded == 1


@pytest.mark.parametrize(
    "reason",
    [
        "the task planner failed (MemoryError: out of memory)",
        "no plan within 20 rounds: pick(cup, table) doesn't work as cup lies",
        "bookend is nowhere to be seen",
        "book-end is nowhere to be seen",
        "there is no way to box: the book's cover is in the way",
        "",
    ],
)
def test_a_verdict_that_does_not_name_what_was_taken_is_wrong(reason, tmp_path):
    with SweepStore(tmp_path / "s.db") as opened:
        opened.add(finished(0, 30.0, ("taken-for-good",), "no_plan", reason))
        opened.add(finished(1, 30.0, ("taken-for-good",), "proven_infeasible", "pick(book, table) is impossible"))
    assert table(tmp_path / "s.db")["taken-for-good", True].succeeded == 1


def test_a_run_that_nothing_befell_that_matters_is_neither_success_nor_failure(store):
    with SweepStore(store) as opened:
        opened.add(finished(3, 20.0, ("moved",), mattered=False))
        opened.add(finished(4, 20.0, ("moved",)))
        opened.add(Finished(Job("fig2", RunOptions(seed=5, disturb=("moved",))), "crashed", "broken", None))
    line = table(store)["moved", True]
    assert (line.runs, line.succeeded, line.unmet) == (5, 3, 1)


def test_a_run_that_failed_counts_whatever_made_it_fail(store):
    with SweepStore(store) as opened:
        opened.add(finished(7, 9.0, ("push",), "gave_up", "25 plans were made", mattered=False))
        opened.add(finished(7, 9.0, ("taken-for-good",), "gave_up", "25 plans were made", mattered=False))
    found = [table(store)[name, True] for name in ("push", "taken-for-good")]
    assert [(line.succeeded, line.runs) for line in found] == [(0, 1), (1, 3)]


def test_runs_with_other_choices_or_of_another_file_are_told_apart(store, capsys):
    with SweepStore(store) as opened:
        opened.add(finished(0, 24.0, ("moved",), contact="impedance"))
        for digest in ("abcdef01", "12345678"):
            opened.add(replace(elsewhere := finished(0, 24.0, ("moved",)), job=replace(elsewhere.job, digest=digest)))
    assert main(["results", str(store)]) == 0
    said = capsys.readouterr().out
    for variant in ("file ?", "--contact impedance file ?", "file abcdef", "file 123456"):
        assert f"moved, {variant} " in said
    assert main(["results", str(store), "--together"]) == 0
    said = capsys.readouterr().out
    assert "file" not in said
    assert "moved, --contact impedance" in said


def test_a_run_that_crashed_before_anything_befell_it_is_a_failure(store):
    with SweepStore(store) as opened:
        opened.add(finished(3, 2.0, (), "crashed", "KeyError"))
        broken = finished(4, 2.0, ("push",), "crashed", "KeyError: 'x'", mattered=False)
        opened.add(broken)
    line = table(store)["push", True]
    assert (line.runs, line.succeeded, line.crashes, line.unmet) == (1, 0, 1, 0)
    assert line.reasons == (("crashed: KeyError: 'x'", 1),)


def test_the_peak_is_that_of_all_runs_whether_something_befell_them_or_not(store):
    struck = finished(5, 20.0, ("moved",), mattered=False)
    data = RunResult.from_json(struck.result)
    with SweepStore(store) as opened:
        opened.add(replace(struck, result=replace(data, peak_force_n=77.0, unlawful_commands=2).to_json()))
    line = table(store)["moved", True]
    assert (line.peak_n, line.violations, line.unmet) == (77.0, 2, 1)


def test_the_slowest_in_twenty_is_left_out_of_95_percent():
    assert at_95([float(k) for k in range(20)]) == 18.0
    assert at_95([]) is None


@settings(derandomize=True, max_examples=60)
@given(runs=st.integers(1, 300), share=st.floats(0.0, 1.0))
def test_the_interval_holds_the_rate_and_narrows_with_more_runs(runs, share):
    succeeded = round(share * runs)
    low, high = wilson(succeeded, runs)
    assert 0.0 <= low <= succeeded / runs <= high <= 1.0
    more_low, more_high = wilson(4 * succeeded, 4 * runs)
    assert more_high - more_low < high - low


def test_wilson_as_it_stands_in_books():
    assert wilson(10, 10) == (pytest.approx(0.7225, abs=1e-3), 1.0)
    assert wilson(0, 0) == (0.0, 1.0)


def test_the_command_names_every_choice_and_means_the_same_run():
    from bt_tamp.cli import parser

    options = RunOptions(
        seed=4, disturb=("moved", "push"), replan=False, contact="impedance", max_sim_time=120.12345678
    )
    data = {name: value for name, value in vars(options).items() if name != "seed"}
    command = replay_command("fig1", 4, data | {"disturb": list(options.disturb), "digest": "abc"})
    arguments = parser().parse_args(command.split()[1:])
    assert options_of(arguments) == options
    assert replay_command("fig1", 4, json.loads(json.dumps(choices_of(options)))) == command
    assert choices_of(RunOptions(seed=4, window=True)) == {}


def test_runs_of_all_scenes_come_together_in_one_line_a_class_and_in_one_sentence_at_the_end(store, capsys):
    with SweepStore(store) as opened:
        elsewhere = finished(7, 25.0, ("moved",))
        opened.add(replace(elsewhere, job=replace(elsewhere.job, scene="some/where/fig3.yaml")))
    assert main(["results", str(store)]) == 0
    assert {"fig2", "fig3"} <= set(capsys.readouterr().out.split())
    assert main(["results", str(store), "--together"]) == 0
    said = capsys.readouterr().out
    moved = next(line.split() for line in said.splitlines() if "moved" in line and "open loop" not in line)
    assert moved[:3] == ["all", "moved", "3/4"]
    joined = " ".join(said.split())
    assert "watching: 6 of 6 disturbed runs were met; 3 of 4 (75.0 %, 30.1–95.4) reached a goal that can be; " in joined
    assert "1 of 2 (50.0 %, 9.5–90.5) told rightly that it can't be; 0 crashed or hung, 0 torques broke" in joined
    assert "open loop: 1 of 1 disturbed runs were met; 0 of 1 (0.0 %, 0.0–79.3) reached a goal that can be;" in joined


def test_the_table_is_printed_and_written(store, tmp_path, capsys):
    assert main(["results", str(store), "--out", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "watching, 1 × gave up: … plans were made bt-tamp run fig2 --seed 2 --disturb moved 25 plans were" in said
    assert "open loop, 1 × gave up: it failed bt-tamp run fig2 --seed 0 --disturb moved --no-replan it failed" in said
    assert "phases hit: pick approach 6" in said
    assert (tmp_path / "out" / "fig2.png").read_bytes().startswith(b"\x89PNG")
    with (tmp_path / "out" / "runs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 9
    assert {row["succeeded"] for row in rows} == {"True", "False"}


def test_runs_that_failed_alike_are_told_together_with_the_first_commands(store, tmp_path, capsys):
    with SweepStore(store) as opened:
        for seed in range(5):
            reason = f"open loop: pick(cup_{seed}, table) failed: the fingers closed to {seed} mm without cup_{seed}"
            done = finished(seed, 8.0, ("rotated",), "gave_up", reason, replan=False)
            result = json.loads(done.result or "") | {"places": {f"cup_{seed}": "table"}}
            opened.add(replace(done, result=json.dumps(result)))
    assert main(["results", str(store), "--out", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "open loop, 5 × gave up: pick failed: the fingers closed to … mm without a body bt-tamp run" in said
    assert said.count("--disturb rotated --no-replan pick(cup_") == 3
    assert "and 2 more" in said
    assert (tmp_path / "runs.csv").read_text().count("--disturb rotated --no-replan") == 5


def test_a_limit_touched_from_either_side_is_one_kind_of_failure(store, capsys):
    with SweepStore(store) as opened:
        for seed, (force, where) in enumerate([(46, "near"), (60, "at"), (101, "beyond")]):
            reason = f"open loop: pick(box, table) failed: {force} N of contact force, {where} the safety limit of 60 N"
            opened.add(finished(seed, 8.0, ("rotated",), "gave_up", reason, replan=False))
    assert main(["results", str(store)]) == 0
    assert "open loop, 3 × gave up: pick failed" in " ".join(capsys.readouterr().out.split())


def test_a_stored_run_that_cannot_be_read_is_told_by_sweep_and_results_alike(tmp_path, capsys):
    sweep = ["sweep", "fig2", "--seeds", "0:1", "--max-sim-time", "0.1", "--jobs", "1", "--store", str(tmp_path / "s")]
    assert main(sweep) == 0
    with sqlite3.connect(tmp_path / "s") as connection:
        connection.execute("UPDATE runs SET result = '{}'")
    for command in ([*sweep, "--resume"], ["results", str(tmp_path / "s")]):
        assert main(command) == 2
        assert "not a run's result" in capsys.readouterr().err


def test_a_store_that_is_not_there_is_refused(tmp_path, capsys):
    assert main(["results", str(tmp_path / "no.db")]) == 2
    assert "no such file" in capsys.readouterr().err
    assert not (tmp_path / "no.db").exists()


@pytest.mark.parametrize("columns", ["id INTEGER, name TEXT", None])
def test_another_programs_file_is_refused_and_left_as_it_was(columns, tmp_path, capsys):
    path = tmp_path / "other.db"
    with sqlite3.connect(path) as connection:
        connection.execute(f"CREATE TABLE {'runs' if columns else 'other'} ({columns or 'x'})")
    before = path.read_bytes()
    assert main(["results", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert path.read_bytes() == before


def test_a_class_that_is_no_longer_known_is_told_in_one_line(store, capsys):
    with SweepStore(store) as opened:
        opened.add(finished(0, 24.0, ("earthquake",)))
    assert main(["results", str(store)]) == 2
    assert "unknown class of disturbance 'earthquake'" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["run", "sweep"])
def test_an_unknown_class_is_refused_in_one_line(command, tmp_path, capsys):
    store = ["--store", str(tmp_path / "s.db")] if command == "sweep" else []
    assert main([command, "fig2", "--disturb", "mooved", *store]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1
    assert "did you mean 'moved'?" in complaint


def test_a_run_that_kills_its_process_each_time_is_tried_twice_and_recorded_so(tmp_path):
    def work(given: Job) -> Finished:
        if given.options.seed == 0:
            os._exit(9)
        return Finished(given, "goal_reached", "")

    jobs = [Job("fig2", RunOptions(seed=seed)) for seed in range(2)]
    with SweepStore(tmp_path / "s.db") as store:
        for done in run_jobs(jobs, 1, work):
            store.add(done)
        rows = store.stored(jobs)
    assert [(row.outcome, row.tries, row.is_final) for row in rows.values()] == [
        ("killed", MAX_TRIES, True),
        ("goal_reached", 1, True),
    ]


def test_a_crash_is_tried_once_more_by_a_resumed_sweep(tmp_path):
    job = Job("fig2", RunOptions())
    with SweepStore(tmp_path / "s.db") as store:
        store.add(Finished(job, "crashed", "broken"))
        assert not store.stored([job])[job].is_final
        store.add(Finished(job, "crashed", "broken"))
        assert store.stored([job])[job].is_final
