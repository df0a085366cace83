"""What makes a generated table unsolvable: one thing each, known by construction."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.arranging import Group, Piece
from scenarios.groups import crumbs, flat
from scenarios.wares import box, number

KINDS = ("goal-too-small", "crumb-behind-wall", "out-of-reach", "too-heavy", "flat-blocked")

RIM = 0.012
"""Thickness in metres of fixed walls."""

ROOM = (0.42, 0.82, -0.26, 0.38)
BEHIND_WALL = (0.42, 0.82, -0.23, 0.38)
"""Where groups may stand on a table: lowest and highest x and y in metres, and the same where a wall stands across."""


@dataclass(frozen=True)
class Spoiler:
    """The group that can't be cleared (None: it is added by `change`), and what else becomes of the scene's data.

    change(data, side): `side` is +1, or −1 for a table mirrored in y. room: where groups may stand, so that all but one
    thing can be cleared.
    """

    group: Group | None
    change: Callable[[dict[str, Any], float], None]
    may_have_crumbs: bool = True
    room: tuple[float, float, float, float] = ROOM


def spoiler(kind: str, rng: np.random.Generator) -> Spoiler:
    """One of KINDS, drawn."""
    match kind:
        case "goal-too-small":
            return _goal_too_small(rng)
        case "crumb-behind-wall":
            return Spoiler(crumbs(rng, "1", 1), _wall_across, may_have_crumbs=False, room=BEHIND_WALL)
        case "out-of-reach":
            return _out_of_reach(rng)
        case "too-heavy":
            return _too_heavy(rng)
        case "flat-blocked":
            return Spoiler(flat(rng, "1"), _rims, may_have_crumbs=False)
    raise ValueError(f"unknown kind {kind!r}, known: {', '.join(KINDS)}")


def _goal_too_small(rng: np.random.Generator) -> Spoiler:
    x, y, z = (float(n) for n in rng.uniform((0.07, 0.075, 0.11), (0.075, 0.085, 0.13)))
    block = Piece("block_1", box(x, y, z, "block"))

    def change(data: dict[str, Any], side: float) -> None:
        # Narrower inside than the block's smallest face is wide, and beside the other bins.
        data["regions"]["slot"] = {
            "kind": "bin",
            "size": [0.08, 0.08, 0.1],
            "pose": {"xyz": [0.36, number(0.56 * side), -0.1]},
        }
        data["objects"]["block_1"]["home"] = "slot"
        literals = data["goal"].removeprefix("(and ").removesuffix(")")
        kept = [part for part in literals.replace(") (", ")|(").split("|") if "block_1" not in part]
        data["goal"] = f"(and {' '.join([*kept, '(in_bin block_1 slot)'])})"

    return Spoiler(Group((block,), (x / 2, y / 2), may_turn=True), change)


def _out_of_reach(rng: np.random.Generator) -> Spoiler:
    x, y = float(rng.uniform(1.3, 1.38)), float(rng.uniform(-0.1, 0.2))

    def change(data: dict[str, Any], side: float) -> None:
        far = 1.45
        near = 0.4
        data["table"]["size"][0] = number(far - near)
        data["table"]["pose"]["xyz"][0] = number((far + near) / 2)
        data["objects"]["box_far"] = {
            "shape": {"box": [0.06, 0.06, 0.08]},
            "mass": 0.2,
            "friction": 0.55,
            "pose": {"on": "table", "xy": [number(x), number(y * side)]},
        }
        data["goal"] = data["goal"].removesuffix(")") + " (put_away box_far))"

    return Spoiler(None, change)


def _too_heavy(rng: np.random.Generator) -> Spoiler:
    mass = number(rng.uniform(18.0, 40.0))
    x, y, z = (float(n) for n in rng.uniform(0.055, 0.075, 3))
    block = Piece("block_1", box(x, y, z, "block"), mass=mass)
    return Spoiler(Group((block,), (x / 2, y / 2), may_turn=True), lambda data, side: None)


def _wall_across(data: dict[str, Any], side: float) -> None:
    """A wall as long as the table, between the dustpan's edge and everything else."""
    table = data["table"]
    data["fixed"]["wall"] = {
        "shape": {"box": [table["size"][0], RIM, 0.05]},
        "pose": {"on": "table", "xy": [table["pose"]["xyz"][0], number(-0.24 * side)]},
    }


def _rims(data: dict[str, Any], side: float) -> None:
    """Walls along all four edges."""
    x, y, _ = data["table"]["pose"]["xyz"]
    width, depth, _ = data["table"]["size"]
    height = 0.05
    for name, sign in (("near", -1.0), ("far", 1.0)):
        data["fixed"][f"wall_{name}"] = {
            "shape": {"box": [RIM, depth, height]},
            "pose": {"on": "table", "xy": [number(x + sign * (width - RIM) / 2), y]},
        }
    for name, sign in (("left", 1.0), ("right", -1.0)):
        data["fixed"][f"wall_{name}"] = {
            "shape": {"box": [number(width - 2 * RIM), RIM, height]},
            "pose": {"on": "table", "xy": [x, number(y + sign * (depth - RIM) / 2)]},
        }
