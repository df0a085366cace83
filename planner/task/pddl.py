"""PDDL domains and problems as plain data, and their text: typed STRIPS with positive conditions.

Literals are `Fact`s; in an action schema their arguments may be variables (`?o`).
`pddl_reader` reads and checks the same subset.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from planner.task.sexpr import Position
from planner.task.symbols import Fact

OBJECT = "object"
"""The type above all others."""


@dataclass(frozen=True)
class Parameter:
    """A typed variable, `?o - movable`."""

    name: str
    type: str


@dataclass(frozen=True)
class ActionSchema:
    """An action over variables. `note` is a comment for people."""

    name: str
    parameters: tuple[Parameter, ...]
    preconditions: tuple[Fact, ...]
    adds: tuple[Fact, ...]
    deletes: tuple[Fact, ...]
    note: str = field(default="", compare=False)


Places = Mapping[Any, Position]
"""Where in the file the names (actions, objects) and the init facts stand; empty for what was not read from one."""


@dataclass(frozen=True)
class Domain:
    """Types (name → parent), constants (name → type), predicates (name → parameters) and actions."""

    name: str
    types: Mapping[str, str]
    constants: Mapping[str, str]
    predicates: Mapping[str, tuple[Parameter, ...]]
    actions: tuple[ActionSchema, ...]
    places: Places = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("types", "constants", "predicates"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def is_kind(self, type_: str, ancestor: str) -> bool:
        """Is `type_` the same as `ancestor` or below it?"""
        while type_ != ancestor:
            if type_ == OBJECT:
                return False
            type_ = self.types.get(type_, OBJECT)
        return True


@dataclass(frozen=True)
class Problem:
    """Objects (name → type, constants left out), the facts that hold, and the goal's."""

    name: str
    domain: str
    objects: Mapping[str, str]
    init: frozenset[Fact]
    goal: frozenset[Fact]
    places: Places = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "objects", MappingProxyType(dict(self.objects)))


def bound(literals: Iterable[Fact], binding: Mapping[str, str]) -> frozenset[Fact]:
    """The literals with their variables replaced."""
    return frozenset(Fact(fact.predicate, tuple(binding.get(arg, arg) for arg in fact.args)) for fact in literals)


def write_domain(domain: Domain) -> str:
    """The domain as PDDL text that Pyperplan reads."""
    lines = [f"(define (domain {domain.name})", "  (:requirements :strips :typing)"]
    if domain.types:
        lines.append(f"  (:types{_typed_lines(domain.types)})")
    if domain.constants:
        lines.append(f"  (:constants{_typed_lines(domain.constants)})")
    predicates = "".join(
        f"\n    ({' '.join([name, *_parameters(parameters)])})" for name, parameters in domain.predicates.items()
    )
    lines.append(f"  (:predicates{predicates})")
    lines += [_action(action) for action in domain.actions]
    return "\n".join(lines) + "\n)\n"


def write_problem(problem: Problem) -> str:
    """The problem as PDDL text that Pyperplan reads; facts in alphabetical order."""
    init = "".join(f"\n    {fact.pddl}" for fact in sorted(problem.init))
    goal = "".join(f"\n    {fact.pddl}" for fact in sorted(problem.goal))
    return (
        f"(define (problem {problem.name})\n"
        f"  (:domain {problem.domain})\n"
        f"  (:objects{_typed_lines(problem.objects)})\n"
        f"  (:init{init})\n"
        f"  (:goal (and{goal}))\n"
        ")\n"
    )


def _typed_lines(types: Mapping[str, str]) -> str:
    """One line a type, names in the order given."""
    groups: dict[str, list[str]] = {}
    for name, type_ in types.items():
        groups.setdefault(type_, []).append(name)
    return "".join(f"\n    {' '.join(names)} - {type_}" for type_, names in groups.items())


def _parameters(parameters: Iterable[Parameter]) -> list[str]:
    return [f"{parameter.name} - {parameter.type}" for parameter in parameters]


def _action(action: ActionSchema) -> str:
    note = f"  ; {action.note}\n" if action.note else ""
    effects = [fact.pddl for fact in action.adds] + [f"(not {fact.pddl})" for fact in action.deletes]
    return (
        f"{note}  (:action {action.name}\n"
        f"    :parameters ({' '.join(_parameters(action.parameters))})\n"
        f"    :precondition (and {' '.join(fact.pddl for fact in action.preconditions)})\n"
        f"    :effect (and {' '.join(effects)}))"
    )
