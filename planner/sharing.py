"""Shares out what a plan puts away among places that are as good as each other, so that none is crowded for nothing.

To the task planner one bin is like another, and it fills the first. What is refined is a plan of the same length that
puts each thing where the fewest lie.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

from planner.task.pddl import Domain, Problem
from planner.task.primitives import ground, own_parameters, primitive
from planner.task.symbols import Step, TaskPlan, flaw

LIES = "in_bin"


def shared_out(plan: TaskPlan, domain: Domain, problem: Problem) -> TaskPlan:
    """The plan with other places for what it puts down, of the same type each, as far as it still works."""
    there = Counter(fact.args[1] for fact in problem.init if fact.predicate == LIES)
    for position, step in enumerate(plan.steps):
        options = [step, *_others(step, domain, problem)]
        for option in sorted(options, key=lambda option: there[option.action.args[-1]]):
            steps = (*plan.steps[:position], option, *plan.steps[position + 1 :])
            if option is step or flaw(replace(plan, steps=steps), problem.init, problem.goal) is None:
                plan = replace(plan, steps=steps)
                there.update(fact.args[1] for fact in option.adds if fact.predicate == LIES)
                there.subtract(fact.args[1] for fact in option.deletes if fact.predicate == LIES)
                break
    return plan


def _others(step: Step, domain: Domain, problem: Problem) -> Iterator[Step]:
    """The same action to every other place of the same type."""
    if not any(fact.predicate == LIES and fact.args[1] == step.action.args[-1] for fact in step.adds):
        return
    name, args = step.action.name, step.action.args
    types = {**domain.constants, **problem.objects}
    alike = sorted(place for place, type_ in types.items() if type_ == types[args[-1]] and place != args[-1])
    for schema in domain.actions:
        own = own_parameters(schema)
        if primitive(schema.name) != name or len(own) != len(schema.parameters):
            continue
        for place in alike:
            called = (*args[:-1], place)
            kinds = zip(own, called, strict=True)
            if all(domain.is_kind(types[thing], parameter.type) for parameter, thing in kinds):
                yield ground(schema, called)
