"""Sum up what sweeps have stored, by scene and class of disturbance; plots and CSV with --out.

success: goal reached, or the right verdict where the class declares that it can't be; with its 95 % interval (Wilson).
Goals reached before anything that matters befell the run are no success: they are left out, and counted as unmet.
lost s: robot time beyond the undisturbed run of the same scene and seed, median; × action: as a multiple of the action
that was undone, where the run had to answer. react s: from when a disturbance of the running action could be seen (at
once, but where poses come late or not at all) until the arm stood still or set out anew, thinking included, where that
took no new task plan: median / 95 %. peak N: the largest true force. broken: torques beyond their limit, or NaN.
--together makes one line of all scenes' runs of a class.
"""

import argparse
import sys
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bt_tamp.sweep_results import Line, Run

SHOWN = 3
"""Commands that are printed of runs that failed alike."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Store and folder."""
    parser.add_argument("store", type=Path, metavar="FILE", help="a store that `bt-tamp sweep` wrote")
    parser.add_argument("--together", action="store_true", help="a line for each class, of the runs of all scenes")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for plots (PNG) and CSV files")


def call(arguments: argparse.Namespace) -> int:
    """Print the table and what failed; write files if asked to."""
    from bt_tamp.errors import UserError, refusing
    from bt_tamp.sweep_results import lines, runs_of
    from bt_tamp.sweep_store import SweepStore

    if not arguments.store.is_file():
        raise UserError(f"{arguments.store}: no such file, expected a store that `bt-tamp sweep` wrote")
    with SweepStore(arguments.store, is_made=False) as store, refusing(ValueError, about=str(arguments.store)):
        runs = runs_of(store.everything())
        found = lines(runs, arguments.together)
    if not runs:
        raise UserError(f"{arguments.store}: holds no runs")
    made = [] if arguments.out is None else _export(arguments.out, found, runs)
    _print(found, runs)
    _print_failures(runs, is_exported=arguments.out is not None)
    for path in made:
        print(path)
    return 0


def _print(found: "list[Line]", runs: "list[Run]") -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    from bt_tamp.report.sentences import counted
    from bt_tamp.sweep_results import at_95, hits, reactions_of, scene_name, totals
    from bt_tamp.sweep_table import table_console

    console = table_console()
    table = Table(pad_edge=False, box=SIMPLE_HEAD)
    table.add_column("scene", no_wrap=True)
    table.add_column("class", no_wrap=True)
    for heading in ("success", "95 %", "replans", "lost s", "× action", "react s", "peak N", "broken", "unmet"):
        table.add_column(heading, justify="right")
    for line in found:
        low, high = line.interval
        table.add_row(
            scene_name(line.scene),
            line.befell + ("" if line.replan else ", open loop"),
            f"{line.succeeded}/{line.runs}",
            f"{100 * low:.0f}–{100 * high:.0f}" if line.runs else "–",
            *(_shown(value) for value in (line.replans, line.lost_s, line.lost_actions)),
            "–" if line.reacted_s is None else f"{line.reacted_s:.2f} / {line.slow_reacted_s:.2f}",
            _shown(line.peak_n),
            str(line.violations or ""),
            str(line.unmet or ""),
        )
    console.print(table)
    reactions = reactions_of(run.result for run in runs if run.result is not None and run.replan)
    if reactions:
        told = f"{counted(len(reactions), 'reaction')}: median {median(reactions):.2f} s, 95 % {at_95(reactions):.2f} s"
        console.print(told, highlight=False)
    struck = hits(runs)
    if struck:
        console.print(Text("phases hit: " + ", ".join(f"{what} {n}" for what, n in struck.most_common())))
    for told in totals(runs):
        console.print(told, highlight=False)


def _print_failures(runs: "list[Run]", is_exported: bool) -> None:
    from rich.text import Text

    from bt_tamp.sweep_failures import OPEN_LOOP, kinds_of_failure
    from bt_tamp.sweep_table import table_console

    console = table_console()
    for kind in kinds_of_failure(runs):
        way = "watching" if kind.replan else "open loop"
        console.print(Text(f"\n{way}, {len(kind.runs)} × {kind.why}"), soft_wrap=True)
        for run in kind.runs[:SHOWN]:
            reason = run.reason.removeprefix(OPEN_LOOP)
            console.print(Text(f"    {run.command}\n        {reason}"), soft_wrap=True)
        if len(kind.runs) > SHOWN:
            where = "their commands stand in runs.csv" if is_exported else "--out DIR writes their commands to runs.csv"
            print(f"    and {len(kind.runs) - SHOWN} more: {where}")


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:z.1f}"


def _export(folder: Path, found: "list[Line]", runs: "list[Run]") -> list[Path]:
    from bt_tamp.errors import refusing
    from bt_tamp.sweep_export import plot, write_csv

    with refusing(OSError, about=str(folder)):
        folder.mkdir(parents=True, exist_ok=True)
        made = write_csv(folder, runs, found)
        try:
            made += plot(folder, found)
        except ImportError:
            print("bt-tamp: no plots: they need matplotlib (pip install bt-tamp[plots])", file=sys.stderr)
    return made
