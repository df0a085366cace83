"""`bench tamp`: task and motion planning of whole tables, and what becomes of those that can't be cleared."""

import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from rich.console import Console

from bt_tamp.bench.checks import Check
from bt_tamp.bench.tables import CULPRITS, LARGER, MOST, Case, cases
from bt_tamp.bench.whole import whole_run
from bt_tamp.executive.preview import preview
from bt_tamp.options import RunOptions
from bt_tamp.report.recorder import RunRecorder
from planner.search_then_sample import NoPlan
from planner.task.pyperplan_ import PyperplanPlanner
from planner.task.symbols import TaskPlan
from scenarios.load import load_scenario
from scenarios.spoilers import KINDS

WHAT = "tables"
CPU_WANTED = 20.0
FIG1_CPU_WANTED = 1.0
"""Seconds of CPU: for a table, and for fig1 in the median."""

PLANNED_WANTED, CLEARED_WANTED, TOLD_WANTED = 0.97, 0.95, 0.9
"""Shares: of the tables planned within CPU_WANTED, of those run that are clear in the end, and of the unsolvable ones
that are told to be so with the right culprit."""

LENGTH_WANTED = 1.1
OTHER_SEARCHES = {"astar-hmax": 2000, "wastar-hff": 10_000, "gbfs-hff": 10_000}
"""Searches whose plans are held against ours, with the nodes that each may expand."""


@dataclass(frozen=True)
class TampResult:
    """What became of one table.

    outcome: "planned", "proven" or "budget", of a run its own outcome. cpu_s: CPU seconds of planning, all rounds.
    steps: of the task plan that was refined, and the fewest that any search finds for the same facts; 0 without one.
    culprits: what is said to be in the way, or to be what can't be cleared. reason: why there is no plan.
    """

    case: Case
    outcome: str
    cpu_s: float
    rounds: int
    steps: int
    shortest: int
    culprits: tuple[str, ...]
    reason: str

    @property
    def is_planned(self) -> bool:
        """Was a plan found, in the time wanted?"""
        return self.outcome == "planned" and self.cpu_s <= CPU_WANTED

    @property
    def is_told(self) -> bool:
        """Of an unsolvable table: is it said to be so, and the one thing named that makes it so, no other?"""
        return self.outcome in ("proven", "budget") and self.culprits == (CULPRITS[self.case.kind or ""],)


def planned(quick: bool) -> list[Case]:
    """The tables."""
    return list(cases(quick))


def measure(tables: Sequence[Case]) -> Iterator[TampResult]:
    """Plan, or run, one after the other."""
    # Compiled code is loaded by what is planned first, which is not counted.
    preview(load_scenario("fig1"), RunOptions(), lambda kind, **data: None)
    for case in tables:
        yield run_table(case) if case.part == "run" else plan_table(case)


def plan_table(case: Case) -> TampResult:
    """Plan a table as a run would at its start."""
    last: dict[str, Any] = {}

    def listen(kind: str, **data: Any) -> None:
        if kind == "round":
            last.update(data)

    found = preview(case.scenario(), RunOptions(seed=case.seed), listen)
    outcome = found.outcome
    if isinstance(outcome, NoPlan):
        culprits = tuple(sorted(outcome.culprits))
        return TampResult(case, outcome.verdict, found.cpu_s, outcome.rounds, 0, 0, culprits, outcome.reason)
    steps = len(last["plan"])
    shortest = min([steps, *_other_lengths(last["domain"], last["problem"])])
    return TampResult(case, "planned", found.cpu_s, outcome.rounds, steps, shortest, (), "")


def _other_lengths(domain: str, problem: str) -> Iterable[int]:
    """Lengths of the plans that other searches find for a problem in PDDL."""
    for name, expansions in OTHER_SEARCHES.items():
        other = PyperplanPlanner(name).solve(domain, problem, expansions)
        if isinstance(other, TaskPlan):
            yield len(other.steps)


def run_table(case: Case) -> TampResult:
    """One whole run, from the noise of the case's seed."""
    result = whole_run(RunRecorder(case.scenario()), RunOptions(seed=case.seed))
    return TampResult(case, result.outcome, result.planning_cpu_s, result.rounds, 0, 0, (), result.reason)


def said(result: TampResult) -> str:
    """A table in a line."""
    length = f", {result.steps} steps (shortest known {result.shortest})" if result.steps else ""
    blamed = f", culprits: {', '.join(result.culprits)}" if result.culprits else ""
    return f"{result.case}: {result.outcome}, {result.cpu_s:.2f} s of CPU{length}{blamed}"


def records(results: Sequence[TampResult]) -> list[dict[str, Any]]:
    """For JSON."""
    return [asdict(result) | {"table": str(result.case)} for result in results]


@dataclass(frozen=True)
class Group:
    """Tables that are counted together."""

    title: str
    results: Sequence[TampResult]


def groups(results: Sequence[TampResult]) -> list[Group]:
    """By part; the solvable tables also by number of objects, the unsolvable ones by kind. None is empty."""
    tables = _of(results, "table")
    sizes = [(low, low + 2) for low in range(4, MOST + 1, 3)]
    found = [Group("fig1", _of(results, "fig1")), Group("generated, 4–12 objects", tables)]
    found += [Group(f"  {a}–{b} objects", [r for r in tables if a <= r.case.objects <= b]) for a, b in sizes]
    larger = _of(results, "larger")
    found += [Group(f"generated, {n} objects", [r for r in larger if r.case.objects == n]) for n in LARGER]
    hopeless = _of(results, "unsolvable")
    found += [Group(f"unsolvable: {kind}", [r for r in hopeless if r.case.kind == kind]) for kind in KINDS]
    found.append(Group("generated and run", _of(results, "run")))
    return [group for group in found if group.results]


def _of(results: Sequence[TampResult], part: str) -> list[TampResult]:
    return [result for result in results if result.case.part == part]


COLUMNS = (
    ("", 5, lambda rs: str(len(rs))),
    ("planned", 8, lambda rs: _count(r.is_planned for r in rs)),
    ("cleared", 8, lambda rs: _count(r.outcome == "goal_reached" for r in rs)),
    ("proven", 7, lambda rs: _count(r.outcome == "proven" for r in rs)),
    ("budget", 7, lambda rs: _count(r.outcome == "budget" for r in rs)),
    ("culprit", 8, lambda rs: _count(r.case.kind is not None and r.is_told for r in rs)),
    ("median", 8, lambda rs: f"{statistics.median(r.cpu_s for r in rs):.2f}"),
    ("p95", 7, lambda rs: f"{np.percentile([r.cpu_s for r in rs], 95):.2f}"),
    ("max", 7, lambda rs: f"{max(r.cpu_s for r in rs):.2f}"),
    ("rounds", 7, lambda rs: f"{statistics.mean(r.rounds for r in rs):.1f}"),
    ("length", 7, lambda rs: _longest([r.steps / r.shortest for r in rs if r.shortest])),
)
"""Heading, width and text of each column, for the results of a group."""

NOTES = """\
planned: within 20 s of CPU. proven, budget: why there is no plan. culprit: nothing but the one thing that can't be
cleared is named. median, p95, max: CPU seconds of planning. rounds: mean. length: steps by the fewest known, worst."""


def _count(those: Iterable[bool]) -> str:
    return str(sum(those) or "–")


def _longest(ratios: Sequence[float]) -> str:
    return f"{max(ratios):.2f}" if ratios else "–"


def print_results(console: Console, results: Sequence[TampResult]) -> None:
    """One row a group of tables, then every table that fell short."""
    lines = [f"{'tables':30}" + "".join(f"{name:>{width}}" for name, width, _ in COLUMNS)]
    for group in groups(results):
        lines.append(f"{group.title:30}" + "".join(f"{text(group.results):>{width}}" for _, width, text in COLUMNS))
    console.print("\n".join([*lines, NOTES, *shortcomings(results)]), highlight=False, markup=False, soft_wrap=True)


def shortcomings(results: Sequence[TampResult]) -> list[str]:
    """What is wrong with which table, a line each."""
    lines = []
    for result in results:
        hopeless = result.case.part == "unsolvable"
        if hopeless and result.outcome == "planned":
            lines.append(f"{result.case}: planned, though it can't be cleared")
        elif hopeless and not result.is_told:
            lines.append(f"{result.case}: named {', '.join(result.culprits) or 'nothing'}: {result.reason}")
        elif result.case.part == "run" and result.outcome != "goal_reached":
            lines.append(f"{result.case}: {result.outcome}: {result.reason}")
        elif result.case.part in ("fig1", "table", "larger") and result.outcome != "planned":
            lines.append(f"{result.case}: no plan: {result.reason}")
        elif result.case.part == "table" and not result.is_planned:
            lines.append(f"{result.case}: planned in {result.cpu_s:.1f} s of CPU")
        if result.shortest and result.steps > LENGTH_WANTED * result.shortest:
            lines.append(f"{result.case}: {result.steps} steps, {result.shortest} are enough")
    return lines


def acceptance(results: Sequence[TampResult]) -> list[Check]:
    """The figures to reach."""
    fig1 = [result.cpu_s for result in _of(results, "fig1") if result.outcome == "planned"]
    tables, runs, hopeless = (_of(results, part) for part in ("table", "run", "unsolvable"))
    false = [result for result in hopeless if result.outcome == "planned"]
    ratios = [result.steps / result.shortest for result in results if result.shortest]
    middle = statistics.median(fig1) if fig1 else float("nan")
    longest = max(ratios, default=float("nan"))
    return [
        Check(
            "fig1: CPU of planning, median", f"≤ {FIG1_CPU_WANTED:g} s", f"{middle:.2f} s", middle <= FIG1_CPU_WANTED
        ),
        _share(f"tables planned within {CPU_WANTED:g} s of CPU", [r.is_planned for r in tables], PLANNED_WANTED),
        _share("tables cleared, of those run", [r.outcome == "goal_reached" for r in runs], CLEARED_WANTED),
        Check("unsolvable: false plans", f"0 of {len(hopeless)}", str(len(false)), bool(hopeless) and not false),
        _share("unsolvable: right verdict and culprit", [r.is_told for r in hopeless], TOLD_WANTED),
        Check("plans: steps by the shortest known, worst", "≤ 1.1", f"{longest:.2f}", longest <= LENGTH_WANTED),
    ]


def _share(figure: str, reached: Sequence[bool], wanted: float) -> Check:
    """A share of cases; of none, nothing is reached."""
    measured = f"{sum(reached)} of {len(reached)}"
    return Check(figure, f"≥ {wanted:.0%}", measured, bool(reached) and sum(reached) >= wanted * len(reached))
