"""`bench task`: planning alone, from 2 to 30 objects, with a stand-in for everything that has geometry.

The real search-then-sample loop plans random courses with the catalogue's domain. Four ways side by side: the default
search; A* with h^max as in the paper; the paper's fallback, which tries task plans one after the other and learns
nothing; and Fast Downward for what is proven of the shortest plan of each course's last round.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from rich.console import Console

import skills
from bt_tamp.bench import fast_downward
from bt_tamp.bench.checks import Check, at_most
from bt_tamp.bench.courses import Course, StandIn, random_course
from bt_tamp.bench.enumeration import first_that_works
from planner.refinement import Budget, Work
from planner.search_then_sample import PlanSettings, SearchThenSample, Solution
from planner.task.facts import goal_facts
from planner.task.pddl import Domain
from planner.task.pddl_reader import read_domain, read_text
from planner.task.primitives import arities
from planner.task.pyperplan_ import PyperplanPlanner
from planner.task.symbols import NoTaskPlan, TaskPlan

WHAT = "courses"
SIZES, SEEDS = (2, 3, 4, 6, 8, 10, 15, 20, 25, 30), 5
QUICK_SIZES, QUICK_SEEDS = (2, 4, 8, 30), 1

SETTINGS = PlanSettings(tries=20, max_rounds=60)
LARGEST = 30
CPU, LONGER = 0.3, 0.05
"""Seconds of CPU time a call, and share beyond the shortest plan, with the most objects."""

OPTIMAL_EXPANSIONS = 30_000
"""Nodes for one call of A* with h^max: more is giving up."""

ENUMERATED_EXPANSIONS = 20_000
"""Nodes for all task plans that the fallback tries."""


@dataclass(frozen=True)
class Tally:
    """What one way of searching made of a course. steps: of the plan, None without one. calls: CPU seconds of each call
    of the task planner, reading and grounding included. last: texts of the last call."""

    steps: int | None
    rounds: int
    calls: tuple[float, ...]
    last: tuple[str, str]


@dataclass(frozen=True)
class TaskResult:
    """One course. optimum: its shortest plan's length. proven and is_proof: Fast Downward's bound for the last round
    and whether that is a plan's length, None without it. tried: plans that the fallback tried. None: not asked."""

    size: int
    seed: int
    optimum: int
    steps: int | None
    rounds: int
    calls: tuple[float, ...]
    hmax_steps: int | None
    hmax_cpu: float | None
    fallback_steps: int | None
    tried: int | None
    fallback_cpu: float | None
    proven: int | None
    is_proof: bool
    proof_cpu: float | None


class _Timed:
    """A task planner, each of whose calls is timed."""

    def __init__(self, planner: PyperplanPlanner) -> None:
        self._planner = planner
        self.calls: list[float] = []
        self.last = ("", "")

    def solve(self, domain_text: str, problem_text: str, max_expansions: int) -> TaskPlan | NoTaskPlan:
        self.last = domain_text, problem_text
        begun = time.thread_time()
        found = self._planner.solve(domain_text, problem_text, max_expansions)
        self.calls.append(time.thread_time() - begun)
        return found


def planned(quick: bool) -> list[Course]:
    """The courses, small ones first."""
    sizes, seeds = (QUICK_SIZES, QUICK_SEEDS) if quick else (SIZES, SEEDS)
    return [random_course(size, seed) for size in sizes for seed in range(seeds)]


def measure(courses: Sequence[Course]) -> Iterator[TaskResult]:
    """Plan them one after the other.

    A* with h^max and the fallback aren't asked any more once they found no plan for any course of some size.
    """
    domain = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))
    plan_course(domain, random_course(2, 0), "auto")  # The first call imports and compiles.
    results: list[TaskResult] = []
    for course in courses:
        results.append(_measured(domain, course, _given_up(results, course.size)))
        yield results[-1]


def plan_course(domain: Domain, course: Course, search: str, **options: Any) -> Tally:
    """One course planned whole with one search."""
    timed = _Timed(PyperplanPlanner(search))
    refiners = dict.fromkeys(arities(domain), StandIn(course))
    settings = PlanSettings(**{**asdict(SETTINGS), **options})
    loop = SearchThenSample(timed, refiners, domain, settings, lambda kind, data: None)
    outcome = loop.plan(course.scene(), goal_facts(course.goal), np.random.default_rng(0), Work())
    steps = len(outcome.plan.steps) if isinstance(outcome, Solution) else None
    return Tally(steps, outcome.rounds, tuple(timed.calls), timed.last)


def _given_up(results: Sequence[TaskResult], size: int) -> set[str]:
    """Which of "hmax" and "fallback" found no plan for any course of some smaller size."""
    found = set()
    for smaller in {r.size for r in results if r.size < size}:
        mine = [r for r in results if r.size == smaller]
        found |= {"hmax"} if all(r.hmax_steps is None for r in mine) else set()
        found |= {"fallback"} if all(r.fallback_steps is None for r in mine) else set()
    return found


def _measured(domain: Domain, course: Course, given_up: set[str]) -> TaskResult:
    default = plan_course(domain, course, "auto")
    hmax = None
    if "hmax" not in given_up:
        hmax = plan_course(domain, course, "astar-hmax", max_expansions=OPTIMAL_EXPANSIONS, widenings=0)
    fallback, tried, fallback_cpu = None, None, None
    if "fallback" not in given_up:
        begun = time.thread_time()
        fallback, tried = first_that_works(domain, course, ENUMERATED_EXPANSIONS, Budget(SETTINGS.tries))
        fallback_cpu = time.thread_time() - begun
    proof = fast_downward.prove(*default.last) if fast_downward.is_there() else None
    return TaskResult(
        course.size,
        course.seed,
        course.shortest(),
        default.steps,
        default.rounds,
        default.calls,
        hmax.steps if hmax else None,
        sum(hmax.calls) if hmax else None,
        fallback,
        tried,
        fallback_cpu,
        proof.at_least if proof else None,
        proof is not None and proof.is_optimal,
        proof.cpu if proof else None,
    )


def said(result: TaskResult) -> str:
    """A course in a line."""
    steps = "no plan" if result.steps is None else f"{result.steps} actions (shortest {result.optimum})"
    return f"{result.size} objects: {steps}, {result.rounds} rounds, {sum(result.calls):.2f} s"


def records(results: Sequence[TaskResult]) -> list[dict[str, Any]]:
    """For JSON."""
    return [asdict(result) for result in results]


def excess(result: TaskResult) -> float:
    """Share by which the plan is longer than the shortest; NaN without a plan."""
    return float("nan") if result.steps is None else result.steps / result.optimum - 1.0


COLUMNS = (
    ("objects", 7, lambda r: str(r.size)),
    ("steps", 7, lambda r: _text(r.steps)),
    ("shortest", 9, lambda r: str(r.optimum)),
    ("longer", 8, lambda r: f"{100 * excess(r):.1f} %"),
    ("rounds", 7, lambda r: str(r.rounds)),
    ("s a call", 9, lambda r: f"{median(r.calls):.3f}"),
    ("max", 7, lambda r: f"{max(r.calls):.3f}"),
    ("all", 7, lambda r: f"{sum(r.calls):.2f}"),
    ("| A*+h^max", 11, lambda r: _text(r.hmax_steps)),
    ("s", 7, lambda r: _text(r.hmax_cpu, ".2f")),
    ("| fallback", 11, lambda r: _text(r.fallback_steps)),
    ("tried", 7, lambda r: _text(r.tried)),
    ("s", 7, lambda r: _text(r.fallback_cpu, ".2f")),
    ("| last round", 13, lambda r: "–" if r.proven is None else f"{'' if r.is_proof else '≥ '}{r.proven}"),
    ("s", 7, lambda r: _text(r.proof_cpu, ".2f")),
)
"""Heading, width and text of each column."""


def print_results(console: Console, results: Sequence[TaskResult]) -> None:
    """One row a course, then where the other searches gave up, and how the default search fared by size."""
    lines = ["".join(f"{name:>{width}}" for name, width, _ in COLUMNS)]
    lines += ["".join(f"{text(result):>{width}}" for _, width, text in COLUMNS) for result in results]
    lines.append(
        "CPU seconds; last round: what Fast Downward proves of the shortest plan, given what was learned by then"
    )
    for name, field in (("A*+h^max", "hmax_steps"), ("plans one after the other", "fallback_steps")):
        solved = [r.size for r in results if getattr(r, field) is not None]
        lines.append(f"{name}: beyond {max(solved, default=0)} objects: gave up")
    if not fast_downward.is_there():
        lines.append("no bounds on the length of the last round's plan: pip install bt-tamp[bench]")
    for size in sorted({r.size for r in results}):
        mine = [r for r in results if r.size == size and r.steps is not None]
        if mine:
            mean = 100 * sum(map(excess, mine)) / len(mine)
            whole = median(sum(r.calls) for r in mine)
            lines.append(
                f"{size} objects: {mean:.1f} % longer than the shortest on average, all rounds {whole:.2f} s (median)"
            )
    console.print("\n".join(lines), highlight=False, markup=False, soft_wrap=True)


def acceptance(results: Sequence[TaskResult]) -> list[Check]:
    """Time of a call and length of the plan with the most objects, and that every course has a plan."""
    largest = [r for r in results if r.size == LARGEST]
    found, total = sum(r.steps is not None for r in results), len(results)
    return [
        Check("courses with a plan", f"all of {total}", str(found), found == total),
        at_most(
            f"{LARGEST} objects: CPU time a call, median of a course", [median(r.calls) for r in largest], CPU, "s"
        ),
        at_most(f"{LARGEST} objects: CPU time of the longest call", [max(r.calls) for r in largest], CPU, "s"),
        at_most(
            f"{LARGEST} objects: longer than the shortest plan by",
            [100 * excess(r) for r in largest],
            100 * LONGER,
            "%",
        ),
    ]


def _text(value: float | None, form: str = "") -> str:
    return "–" if value is None else format(value, form)
