"""What a sweep found, summed up by scene and what befell it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table
from rich.text import Text

from bt_tamp.sweep import Job
from bt_tamp.sweep_results import Run, run_of
from bt_tamp.sweep_store import Stored

WIDTH = 130
"""Columns of a table that is written to a file or a pipe."""

CAPTION = (
    "succeeded: the goal reached, or the right verdict where it can't be; medians over finished runs; "
    "unintended: contacts that no phase declared"
)


def table_console() -> Console:
    """Where tables are printed: as wide as the window, but lines of a file need not fit one."""
    console = Console()
    return console if console.is_terminal else Console(width=WIDTH)


@dataclass(frozen=True)
class Summary:
    """One scene's runs with the same disturbances, watching or not: how many, how many succeeded (reached the goal, or
    told rightly that it can't be), medians (None without a finished run), contacts that no phase had declared, and what
    failed as (seed, reason)."""

    scene: str
    disturb: tuple[str, ...]
    replan: bool
    runs: int
    succeeded: int
    robot_s: float | None
    wall_s: float | None
    planning_cpu_s: float | None
    unintended: int
    failures: tuple[tuple[int, str], ...]

    @property
    def befell(self) -> tuple[str, ...]:
        """What befell the runs, and whether nobody looked."""
        return self.disturb if self.replan else (*self.disturb, "open loop")


def summaries(rows: Mapping[Job, Stored]) -> list[Summary]:
    """One summary for each scene and what befell it, in the order of the jobs."""
    groups: dict[tuple[str, tuple[str, ...], bool], list[Run]] = {}
    for job, row in rows.items():
        groups.setdefault((job.scene, job.options.disturb, job.options.replan), []).append(run_of(row))
    return [_summary(*about, group) for about, group in groups.items()]


def _summary(scene: str, disturb: tuple[str, ...], replan: bool, runs: Sequence[Run]) -> Summary:
    results = [run.result for run in runs if run.result is not None]
    failed = sorted((run for run in runs if not run.succeeded), key=attrgetter("seed"))
    return Summary(
        scene=scene,
        disturb=disturb,
        replan=replan,
        runs=len(runs),
        succeeded=len(runs) - len(failed),
        robot_s=_median(result.robot_s for result in results),
        wall_s=_median(result.wall_s for result in results),
        planning_cpu_s=_median(result.planning_cpu_s for result in results),
        unintended=sum(len(result.unintended_contacts) for result in results),
        failures=tuple((run.seed, f"{run.outcome.replace('_', ' ')}: {run.reason}") for run in failed),
    )


def _median(values: Iterable[float]) -> float | None:
    found = list(values)
    return median(found) if found else None


def print_table(console: Console, rows: Mapping[Job, Stored]) -> None:
    """The closing table, and below it what failed with its seeds and reasons."""
    found = summaries(rows)
    table = Table(caption=CAPTION, caption_justify="left")
    table.add_column("scene")
    for heading in ("runs", "succeeded", "robot_s", "wall_s", "planning_cpu_s", "unintended"):
        table.add_column(heading, justify="right")
    for one in found:
        figures = (_shown(one.robot_s), _shown(one.wall_s), _shown(one.planning_cpu_s))
        table.add_row(
            ", ".join((Path(one.scene).stem, *one.befell)),
            str(one.runs),
            f"{one.succeeded}/{one.runs}",
            *figures,
            str(one.unintended),
        )
    console.print(table)
    for one in found:
        for seed, reason in one.failures:
            about = ", ".join((one.scene, f"seed {seed}", *one.befell))
            console.print(Text(f"{about}: {reason}"), soft_wrap=True)


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
