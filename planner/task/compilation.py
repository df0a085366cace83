"""Writes learned constraints into PDDL: positive facts and operator variants, no more parameters than before.

An action instance under a constraint no longer comes from its plain schema, which asks for the
static fact `may--SCHEMA(args)`, listed for all other instances. It comes from one variant for each
minimal set of what has to be away; `may--SCHEMA--K(args)` says which variants are whose. That a
body has left the spot where an action put it is `left--K--ACTION(body)`: true at first, deleted by
that very action, achieved by every other that moves the body; for spots as observed, `away` says it.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from planner.task.learned import Needs, Options
from planner.task.pddl import OBJECT, ActionSchema, Domain, Parameter, Problem
from planner.task.primitives import AWAY, VARIANT, own_parameters, primitive
from planner.task.situation import in_order
from planner.task.symbols import Fact, GroundAction

MAY = f"may{VARIANT}"
LEFT = f"left{VARIANT}"


def with_constraints(
    domain: Domain, problem: Problem, constraints: Mapping[GroundAction, Options]
) -> tuple[Domain, Problem]:
    """Domain and problem in which the constrained actions need what they are known to need.

    The domain's actions all achieve `away` for what they move (`primitives.with_away`).
    """
    if not constraints:
        return domain, problem
    compiler = _Compiler(domain, problem, constraints)
    actions = compiler.schemas()
    constants = {**domain.constants, **{name: compiler.types[name] for name in sorted(compiler.named)}}
    objects = {name: type_ for name, type_ in problem.objects.items() if name not in constants}
    predicates = {**domain.predicates, **compiler.predicates}
    return (
        replace(domain, constants=constants, predicates=predicates, actions=actions),
        replace(problem, objects=objects, init=problem.init | compiler.init),
    )


@dataclass(frozen=True)
class Variant:
    """What sets some instances of a schema apart: the literals they need besides, and those they delete."""

    needs: tuple[Fact, ...] = ()
    deletes: tuple[Fact, ...] = ()


PLAIN = Variant()


class _Compiler:
    """One compilation: the names that exist, the constraints that can be stated with them, and what they add."""

    def __init__(self, domain: Domain, problem: Problem, constraints: Mapping[GroundAction, Options]) -> None:
        self._domain = domain
        self.types = {**domain.constants, **problem.objects}
        possible = {
            action: [needs for needs in options if all(spot.body in self.types for spot in needs)]
            for action, options in constraints.items()
        }
        spots = frozenset(spot for options in possible.values() for needs in options for spot in needs)
        self.named = {spot.body for spot in spots}
        self._left = {
            spot: Fact(f"{LEFT}{index}{VARIANT}{'-'.join((spot.left_by.name, *spot.left_by.args))}", (spot.body,))
            for index, spot in enumerate(in_order(spots))
            if spot.left_by is not None
        }
        self.init = set(self._left.values())
        self.predicates: dict[str, tuple[Parameter, ...]] = {
            literal.predicate: (Parameter("?o", OBJECT),) for literal in self._left.values()
        }
        self._variants = self._apart(possible)

    def schemas(self) -> tuple[ActionSchema, ...]:
        """The domain's schemas with their variants."""
        return tuple(variant for schema in self._domain.actions for variant in self._split(schema))

    def _apart(self, possible: Mapping[GroundAction, Sequence[Needs]]) -> dict[GroundAction, list[Variant]]:
        """For every action that isn't as its schema has it: what it can be instead."""
        deletes: dict[GroundAction, list[Fact]] = {}
        for spot, literal in self._left.items():
            if spot.left_by is not None:
                deletes.setdefault(spot.left_by, []).append(literal)
        found: dict[GroundAction, list[Variant]] = {}
        for action in dict.fromkeys((*possible, *deletes)):
            needs = sorted(map(self._literals, possible.get(action, [frozenset()])))
            found[action] = [Variant(literals, tuple(deletes.get(action, ()))) for literals in needs]
        return found

    def _literals(self, needs: Needs) -> tuple[Fact, ...]:
        return tuple(self._left.get(spot) or Fact(AWAY, (spot.body,)) for spot in in_order(needs))

    def _split(self, schema: ActionSchema) -> Iterator[ActionSchema]:
        name, parameters = primitive(schema.name), own_parameters(schema)
        instances = self._instances(parameters)
        if not any(GroundAction(name, args) in self._variants for args in instances):
            yield self._marking(schema, PLAIN)
            return
        allowed: dict[Variant, list[tuple[str, ...]]] = {PLAIN: []}
        for args in instances:
            for variant in self._variants.get(GroundAction(name, args), [PLAIN]):
                allowed.setdefault(variant, []).append(args)
        for index, (variant, whose) in enumerate(allowed.items()):
            title = f"{schema.name}{VARIANT}{index}" if index else schema.name
            self.predicates[MAY + title] = tuple(Parameter(parameter.name, OBJECT) for parameter in parameters)
            self.init |= {Fact(MAY + title, args) for args in whose}
            permission = Fact(MAY + title, tuple(parameter.name for parameter in parameters))
            yield replace(
                self._marking(schema, variant),
                name=title,
                preconditions=(*schema.preconditions, permission, *variant.needs),
                note=", ".join(str(GroundAction(name, args)) for args in whose) if index else schema.note,
            )

    def _instances(self, parameters: Sequence[Parameter]) -> list[tuple[str, ...]]:
        """All arguments that the parameters' types allow."""
        fitting = [
            [name for name, type_ in self.types.items() if self._domain.is_kind(type_, parameter.type)]
            for parameter in parameters
        ]
        return list(itertools.product(*fitting))

    def _marking(self, schema: ActionSchema, variant: Variant) -> ActionSchema:
        """The schema with its effects on `left` literals."""
        gone = {literal.predicate for literal in variant.deletes}
        mover = (schema.parameters[0].name,)
        left = [Fact(literal.predicate, mover) for literal in self._left.values() if literal.predicate not in gone]
        return replace(schema, adds=(*schema.adds, *left), deletes=(*schema.deletes, *variant.deletes))
