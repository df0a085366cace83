"""Goals: conjunctions of positive literals.

in_bin(object, place)  the object lies in that region, or on the table (place `table`)
put_away(object)       it lies in some bin
holding(object)        the hand holds it
hand_empty()           the hand holds nothing
"""

import re
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np

from scenarios.names import TABLE, known
from scenarios.robots import ROBOTS
from scenarios.scenario import Body, Region
from scenarios.shapes import extents

CLEAR_TABLE = "clear-table"

ARITY = {"in_bin": 2, "put_away": 1, "holding": 1, "hand_empty": 0}
"""Number of arguments by predicate. The first argument is a body, the second a region or the table."""

Literal = tuple[str, tuple[str, ...]]
"""A predicate and its arguments, ("in_bin", ("book", "right_bin"))."""

MAX_TOKENS = 10_000


class GoalError(ValueError):
    """The goal's text is no conjunction of known positive literals, or makes no sense in the scene."""


def parse_goal(text: str) -> tuple[Literal, ...]:
    """The literals of a goal in PDDL, `(and ...)` or a single one, each once, in the order given.

    Raises GoalError for anything else: unbalanced brackets, `not`, `or`, unknown predicates, wrong arity.
    """
    tree = _tree(text)
    literals: dict[Literal, None] = {}
    for part in _conjuncts(tree):
        literals[_literal(part)] = None
    return tuple(literals)


def goal_text(literals: Iterable[Literal]) -> str:
    """The literals as one PDDL conjunction, `(and (in_bin book right_bin) (hand_empty))`."""
    return f"(and {' '.join(_shown(literal) for literal in literals)})"


def check_goal(literals: Collection[Literal], bodies: Collection[str], regions: Mapping[str, Region]) -> None:
    """Raise GoalError if a literal names what the scene doesn't hold, or two can't be true at once."""
    wanted: dict[str, list[Literal]] = {}
    held: Literal | None = None
    for literal in literals:
        name, args = literal
        if args and args[0] not in bodies:
            raise GoalError(f"{_shown(literal)}: unknown object {args[0]!r}, {known(args[0], bodies)}")
        if name == "in_bin" and args[1] not in regions and args[1] != TABLE:
            raise GoalError(f"{_shown(literal)}: unknown place {args[1]!r}, {known(args[1], {TABLE, *regions})}")
        if name in ("holding", "hand_empty"):
            if held is not None:
                raise GoalError(f"{_shown(held)} and {_shown(literal)} can't both be true, expected one")
            held = literal
        for other in wanted.setdefault(args[0], []) if args else []:
            if not _agree(other, literal, regions):
                raise GoalError(f"{_shown(other)} and {_shown(literal)} can't both be true, expected one")
        if args:
            wanted[args[0]].append(literal)


def resolved_goal(text: str, bodies: Mapping[str, Body], regions: Mapping[str, Region], model: str) -> str:
    """A goal as it is written in a scene, `clear-table` or PDDL, as one PDDL conjunction. `model` names the robot.

    Raises GoalError for what is neither, or makes no sense in the scene.
    """
    if text.strip() == CLEAR_TABLE:
        return goal_text(clear_table(bodies, regions, model))
    literals = parse_goal(text)
    check_goal(literals, bodies, regions)
    return goal_text(literals)


def clear_table(bodies: Mapping[str, Body], regions: Mapping[str, Region], model: str) -> tuple[Literal, ...]:
    """What `clear-table` means here: crumbs in the dustpan (their home, else the nearest), the rest home or put away.

    `model` names the robot, whose gripper decides what is a crumb. Raises GoalError if the scene
    holds nothing to put away, or lacks the dustpan or bin for it.
    """
    dustpans = {name: region for name, region in regions.items() if region.kind == "dustpan"}
    has_bin = len(dustpans) < len(regions)
    literals: list[Literal] = []
    for name, body in bodies.items():
        if is_crumb(body, model):
            if not dustpans:
                raise GoalError(f"clear-table: {name!r} is a crumb, expected a dustpan in regions")
            home = body.home if body.home in dustpans else _nearest(body, dustpans)
            literals.append(("in_bin", (name, home)))
        elif body.home is not None:
            literals.append(("in_bin", (name, body.home)))
        elif has_bin:
            literals.append(("put_away", (name,)))
        else:
            raise GoalError(f"clear-table: nowhere to put {name!r}, expected a home or a bin in regions")
    if not literals:
        raise GoalError("clear-table: nothing stands on the table, expected objects")
    return tuple(literals)


def is_crumb(body: Body, model: str) -> bool:
    """Is the body, in its largest extent, too small for the gripper of that robot?"""
    return bool(extents(body.shape).max() < ROBOTS[model].crumb_extent)


def _nearest(body: Body, regions: Mapping[str, Region]) -> str:
    def distance(name: str) -> float:
        return float(np.linalg.norm(regions[name].X_WR.translation - body.X_WO.translation))

    return min(regions, key=distance)


def _agree(first: Literal, second: Literal, regions: Mapping[str, Region]) -> bool:
    names = {first[0], second[0]}
    if names == {"in_bin", "put_away"}:
        place = first[1][1] if first[0] == "in_bin" else second[1][1]
        return place in regions and regions[place].kind == "bin"
    return False


def _tree(text: str) -> Any:
    tokens = re.findall(r"[()]|[^\s()]+", re.sub(r";[^\n]*", "", text.lower()))
    if not tokens:
        raise GoalError("is empty, expected (and (in_bin OBJECT PLACE) ...) or clear-table")
    if len(tokens) > MAX_TOKENS:
        raise GoalError(f"has more than {MAX_TOKENS} words, expected fewer")
    stack: list[list[Any]] = [[]]
    for token in tokens:
        if token == "(":
            stack.append([])
        elif token == ")":
            if len(stack) == 1:
                raise GoalError("')' closes nothing, expected '(' before it")
            closed = stack.pop()
            stack[-1].append(closed)
        else:
            stack[-1].append(token)
    if len(stack) > 1:
        raise GoalError(f"{len(stack) - 1} '(' not closed, expected ')' at the end")
    if len(stack[0]) != 1:
        raise GoalError("expected one condition, (and ...) around several")
    return stack[0][0]


def _conjuncts(tree: Any) -> list[Any]:
    if isinstance(tree, list) and tree and tree[0] == "and":
        if len(tree) == 1:
            raise GoalError("(and) is empty, expected at least one literal")
        return tree[1:]
    return [tree]


def _literal(part: Any) -> Literal:
    if isinstance(part, str):
        raise GoalError(f"{part!r} stands alone, expected a literal in brackets or {CLEAR_TABLE}")
    if not part or not isinstance(part[0], str):
        raise GoalError("a literal begins with '(', expected a predicate's name")
    name, args = part[0], part[1:]
    if name in ("not", "or", "imply", "forall", "exists", "when", "and"):
        raise GoalError(f"({name} ...) is not allowed, expected a conjunction of positive literals")
    if name not in ARITY:
        raise GoalError(f"unknown predicate {name!r}, {known(name, ARITY)}")
    if len(args) != ARITY[name] or not all(isinstance(arg, str) for arg in args):
        count = ARITY[name]
        expected = f"{count} name{'' if count == 1 else 's'}"
        raise GoalError(f"predicate {name!r} has {len(args)} arguments, expected {expected}")
    return name, tuple(args)


def _shown(literal: Literal) -> str:
    name, args = literal
    return f"({' '.join((name, *args))})"
