"""Task planning with Pyperplan: checked before, bounded, quiet, and the same in every process.

Pyperplan works on sets of strings, whose order changes with the hash seed and with it the plan.
Here facts become numbers and operators are sorted by name. Its searches know no bound, so the task
counts expansions itself.
"""

import logging
from collections.abc import Callable
from functools import cache, partial
from types import SimpleNamespace
from typing import Any

from planner.task.merging import merged
from planner.task.pddl import Domain, Problem
from planner.task.pddl_reader import read_domain, read_problem
from planner.task.primitives import ground
from planner.task.symbols import NoTaskPlan, TaskPlan, flaw

SMALL = 40
"""Ground operators up to which A* with h^max is tried first by `auto`."""

SMALL_EXPANSIONS = 300
"""Nodes after which `auto` gives up A* with h^max and goes on with weighted A* and h^FF."""

WEIGHT = 5.0
"""Weight of the heuristic in weighted A*."""

SEARCHES = ("auto", "astar-hmax", "wastar-hff", "gbfs-hff", "astar-blind")
"""auto: A* with h^max (optimal) while that is quick, then weighted A* with h^FF, whose plan is merged."""


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
        search = _Search(library, _numbered(library, domain_text, problem_text), max_expansions)
        names = self._auto(search) if self._search == "auto" else search.run(self._search)
        if names is not None:
            plan = _checked(domain, problem, names, search.expansions)
            return merged(plan, problem.init) if self._search == "auto" else plan
        return NoTaskPlan(search.is_exhausted, search.expansions)

    def _auto(self, search: "_Search") -> list[str] | None:
        if search.size <= SMALL:
            names = search.run("astar-hmax", SMALL_EXPANSIONS)
            if names is not None or search.is_exhausted:
                return names
        return search.run("wastar-hff")


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
    from pyperplan.heuristics import blind
    from pyperplan.pddl import parser
    from pyperplan.search import a_star

    from planner.task.relaxed import RelaxedHeuristic

    quiet = logging.getLogger(__name__)
    quiet.setLevel(logging.ERROR)
    modules: tuple[Any, ...] = (grounding, a_star)
    for module in modules:
        module.logging = quiet
    parts = {"grounding": grounding, "task": task, "parser": parser, "a_star": a_star}
    return SimpleNamespace(**parts, blind=blind, relaxed=RelaxedHeuristic)


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


class _Search:
    """Searches of one task, one after the other, that together expand `limit` nodes at most."""

    def __init__(self, library: SimpleNamespace, task: Any, limit: int) -> None:
        self.size = len(task.operators)
        self.expansions = 0
        self.is_exhausted = False
        self._library = library
        self._task = task
        self._limit = limit
        self._heuristics: dict[str, _Remembering] = {}

    def run(self, name: str, limit: int | None = None) -> list[str] | None:
        """Names of a plan's operators, or None: the space was searched whole or so many nodes expanded."""
        last = self._limit if limit is None else min(self._limit, self.expansions + limit)
        successors = self._library.task.Task.get_successor_states

        def counted(state: frozenset[int]) -> list[Any]:
            if self.expansions >= last:
                raise _OutOfExpansions
            self.expansions += 1
            return successors(self._task, state)

        self._task.get_successor_states = counted
        strategy, _, heuristic = name.partition("-")
        try:
            solution = self._strategy(strategy)(self._task, self._heuristic(heuristic))
        except _OutOfExpansions:
            return None
        self.is_exhausted = solution is None
        return None if solution is None else [operator.name for operator in solution]

    def _strategy(self, name: str) -> Callable[..., Any]:
        a_star = self._library.a_star
        strategies = {
            "astar": a_star.astar_search,
            "wastar": partial(a_star.weighted_astar_search, weight=WEIGHT),
            "gbfs": a_star.greedy_best_first_search,
        }
        return strategies[name]

    def _heuristic(self, name: str) -> _Remembering:
        if name not in self._heuristics:
            heuristics = {
                "hmax": partial(self._library.relaxed, is_max=True),
                "hff": partial(self._library.relaxed, is_max=False),
                "blind": self._library.blind.BlindHeuristic,
            }
            self._heuristics[name] = _Remembering(heuristics[name](self._task))
        return self._heuristics[name]


def _checked(domain: Domain, problem: Problem, names: list[str], expansions: int) -> TaskPlan:
    """The plan as steps: it must lead to the goal, else the search went wrong."""
    schemas = {schema.name: schema for schema in domain.actions}
    calls = [name.strip("()").split() for name in names]
    plan = TaskPlan(tuple(ground(schemas[title], tuple(args)) for title, *args in calls), problem.goal, expansions)
    wrong = flaw(plan, problem.init, problem.goal)
    if wrong is not None:
        raise RuntimeError(f"Pyperplan's plan does not work: {wrong}")
    return plan
