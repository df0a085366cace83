"""Facts, ground actions and task plans."""

from dataclasses import dataclass
from typing import NamedTuple


class Fact(NamedTuple):
    """A ground positive literal, `in_bin(book, table)`. A tuple, as sets of them are compared at every tick."""

    predicate: str
    args: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.predicate}({', '.join(self.args)})"

    @property
    def pddl(self) -> str:
        """The literal as PDDL text."""
        return f"({' '.join((self.predicate, *self.args))})"


@dataclass(frozen=True, order=True)
class GroundAction:
    """A primitive with its arguments, `drag(book, table)`."""

    name: str
    args: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.name}({', '.join(self.args)})"


@dataclass(frozen=True)
class Step:
    """A plan's step: the action, and the facts it needs, adds and deletes (as the planner grounded it)."""

    action: GroundAction
    preconditions: frozenset[Fact]
    adds: frozenset[Fact]
    deletes: frozenset[Fact]

    def applicable(self, facts: frozenset[Fact]) -> bool:
        """Do the facts satisfy every precondition?"""
        return self.preconditions <= facts

    def apply(self, facts: frozenset[Fact]) -> frozenset[Fact]:
        """The facts after the step (deletes before adds, as in STRIPS)."""
        return (facts - self.deletes) | self.adds


@dataclass(frozen=True)
class TaskPlan:
    """Steps in the order in which they are to be done, and the goal they lead to.

    `expansions` counts the search nodes that finding it took.
    """

    steps: tuple[Step, ...]
    goal: frozenset[Fact]
    expansions: int = 0

    @property
    def actions(self) -> tuple[GroundAction, ...]:
        return tuple(step.action for step in self.steps)


@dataclass(frozen=True)
class NoTaskPlan:
    """The task planner found nothing. `exhausted`: the search space was searched whole, so none exists.

    `failure`: what went wrong in the planner itself, "" if nothing did.
    """

    exhausted: bool
    expansions: int
    failure: str = ""


def flaw(plan: TaskPlan, facts: frozenset[Fact], goal: frozenset[Fact]) -> str | None:
    """What is wrong with a plan from these facts to the goal; None if every step applies in turn and the goal holds."""
    for number, step in enumerate(plan.steps, start=1):
        if not step.applicable(facts):
            missing = ", ".join(map(str, sorted(step.preconditions - facts)))
            return f"step {number}, {step.action}, needs {missing}"
        facts = step.apply(facts)
    return None if goal <= facts else f"it misses {', '.join(map(str, sorted(goal - facts)))}"


def resume_at(plan: TaskPlan, facts: frozenset[Fact], first: int = 0) -> int | None:
    """The largest k ≥ `first` such that the steps from k on are applicable one after the other and reach the goal.

    A step that isn't applicable because all it adds is there already is passed over: another one brought it about.
    len(plan.steps) when the goal holds already; None when no such k exists.
    """
    return next((k for k in range(len(plan.steps), first - 1, -1) if _leads_to_goal(plan, facts, k)), None)


def _leads_to_goal(plan: TaskPlan, facts: frozenset[Fact], k: int) -> bool:
    for step in plan.steps[k:]:
        if step.applicable(facts):
            facts = step.apply(facts)
        elif not step.adds <= facts:
            return False
    return plan.goal <= facts
