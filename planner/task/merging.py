"""Shorter plans: what is put down and taken up again later need not be, if what lies between can be done before or
after.

Chrpa, McCluskey, Osborne (Determining Redundant Actions in Sequential Plans, ICTAI 2012) take pairs of inverse actions
out of a plan where nothing between them depends on it; here what does depend on it is moved out from between them.
"""

from dataclasses import replace
from itertools import accumulate, combinations

from planner.task.symbols import Fact, Step, TaskPlan

Steps = tuple[Step, ...]
Facts = frozenset[Fact]


def merged(plan: TaskPlan, facts: Facts) -> TaskPlan:
    """The plan without the pairs of actions that undo each other and can be spared by reordering the others. From
    `facts` it leads to the goal as before; no step is new."""
    while (shorter := _without_a_pair(plan.steps, facts, plan.goal)) is not None:
        plan = replace(plan, steps=shorter)
    return plan


def _without_a_pair(steps: Steps, facts: Facts, goal: Facts) -> Steps | None:
    reached = tuple(accumulate(steps, lambda facts, step: step.apply(facts), initial=facts))
    for first, second in combinations(range(len(steps)), 2):
        if _is_undone(steps[first], steps[second]):
            before, between, after = steps[:first], steps[first + 1 : second], steps[second + 1 :]
            shorter = _later(before, between, after, reached[first], goal)
            shorter = shorter or _earlier(before, between, after, reached, goal)
            if shorter is not None:
                return shorter
    return None


def _is_undone(first: Step, by: Step) -> bool:
    return first.deletes <= by.adds and not first.adds.isdisjoint(by.deletes)


def _later(before: Steps, between: Steps, after: Steps, facts: Facts, goal: Facts) -> Steps | None:
    for at, step in enumerate((*after, None)):
        if _leads_to(goal, between + after[at:], facts):
            return before + after[:at] + between + after[at:]
        if step is None or not step.applicable(facts):
            break
        facts = step.apply(facts)
    return None


def _earlier(before: Steps, between: Steps, after: Steps, reached: tuple[Facts, ...], goal: Facts) -> Steps | None:
    for at in reversed(range(len(before))):
        if _leads_to(goal, between + before[at:] + after, reached[at]):
            return before[:at] + between + before[at:] + after
    return None


def _leads_to(goal: Facts, steps: Steps, facts: Facts) -> bool:
    for step in steps:
        if not step.applicable(facts):
            return False
        facts = step.apply(facts)
    return goal <= facts
