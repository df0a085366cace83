"""Measure how well contact is controlled and what control costs. A table closes, and the figures to reach.

The exit code is 0 when everything was measured, whatever came of it: the last section tells that.
"""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from bt_tamp.commands.stopping import stop_on_signals

if TYPE_CHECKING:
    from collections.abc import Callable

BENCHES = {
    "force": "slides at 0.1 m/s: laws side by side, then every disturbance alone and all together",
    "wipe": "random crumbs, the dustpan on each side of the table in turn: how many lie in it in the end",
    "drag": "random flat boxes: how many are dragged to an edge of their table and picked there",
    "control": "cost of a control tick by part beside the bare physics step, and the real-time factor",
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
    measure = {"force": _force, "wipe": _wipe, "drag": _drag, "control": _control}[arguments.bench]
    measure(arguments.out, arguments.quick)
    return 0


def _force(out: Path | None, quick: bool) -> None:
    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.bench import force
    from dataclasses import asdict

    from rich.console import Console

    from bt_tamp.bench.checks import print_checks, write_json

    planned = list(force.cases((10.0,) if quick else force.TARGETS, quick))
    with _progress("slides", len(planned)) as advance:
        results = force.measure(planned, lambda r: advance(f"{r.case}, {r.law}, {r.target:g} N: {r.ended}"))
    console = Console()
    force.print_results(console, results)
    console.print(force.about_100_newtons(), highlight=False)
    checks = force.acceptance(results)
    print_checks(console, checks)
    if out is not None:
        write_json(out / "force.json", checks, slides=[asdict(force.thinned(r)) for r in results])
        _plot(out, results)


def _wipe(out: Path | None, quick: bool) -> None:
    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.bench import wipe
    from dataclasses import asdict

    from rich.console import Console

    from bt_tamp.bench.checks import print_checks, write_json

    planned = wipe.planned(quick)
    with _progress("layouts", len(planned)) as advance:
        results = wipe.measure(planned, lambda r: advance(f"dustpan at {r.layout.side}: {r.inside} of {r.crumbs}"))
    console = Console()
    wipe.print_results(console, results)
    checks = wipe.acceptance(results)
    print_checks(console, checks)
    if out is not None:
        write_json(out / "wipe.json", checks, layouts=[asdict(r) for r in results])


def _drag(out: Path | None, quick: bool) -> None:
    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.bench import drag
    from dataclasses import asdict

    from rich.console import Console

    from bt_tamp.bench.checks import print_checks, write_json

    planned = drag.planned(quick)
    with _progress("boxes", len(planned)) as advance:
        results = drag.measure(planned, lambda r: advance(f"to {r.edge}: {'held' if r.is_held else r.reason}"))
    console = Console()
    drag.print_results(console, results)
    checks = drag.acceptance(results)
    print_checks(console, checks)
    if out is not None:
        write_json(out / "drag.json", checks, boxes=[asdict(r) for r in results])


def _plot(out: Path, results: list) -> None:
    import sys

    from bt_tamp.bench.plots import plot_forces

    try:
        plot_forces(out, results)
    except ImportError:
        print("bt-tamp: no plots: they need matplotlib (pip install bt-tamp[plots])", file=sys.stderr)


def _control(out: Path | None, quick: bool) -> None:
    from bt_tamp.quiet import quiet_imports

    with quiet_imports():
        from bt_tamp.bench import control
    from dataclasses import asdict

    from rich.console import Console

    from bt_tamp.bench.checks import print_checks, write_json

    seeds = (0,) if quick else (0, 1, 2)
    with _progress("runs", len(seeds)) as advance:
        runs = []
        for seed in seeds:
            runs.append(control.measure(seed))
            advance(f"{control.SCENE}, seed {seed}")
    costs = control.middle(runs)
    console = Console()
    control.print_costs(console, costs)
    checks = control.acceptance(costs)
    print_checks(console, checks)
    if out is not None:
        write_json(out / "control.json", checks, costs=[asdict(cost) for cost in costs])


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
