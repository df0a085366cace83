"""Measure: contact, what control costs, how planning scales. A table closes, and the figures to reach.

The exit code is 0 when everything was measured, whatever came of it: the last section tells that. What was measured
before an interruption is told too.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bt_tamp.stopping import stop_on_signals

if TYPE_CHECKING:
    from collections.abc import Callable

# Each is a module of `bt_tamp.bench` with WHAT, planned, measure, said, print_results, acceptance and records.
BENCHES = {
    "force": "slides at 0.1 m/s: laws side by side, then every disturbance alone and all together",
    "wipe": "random crumbs, the dustpan on each side of the table in turn: how many lie in it in the end",
    "drag": "random flat boxes: how many are dragged to an edge of their table and picked there",
    "tamp": "fig1 and random tables: planning time and plan length, and what is said of those that can't be cleared",
    "motion": "the paper's motion planners on fig1's queries and random ones, beside pybullet-planning",
    "control": "cost of a control tick by part beside the bare physics step, and the real-time factor",
    "task": "task planning alone, 2 to 30 objects: CPU time, rounds and plan length, beside other ways to search",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which benchmark, how much of it, and where the files go."""
    benches = parser.add_subparsers(dest="bench", metavar="BENCH", required=True, title="benchmarks")
    for name, summary in BENCHES.items():
        sub = benches.add_parser(name, help=summary, description=summary)
        sub.add_argument("--out", type=Path, metavar="DIR", help="write JSON there, and PNG plots where there are any")
        sub.add_argument("--quick", action="store_true", help="fewer cases, for a first look")


def call(arguments: argparse.Namespace) -> int:
    """Measure, print, write."""
    stop_on_signals()
    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        bench = import_module(f"bt_tamp.bench.{arguments.bench}")
    from bt_tamp.garbage import collect_rarely

    collect_rarely()
    from rich.console import Console

    from bt_tamp.bench.checks import print_checks, write_json

    planned = bench.planned(arguments.quick)
    results: list[Any] = []
    interruption: KeyboardInterrupt | None = None
    with _progress(bench.WHAT, len(planned)) as advance:
        try:
            for result in bench.measure(planned):
                results.append(result)
                advance(bench.said(result))
        except KeyboardInterrupt as stopped:
            if not results:
                raise
            interruption = stopped
    console = Console()
    bench.print_results(console, results)
    checks = bench.acceptance(results)
    print_checks(console, checks)
    if arguments.out is not None:
        write_json(arguments.out / f"{arguments.bench}.json", checks, **{bench.WHAT: bench.records(results)})
        _plot(arguments.bench, arguments.out, results)
    if interruption is not None:
        raise interruption
    return 0


def _plot(bench: str, out: Path, results: Sequence[Any]) -> None:
    from bt_tamp.bench.plots import PLOTS

    try:
        PLOTS[bench](out, results)
    except ImportError:
        print("bt-tamp: no plots: they need matplotlib (pip install bt-tamp[plots])", file=sys.stderr)


@contextmanager
def _progress(what: str, total: int) -> Iterator["Callable[[str], None]"]:
    """A bar on a terminal, else a line for each: call what is given with what has just been done."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    done = 0
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=total)

        def advance(said: str) -> None:
            nonlocal done
            done += 1
            bar.advance(task)
            bar.console.print(f"{done}/{total} {said}", highlight=False, markup=False, soft_wrap=True)

        yield advance
