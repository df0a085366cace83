"""Run scenes over many seeds in parallel: each result is stored as it arrives, a table closes.

The exit code is 0 when every run has come to its end, whatever its outcome: the table tells that. A run that takes
more real time than 600 s and five times --max-sim-time hangs: it is ended and
recorded as killed, and the sweep goes on.
"""

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bt_tamp.commands.choices import add_disturbances, add_planning, add_time_limit, check_start, options_of
from bt_tamp.stopping import stop_on_signals

if TYPE_CHECKING:
    from bt_tamp.sweep import Finished, Job
    from bt_tamp.sweep_store import SweepStore


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scenes, seeds, processes, store, and what a run understands."""
    parser.add_argument("scenes", nargs="+", metavar="SCENE", help="shipped scenes' names or scene files")
    parser.add_argument("--seeds", type=seeds, default=range(20), metavar="A:B", help="A up to B-1, or one seed (0:20)")
    parser.add_argument(
        "--jobs", type=positive, default=os.cpu_count() or 1, metavar="N", help="runs at a time (default: one a core)"
    )
    parser.add_argument("--store", type=Path, required=True, metavar="FILE", help="SQLite file for the results")
    parser.add_argument(
        "--resume", action="store_true", help="keep the runs that are stored; repeat those that crashed or were killed"
    )
    add_disturbances(parser)
    add_time_limit(parser)
    add_planning(parser)


def seeds(text: str) -> range:
    """The seeds "A:B" (A, A+1, …, B-1) or "N"."""
    first, colon, end = text.partition(":")
    try:
        found = range(int(first), int(end)) if colon else range(int(first), int(first) + 1)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected whole numbers A:B or one seed N") from None
    if not found or found.start < 0:
        raise argparse.ArgumentTypeError(f"{text!r}: expected 0 ≤ A < B")
    return found


def positive(text: str) -> int:
    """A whole number of at least 1."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number of at least 1")
    return int(text)


def call(arguments: argparse.Namespace) -> int:
    """Run what isn't stored yet, then print the table."""
    jobs = _jobs(arguments)

    from bt_tamp.errors import UserError, refusing
    from bt_tamp.sweep_results import runs_of
    from bt_tamp.sweep_store import SweepStore
    from bt_tamp.sweep_table import print_table, table_console

    with SweepStore(arguments.store) as store:
        stored = store.stored(jobs)
        if stored and not arguments.resume:
            raise UserError(f"{arguments.store}: holds {len(stored)} of these runs already; --resume goes on with it")
        with refusing(ValueError, about=str(arguments.store)):
            runs_of(stored.values())
        left = [job for job in jobs if job not in stored or not stored[job].is_final]
        stop_on_signals()
        try:
            _run(left, arguments.jobs, store)
        except KeyboardInterrupt:
            print(f"bt-tamp: interrupted; what is done lies in {arguments.store}, --resume goes on", file=sys.stderr)
            return 130
        finally:
            print_table(table_console(), store.stored(jobs))
    return 0


def _jobs(arguments: argparse.Namespace) -> "list[Job]":
    from dataclasses import replace
    from hashlib import sha256

    from bt_tamp.sweep import Job
    from scenarios.library import scenario_path
    from scenarios.load import load_scenario

    options = options_of(arguments)
    # One run a class, and beside them the undisturbed one, against which lost time is told.
    befalling = [(), *((name,) for name in options.disturb)]
    digests = {}
    for scene in arguments.scenes:
        check_start(load_scenario(scene), scene)
        digests[scene] = sha256(scenario_path(scene).read_bytes()).hexdigest()[:16]
    return [
        Job(scene, replace(options, seed=seed, disturb=disturb), digests[scene])
        for scene in digests
        for seed in arguments.seeds
        for disturb in befalling
    ]


def _run(jobs: "list[Job]", processes: int, store: "SweepStore") -> None:
    from contextlib import closing

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from bt_tamp.quiet import outliving_a_closed_pipe
    from bt_tamp.sweep import run_jobs
    from bt_tamp.sweep_results import run_of

    console = Console(stderr=True)
    columns = (TextColumn("runs"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    is_silent = not console.is_terminal
    with (
        Progress(*columns, console=console, disable=is_silent) as bar,
        closing(run_jobs(jobs, min(processes, len(jobs)))) as arriving,
    ):
        task = bar.add_task("runs", total=len(jobs))
        succeeded = 0
        for number, finished in enumerate(arriving, start=1):
            stored = store.add(finished)
            bar.advance(task)
            succeeded += run_of(stored).succeeded
            said = f"{number}/{len(jobs)} ({succeeded} succeeded) {_said(finished)}"
            with outliving_a_closed_pipe(sys.stderr):
                print(said, file=sys.stderr) if is_silent else bar.console.print(said, highlight=False, markup=False)


def _said(finished: "Finished") -> str:
    seed, outcome = finished.job.options.seed, finished.outcome.replace("_", " ")
    reason = "" if finished.outcome == "goal_reached" else f": {finished.reason}"
    befalling = f", {', '.join(finished.job.options.disturb)}" if finished.job.options.disturb else ""
    return f"{finished.job.scene}, seed {seed}{befalling}: {outcome}{reason}"
