"""Task planning with Pyperplan: checked before, bounded, quiet, and the same in every process.

Pyperplan works on sets of strings, whose order changes with the hash seed and with it the plan.
Here facts become numbers and operators are sorted by name. Its searches know no bound, so the task
counts expansions itself.
"""

import logging
from collections.abc import Callable
from functools import cache
from types import SimpleNamespace
from typing import Any

from planner.task.pddl import Domain, Problem
from planner.task.pddl_reader import read_domain, read_problem
from planner.task.primitives import ground
from planner.task.symbols import NoTaskPlan, TaskPlan, flaw

SMALL = 40
"""Ground operators up to which A* with h^max is tried first by `auto`."""

SMALL_EXPANSIONS = 300
"""Nodes after which `auto` gives up A* with h^max and goes on with weighted A* and h^FF."""

WEIGHT = 5
"""Weight of the heuristic in weighted A*."""

SEARCHES = ("auto", "astar-hmax", "wastar-hff", "gbfs-hff", "astar-blind")
"""auto: A* with h^max (optimal) while that is quick, then weighted A* with h^FF."""


class PyperplanPlanner:
    """Finds plans with one of Pyperplan's searches. Raises ValueError for an unknown one."""

    def __init__(self, search: str = "auto") -> None:
        if search not in SEARCHES:
            raise ValueError(f"unknown search {search!r}, expected one of {', '.join(SEARCHES)}")
        self._search = search

    def solve(self, domain_text: str, problem_text: str, max_expansions: int) -> TaskPlan | NoTaskPlan:
        """A plan for a problem in PDDL, expanding so many search nodes at most.

        Raises PddlError for a text that can't be used.
        """
        domain = read_domain(domain_text)
        problem = read_problem(problem_text, domain)
        library = _pyperplan()
        task = _numbered(library, domain_text, problem_text)
        limit = max_expansions
        if self._search == "auto" and len(task.operators) <= SMALL:
            searches = [("astar-hmax", min(SMALL_EXPANSIONS, max_expansions)), ("wastar-hff", max_expansions)]
        else:
            searches = [("wastar-hff" if self._search == "auto" else self._search, max_expansions)]
        expansions = 0
        for name, limit in searches:
            names, exhausted, count = _run(library, name, task, limit - expansions)
            expansions += count
            if names is not None:
                return _checked(domain, problem, names, expansions)
            if exhausted:
                return NoTaskPlan(True, expansions)
        return NoTaskPlan(False, expansions)


class _OutOfExpansions(Exception):
    """The bound on expansions is reached."""


class _Remembering:
    """A heuristic that is computed once a state: A* meets most states several times."""

    def __init__(self, heuristic: Callable[[Any], float]) -> None:
        self._heuristic = heuristic
        self._values: dict[frozenset[int], float] = {}

    def __call__(self, node: Any) -> float:
        value = self._values.get(node.state)
        if value is None:
            value = self._values[node.state] = self._heuristic(node)
        return value


@cache
def _pyperplan() -> SimpleNamespace:
    """Pyperplan's parts, imported when first needed and given a logger of their own: they write to the root's."""
    from pyperplan import grounding, task
    from pyperplan.heuristics import blind, relaxation
    from pyperplan.pddl import parser
    from pyperplan.search import a_star

    quiet = logging.getLogger(__name__)
    quiet.setLevel(logging.ERROR)
    modules: tuple[Any, ...] = (grounding, a_star)
    for module in modules:
        module.logging = quiet
    parts = {"grounding": grounding, "task": task, "parser": parser, "a_star": a_star}
    return SimpleNamespace(**parts, blind=blind, relaxation=relaxation)


def _numbered(library: SimpleNamespace, domain_text: str, problem_text: str) -> Any:
    """The ground task with facts as numbers, in the order of their names, and operators sorted by name."""
    parser = library.parser.Parser(None)
    parser.domInput = domain_text
    parsed_domain = parser.parse_domain(read_from_file=False)
    parser.probInput = problem_text
    grounded = library.grounding.ground(parser.parse_problem(parsed_domain, read_from_file=False))
    number = {fact: index for index, fact in enumerate(sorted(grounded.facts))}

    def numbers(facts: frozenset[str]) -> frozenset[int]:
        return frozenset(sorted(number[fact] for fact in facts))

    operators = [
        library.task.Operator(op.name, numbers(op.preconditions), numbers(op.add_effects), numbers(op.del_effects))
        for op in sorted(grounded.operators, key=lambda op: op.name)
    ]
    facts = numbers(grounded.facts)
    return library.task.Task(grounded.name, facts, numbers(grounded.initial_state), numbers(grounded.goals), operators)


def _run(library: SimpleNamespace, name: str, task: Any, limit: int) -> tuple[list[str] | None, bool, int]:
    """Names of the plan's operators or None, was the space searched whole, and nodes expanded."""
    count = 0
    successors = library.task.Task.get_successor_states

    def counted(state: frozenset[int]) -> list[Any]:
        nonlocal count
        if count >= limit:
            raise _OutOfExpansions
        count += 1
        return successors(task, state)

    task.get_successor_states = counted
    search, heuristic = _search(library, name)
    try:
        solution = search(task, _Remembering(heuristic(task)))
    except _OutOfExpansions:
        return None, False, count
    return (None if solution is None else [operator.name for operator in solution]), True, count


def _search(library: SimpleNamespace, name: str) -> tuple[Callable[..., Any], Callable[..., Any]]:
    strategy, _, heuristic = name.partition("-")
    a_star = library.a_star
    searches = {
        "astar": a_star.astar_search,
        "wastar": lambda task, h: a_star.weighted_astar_search(task, h, weight=WEIGHT),
        "gbfs": a_star.greedy_best_first_search,
    }
    heuristics = {
        "hmax": library.relaxation.hMaxHeuristic,
        "hff": library.relaxation.hFFHeuristic,
        "blind": library.blind.BlindHeuristic,
    }
    return searches[strategy], heuristics[heuristic]


def _checked(domain: Domain, problem: Problem, names: list[str], expansions: int) -> TaskPlan:
    """The plan as steps: it must lead to the goal, else the search went wrong."""
    schemas = {schema.name: schema for schema in domain.actions}
    calls = [name.strip("()").split() for name in names]
    plan = TaskPlan(tuple(ground(schemas[title], tuple(args)) for title, *args in calls), problem.goal, expansions)
    wrong = flaw(plan, problem.init, problem.goal)
    if wrong is not None:
        raise RuntimeError(f"Pyperplan's plan does not work: {wrong}")
    return plan
