"""What a sweep found, summed up by scene and what befell it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table
from rich.text import Text

from bt_tamp.report.result import RunResult
from bt_tamp.sweep import Job
from bt_tamp.sweep_store import Row

WIDTH = 130
"""Columns of a table that is written to a file or a pipe."""


def table_console() -> Console:
    """Where tables are printed: as wide as the window, but lines of a file need not fit one."""
    console = Console()
    return console if console.is_terminal else Console(width=WIDTH)


@dataclass(frozen=True)
class Summary:
    """One scene's runs with the same disturbances: how many, how many reached the goal, medians (None without a
    finished run), contacts that no phase had declared, and what failed as (seed, reason)."""

    scene: str
    disturb: tuple[str, ...]
    runs: int
    reached: int
    robot_s: float | None
    wall_s: float | None
    planning_cpu_s: float | None
    unintended: int
    failures: tuple[tuple[int, str], ...]


def summaries(rows: Mapping[Job, Row]) -> list[Summary]:
    """One summary for each scene and what befell it, in the order of the jobs."""
    groups: dict[tuple[str, tuple[str, ...]], list[tuple[Job, Row]]] = {}
    for job, row in rows.items():
        groups.setdefault((job.scene, job.options.disturb), []).append((job, row))
    return [_summary(scene, disturb, group) for (scene, disturb), group in groups.items()]


def _summary(scene: str, disturb: tuple[str, ...], rows: Sequence[tuple[Job, Row]]) -> Summary:
    results = [RunResult.from_json(row.result) for _, row in rows if row.result is not None]
    failed = sorted(((job.options.seed, row) for job, row in rows if row.outcome != "goal_reached"), key=itemgetter(0))
    return Summary(
        scene=scene,
        disturb=disturb,
        runs=len(rows),
        reached=len(rows) - len(failed),
        robot_s=_median(result.robot_s for result in results),
        wall_s=_median(result.wall_s for result in results),
        planning_cpu_s=_median(result.planning_cpu_s for result in results),
        unintended=sum(len(result.unintended_contacts) for result in results),
        failures=tuple((seed, f"{row.outcome.replace('_', ' ')}: {row.reason}") for seed, row in failed),
    )


def _median(values: Iterable[float]) -> float | None:
    found = list(values)
    return median(found) if found else None


def print_table(console: Console, rows: Mapping[Job, Row]) -> None:
    """The closing table, and below it what failed with its seeds and reasons."""
    found = summaries(rows)
    table = Table(
        caption="medians over finished runs; unintended: contacts that no phase declared", caption_justify="left"
    )
    table.add_column("scene")
    for heading in ("runs", "reached", "robot_s", "wall_s", "planning_cpu_s", "unintended"):
        table.add_column(heading, justify="right")
    for one in found:
        figures = (_shown(one.robot_s), _shown(one.wall_s), _shown(one.planning_cpu_s))
        table.add_row(
            " ".join((Path(one.scene).stem, *one.disturb)),
            str(one.runs),
            f"{one.reached}/{one.runs}",
            *figures,
            str(one.unintended),
        )
    console.print(table)
    for one in found:
        for seed, reason in one.failures:
            befalling = f", {', '.join(one.disturb)}" if one.disturb else ""
            console.print(Text(f"{one.scene}, seed {seed}{befalling}: {reason}"), soft_wrap=True)


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
