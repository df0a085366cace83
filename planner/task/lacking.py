"""What a scene lacks for a goal that no sequence of actions leads to, as far as a look at the predicates tells."""

from collections.abc import Collection

from planner.task.pddl import Domain
from planner.task.symbols import Fact


def lacking(domain: Domain, facts: Collection[Fact], missing: Collection[Fact]) -> list[str]:
    """For each action that could bring about a missing fact: what it needs that holds of nothing and that no action
    brings about, in sentences."""
    wanted = {fact.predicate for fact in missing}
    possible = {fact.predicate for fact in facts}.union(fact.predicate for a in domain.actions for fact in a.adds)
    found: dict[str, None] = {}
    for action in domain.actions:
        if wanted.intersection(fact.predicate for fact in action.adds):
            absent = [fact for fact in action.preconditions if fact.predicate not in possible]
            types = {parameter.name: f"some {parameter.type}" for parameter in action.parameters}
            told = [Fact(fact.predicate, tuple(types.get(arg, arg) for arg in fact.args)) for fact in absent]
            found |= {f"{action.name} needs {fact}, which holds of nothing here": None for fact in told}
    return list(found)
