"""Which names a scene may give, and what to say about an unknown one."""

import difflib
import re
from collections.abc import Iterable
from typing import Literal

from scenarios.robots import ROBOTS

NAME = re.compile(r"[a-z][a-z0-9_-]*")

TABLE = "table"
"""The table's name wherever a surface is named."""

PDDL_KEYWORDS = frozenset(
    "action and assign at constants decrease define derived domain durative-action duration effect either exists "
    "forall functions goal imply increase init metric not number object objects or over parameters precondition "
    "predicates problem requirements scale-down scale-up start total-cost types undefined when".split()
)

Disordered = Literal[
    "force-bias",
    "force-noise",
    "force-missing",
    "force-frozen",
    "joint-delay",
    "joint-friction",
    "pose-noise",
    "pose-delay",
    "pose-missing",
]
"""What can be wrong with sensors and joints in a scene's disturbances."""

SIZELESS: tuple[Disordered, ...] = ("force-missing", "force-frozen", "pose-missing")
"""Of these, what has no size: all or nothing."""

SURROUNDINGS = frozenset({TABLE, "floor", "pedestal", "robot", "world"})


def name_problem(name: str) -> str | None:
    """Why something in a scene can't be called so, or None."""
    if not NAME.fullmatch(name):
        return f"name {name!r}: expected a lower-case letter, then lower-case letters, digits, '_' or '-'"
    if name in PDDL_KEYWORDS:
        return f"name {name!r} is a PDDL keyword, expected another"
    if name in SURROUNDINGS or any(name in robot.links for robot in ROBOTS.values()):
        return f"name {name!r} is taken by the table, the floor or the robot, expected another"
    return None


def known(name: str, names: Iterable[str]) -> str:
    """The end of a sentence about an unknown name: the nearest known one, and all of them."""
    names = sorted(names)
    if not names:
        return "there are none"
    near = difflib.get_close_matches(name, names, n=1)
    meant = f"did you mean {near[0]!r}? " if near else ""
    return f"{meant}expected one of {', '.join(names)}"
