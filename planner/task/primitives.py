"""How action schemas stand for primitives.

Several schemas may be variants of one primitive: `NAME--SUFFIX` belongs to the primitive `NAME`. A
primitive's own arguments are the parameters before the first one called `?with…`; what follows is
bound by the task planner alone (PDDL without existentials names the tool that the hand holds). The
first argument is the body that the action moves.
"""

from collections.abc import Mapping
from dataclasses import replace

from planner.task.pddl import OBJECT, ActionSchema, Domain, Parameter, bound
from planner.task.sexpr import PddlError
from planner.task.symbols import Fact, GroundAction, Step
from scenarios.names import known

VARIANT = "--"
IMPLICIT = "?with"

AWAY = "away"
"""away(body): the body isn't where it is known to be in the way. Every action achieves it for what it moves."""

GRASPABLE = "graspable"
"""graspable(body): nothing learned speaks against grasping the body as it lies."""

STUCK = "stuck"
"""stuck(body): the body can't be taken up as it lies, and must be moved otherwise first."""


def primitive(schema_name: str) -> str:
    """The primitive that a schema stands for."""
    return schema_name.partition(VARIANT)[0]


def own_parameters(schema: ActionSchema) -> tuple[Parameter, ...]:
    """The parameters that are the primitive's own arguments."""
    names = [parameter.name.startswith(IMPLICIT) for parameter in schema.parameters]
    return schema.parameters[: names.index(True) if True in names else None]


def ground(schema: ActionSchema, args: tuple[str, ...]) -> Step:
    """The step that a schema becomes with all its parameters bound to `args`."""
    binding = {parameter.name: arg for parameter, arg in zip(schema.parameters, args, strict=True)}
    action = GroundAction(primitive(schema.name), args[: len(own_parameters(schema))])
    literals = (bound(part, binding) for part in (schema.preconditions, schema.adds, schema.deletes))
    return Step(action, *literals)


def arities(domain: Domain) -> dict[str, int]:
    """Number of own arguments by primitive. Raises PddlError if a primitive's schemas differ or move nothing."""
    found: dict[str, int] = {}
    for schema in domain.actions:
        name, count = primitive(schema.name), len(own_parameters(schema))
        if count == 0 or found.setdefault(name, count) != count:
            expected = f"{found.get(name, 0) or 'at least one'} as in its other schemas"
            raise PddlError(f"action {schema.name!r} has {count} own parameters, expected {expected}", domain.name)
    return found


def grasping(domain: Domain) -> frozenset[str]:
    """Primitives that need `graspable` of the body they move, in each of their schemas."""
    needing = {schema.name for schema in domain.actions if _graspable(schema) in schema.preconditions}
    others = {primitive(schema.name) for schema in domain.actions if schema.name not in needing}
    return frozenset(map(primitive, needing)) - others


def _graspable(schema: ActionSchema) -> Fact:
    return Fact(GRASPABLE, (schema.parameters[0].name,))


def achievers_of_grasps(domain: Domain) -> tuple[str, ...]:
    """Primitives that make a body graspable, in alphabetical order."""
    names = {primitive(schema.name) for schema in domain.actions if _graspable(schema) in schema.adds}
    return tuple(sorted(names))


def with_away(domain: Domain) -> Domain:
    """The domain in which every action achieves `away` for the body it moves."""
    predicates = {**domain.predicates, AWAY: (Parameter("?o", OBJECT),)}
    return replace(domain, predicates=predicates, actions=tuple(map(_moving, domain.actions)))


def _moving(schema: ActionSchema) -> ActionSchema:
    moved = Fact(AWAY, (schema.parameters[0].name,))
    return schema if moved in schema.adds else replace(schema, adds=(*schema.adds, moved))


def adapted(domain: Domain, primitives: Mapping[str, int], file: str) -> Domain:
    """A hand-written domain made to fit the primitives (name → number of own arguments).

    Parameters beyond a primitive's own become implicit. Raises PddlError, naming `file`, for an
    action that is no primitive or has too few parameters, and for predicates used otherwise here.
    """
    for name, parameters in domain.predicates.items():
        if VARIANT in name:
            raise PddlError(f"predicate {name!r}: {VARIANT!r} is kept for learned ones, expected another name", file)
        if name in (AWAY, GRASPABLE, STUCK) and len(parameters) != 1:
            raise PddlError(f"predicate {name!r} has {len(parameters)} parameters, expected 1", file)
    return replace(domain, actions=tuple(_adapted(schema, domain, primitives, file) for schema in domain.actions))


def _adapted(schema: ActionSchema, domain: Domain, primitives: Mapping[str, int], file: str) -> ActionSchema:
    name, at = primitive(schema.name), domain.places.get(("action", schema.name))
    if name not in primitives:
        raise PddlError(f"action {schema.name!r} is no primitive, {known(name, primitives)}", file, at)
    arity, count = primitives[name], len(schema.parameters)
    if count < arity:
        raise PddlError(f"action {schema.name!r} has {count} parameters, expected at least {arity}", file, at)
    renamed = {p.name: f"?arg{i}" if i < arity else f"{IMPLICIT}{i - arity}" for i, p in enumerate(schema.parameters)}

    def literals(facts: tuple[Fact, ...]) -> tuple[Fact, ...]:
        return tuple(Fact(f.predicate, tuple(renamed.get(arg, arg) for arg in f.args)) for f in facts)

    parameters = tuple(Parameter(renamed[parameter.name], parameter.type) for parameter in schema.parameters)
    return ActionSchema(
        schema.name,
        parameters,
        literals(schema.preconditions),
        literals(schema.adds),
        literals(schema.deletes),
        schema.note,
    )
