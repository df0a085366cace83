"""`bench motion`: the paper's comparison of motion planners (section IV-C) on fig1 and on random tables, beside the
`pybullet-planning` package, and beside the same planner wholly compiled."""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from bt_tamp.bench.checks import Check, at_least, at_most
from bt_tamp.bench.hopeless import Hopeless, lowered, walled
from bt_tamp.bench.motion_queries import SCENE, MotionQuery, plan_queries, table_query
from bt_tamp.bench.motion_trials import Arena, Move, Trial, best_length, by_pybullet, compiled, move, search
from planner.failure import MotionFailure
from planner.motion.motion_planner import MotionPlanner
from planner.motion.ompl_ import PLANNERS
from sim.robot import RobotModel

WHAT = "scenes"
TABLES = 30
SEEDS = 20
PYBULLET_SEEDS = 2
BEST_S = 30.0
"""CPU seconds that AORRTC searches on every query without a straight way."""

INSTALL = "pybullet-planning is not installed: pip install bt-tamp[bench]"

THREADED = "PRMstar looks for its path in a thread of its own: its rows may differ from run to run"

ONE_WAY, BOTH_WAYS = "RRT", "RRTConnect"
"""What the paper compares: RRT with goal bias, and bidirectional RRT."""


@dataclass(frozen=True)
class Job:
    """One scene, the shipped one or a random table, and how much is done in it. best_s: seconds, 0 for not at all."""

    table: int | None
    seeds: int
    pybullet_seeds: int
    best_s: float

    @property
    def name(self) -> str:
        return SCENE if self.table is None else f"table {self.table}"


@dataclass(frozen=True)
class QueryResult:
    """One query. pybullet: None if the package is missing. best: rad, NaN if it was not sought."""

    name: str
    is_straight: bool
    trials: tuple[Trial, ...]
    compiled: tuple[Trial, ...]
    pybullet: tuple[Trial, ...] | None
    moves: tuple[Move, ...]
    best: float

    @property
    def way_s(self) -> float:
        """Median CPU seconds of a feasibility query."""
        return float(np.median([move.way_s for move in self.moves]))

    @property
    def shortest(self) -> float:
        """Length in rad of the shortest path seen in this run."""
        lengths = [trial.short for trial in (*self.trials, *self.compiled)]
        return float(np.nanmin([*lengths, self.best]))


@dataclass(frozen=True)
class Refusal:
    """A hopeless query: CPU seconds until the answer, the reason, and whether it was refused at all."""

    name: str
    kind: str
    seconds: float
    reason: str
    is_refused: bool


@dataclass(frozen=True)
class SceneResult:
    """All queries of one scene."""

    name: str
    queries: tuple[QueryResult, ...]
    refusals: tuple[Refusal, ...]


def planned(quick: bool) -> list[Job]:
    """The scenes."""
    if quick:
        return [Job(None, 1, 1, 0.0), *(Job(seed, 1, 1, 2.0 if seed < 3 else 0.0) for seed in range(4))]
    return [Job(table, SEEDS, PYBULLET_SEEDS, BEST_S) for table in (None, *range(TABLES))]


def measure(jobs: Sequence[Job]) -> Iterator[SceneResult]:
    """Run them one after the other. What is compiled at its first use is used before."""
    for query in _queries(jobs[0])[:1]:
        _solve(query, Job(None, 1, 0, 0.0))
    for job in jobs:
        queries = _queries(job)
        solved = [result for query in queries if (result := _solve(query, job)) is not None]
        refusals = [] if job.table is None else [_refusal(hopeless) for query in queries for hopeless in _spoilt(query)]
        yield SceneResult(job.name, tuple(solved), tuple(refusals))


def _queries(job: Job) -> list[MotionQuery]:
    if job.table is None:
        return plan_queries()
    query = table_query(job.table)
    return [] if query is None else [query]


def _solve(query: MotionQuery, job: Job) -> QueryResult | None:
    """None if the fast model, with which all plan, refuses the start or the goal."""
    arena = Arena(query)
    if not arena.is_solvable():
        return None
    seeds = range(job.seeds)
    try:
        pybullet = tuple(by_pybullet(arena, range(job.pybullet_seeds)))
    except ImportError:
        pybullet = None
    return QueryResult(
        query.name,
        arena.is_straight(),
        tuple(search(arena, planner, seed) for planner in PLANNERS for seed in seeds),
        tuple(compiled(arena, seed) for seed in seeds),
        pybullet,
        tuple(move(arena, seed) for seed in seeds),
        best_length(arena, job.best_s) if job.best_s else math.nan,
    )


def _spoilt(query: MotionQuery) -> Iterator[Hopeless]:
    placed = query.scene.scenario.robot
    motion = MotionPlanner(RobotModel(placed.model, placed.X_WB))
    for spoil in (lowered, walled):
        hopeless = spoil(motion, query)
        if hopeless is not None:
            yield hopeless


def _refusal(hopeless: Hopeless) -> Refusal:
    query = hopeless.query
    placed = query.scene.scenario.robot
    motion = MotionPlanner(RobotModel(placed.model, placed.X_WB))
    started = time.thread_time()
    outcome = motion.move(query.scene, [query.goal], query.allowed)
    seconds = time.thread_time() - started
    refused = isinstance(outcome, MotionFailure)
    return Refusal(query.name, hopeless.kind, seconds, outcome.reason if refused else "", refused)


def said(result: SceneResult) -> str:
    """A scene in a line."""
    if not result.queries:
        return f"{result.name}: nothing asked"
    way = 1e3 * np.median([query.way_s for query in result.queries])
    return f"{result.name}: {len(result.queries)} queries, feasibility {way:.1f} ms"


def records(results: Sequence[SceneResult]) -> list[dict[str, Any]]:
    """For JSON."""
    return [asdict(result) for result in results]


def queries_of(results: Sequence[SceneResult]) -> list[QueryResult]:
    """All queries of all scenes."""
    return [query for result in results for query in result.queries]


@dataclass(frozen=True)
class Row:
    """A planner over all queries: share solved, CPU ms (median and 95 % of the cases), and length by the shortest path
    known of the same query, as found and after shortcutting (medians)."""

    planner: str
    solved: float
    median_ms: float
    p95_ms: float
    length: float
    short: float


def rows(queries: Sequence[QueryResult]) -> list[Row]:
    """The comparison, planner by planner, then the compiled one and pybullet-planning."""
    trials = [
        (trial, query.shortest)
        for query in queries
        for trial in (*query.trials, *query.compiled, *(query.pybullet or ()))
    ]
    names = dict.fromkeys(trial.planner for trial, _ in trials)
    return [_row(name, [case for case in trials if case[0].planner == name]) for name in names]


def _row(name: str, cases: Sequence[tuple[Trial, float]]) -> Row:
    """Of trials of one planner, each with the length of the shortest path known."""
    seconds = [1e3 * (trial.found_s + trial.short_s) for trial, _ in cases]
    solved = [(trial.length / shortest, trial.short / shortest) for trial, shortest in cases if trial.is_found]
    length, short = np.median(solved, axis=0) if solved else (math.nan, math.nan)
    return Row(
        name,
        len(solved) / len(cases),
        float(np.median(seconds)),
        float(np.percentile(seconds, 95)),
        float(length),
        float(short),
    )


def answer(queries: Sequence[QueryResult]) -> str:
    """Does the bidirectional planner still give the longer paths? On the queries that have no straight way."""
    pairs = []
    for query in queries:
        one, both = ([t for t in query.trials if t.planner == name and t.is_found] for name in (ONE_WAY, BOTH_WAYS))
        if one and both and not query.is_straight:
            pairs.append([[np.mean([getattr(t, key) for t in side]) for side in (one, both)] for key in _COMPARED])
    if not pairs:
        return "bidirectional RRT against RRT with goal bias: no query that both solve"
    time_ratio, found, short = np.median([[both / one for one, both in pair] for pair in pairs], axis=0)
    verdict = "yes" if found > 1.0 else "no"
    return (
        f"Does bidirectional RRT give longer paths than RRT with goal bias? {verdict}: {found:.2f} times as long as "
        f"found, {short:.2f} times after shortcutting, in {time_ratio:.2f} times the CPU time "
        f"(medians of {len(pairs)} queries without a straight way)"
    )


_COMPARED = ("found_s", "length", "short")


def print_results(console: Console, results: Sequence[SceneResult]) -> None:
    """The comparison, the paper's question answered, and what the machine itself does."""
    queries = queries_of(results)
    straight = sum(query.is_straight for query in queries)
    table = Table(
        caption=f"{len(queries)} queries, {straight} with a free straight way; lengths by the shortest path known",
        caption_justify="left",
    )
    for heading in ("planner", "solved", "CPU ms", "95 %", "length", "shortened"):
        table.add_column(heading, justify="left" if heading == "planner" else "right")
    for row in rows(queries):
        numbers = (f"{row.median_ms:.1f}", f"{row.p95_ms:.1f}", f"{row.length:.2f}", f"{row.short:.2f}")
        table.add_row(row.planner, f"{100 * row.solved:.0f} %", *numbers)
    console.print(table)
    lines = [THREADED, answer(queries)]
    moves = [move for query in queries for move in query.moves]
    ways, whole = (1e3 * np.array([getattr(move, key) for move in moves]) for key in ("way_s", "move_s"))
    lines.append(f"feasibility query: {np.median(ways):.2f} ms, 95 % {np.percentile(ways, 95):.2f} ms")
    lines.append(f"with timing and audit: {np.median(whole):.2f} ms, 95 % {np.percentile(whole, 95):.2f} ms")
    if any(query.pybullet is None for query in queries):
        lines.append(INSTALL)
    for refusal in (refusal for result in results for refusal in result.refusals):
        verdict = refusal.reason if refusal.is_refused else "NOT refused"
        lines.append(f"{refusal.name}, {refusal.kind}: {1e3 * refusal.seconds:.1f} ms, {verdict}")
    console.print("\n".join(lines), highlight=False, markup=False, soft_wrap=True)


def acceptance(results: Sequence[SceneResult]) -> list[Check]:
    """The figures to reach."""
    queries = queries_of(results)
    moves = [move for query in queries for move in query.moves]
    ways = [1e3 * move.way_s for move in moves]
    free = sum(move.is_free for move in moves)
    beside_best = [
        float(np.median([move.length for move in query.moves])) / query.best for query in queries if query.best > 0
    ]
    faster = [
        float(np.median([trial.found_s for trial in query.pybullet])) / query.way_s
        for query in queries
        if query.pybullet
    ]
    refusals = [refusal for result in results for refusal in result.refusals]
    return [
        at_most("feasibility query, median", [float(np.median(ways))], 2.0, "ms"),
        at_most("feasibility query, 95 %", [float(np.percentile(ways, 95))], 10.0, "ms"),
        at_most("executed path beside the best of AORRTC's", beside_best, 1.15, "times"),
        at_least("faster than pybullet-planning, median", [float(np.median(faster))] if faster else [], 300.0, "times"),
        Check("executed motions that pass the exact audit", "100 %", f"{free} of {len(moves)}", free == len(moves)),
        at_most("hopeless queries, until refused", [1e3 * refusal.seconds for refusal in refusals], 50.0, "ms"),
        Check(
            "hopeless queries refused",
            "100 %",
            f"{sum(refusal.is_refused for refusal in refusals)} of {len(refusals)}",
            all(refusal.is_refused for refusal in refusals),
        ),
    ]
