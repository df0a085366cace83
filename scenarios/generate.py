"""Random tables: the same seed gives the same file, byte for byte.

A table is solvable by construction: every group on it is one that the arm can clear from where it
stands, in the order that the group asks for. What kind of table a seed gives goes by the seed's last digit, so that
among any ten in a row: 0 to 2 need nothing learned, 3 and 4 one order, 5 to 8 a chain of two or more (A before B before
C), and 8 and 9 something that is put aside on the table. An unsolvable table is a small solvable one with a single
thing in it that makes the goal impossible.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import yaml

from scenarios.arranging import Group, Piece, Room, Spot, arrange
from scenarios.document import parse_document
from scenarios.errors import SceneInvalid
from scenarios.groups import beside, crumbs, flat, flat_under, lone, stack
from scenarios.load import build_scenario
from scenarios.spoilers import KINDS, ROOM, Spoiler, spoiler
from scenarios.wares import Ware, box, number

MOST_OBJECTS = 24
ATTEMPTS = 120
FLAT_UP_TO = 10
"""Objects up to which one of them may be a flat box, which takes a good part of the table."""

COLORS = (
    "#3355aa #3fa34d #f77f00 #d62828 #7b2cbf #1b998b #c8553d #588b8b #e0a458 #5f0f40 #2d7dd2 #97cc04".split()
)  # fmt: skip
TOP = 0.05
"""Height in metres of the table's top, which stands on the floor of the robot's base."""


class GenerateError(ValueError):
    """What was asked for can't be generated; the message says why."""


@dataclass(frozen=True)
class Plan:
    """What a seed asks for: how many objects, what kind of table, which of that kind, on which side the dustpan is."""

    rng: np.random.Generator
    objects: int
    kind: str
    turn: int
    side: float

    @property
    def margin(self) -> float:
        """Metres of free space about every group: half of what a finger takes beside each."""
        return 0.024 if self.objects <= 8 else 0.018 if self.objects <= 12 else 0.012


def generate(seed: int, objects: int, unsolvable: str | None = None) -> str:
    """A scene file's text with so many objects (crumbs count, the sponge doesn't). `unsolvable`: one of KINDS.

    Raises GenerateError for a negative seed, an unknown kind, or more objects than there is room for.
    """
    if seed < 0:
        raise GenerateError(f"seed {seed}, expected 0 or above")
    if unsolvable is not None and unsolvable not in KINDS:
        raise GenerateError(f"unknown kind {unsolvable!r}, known: {', '.join(KINDS)}")
    if not 1 <= objects <= MOST_OBJECTS:
        raise GenerateError(f"{objects} objects, expected 1 to {MOST_OBJECTS}")
    code = 0 if unsolvable is None else 1 + KINDS.index(unsolvable)
    for attempt in range(ATTEMPTS):
        text = _attempt(np.random.default_rng([seed, objects, code, attempt]), seed, objects, unsolvable)
        if text is not None:
            return text
    raise GenerateError(f"seed {seed}: no room for {objects} objects on the table, expected fewer")


def table_kind(seed: int) -> str:
    """What the seed's table needs: "plain", "order", "chain", "chain-aside" or "aside"."""
    return ("plain", "plain", "plain", "order", "order", "chain", "chain", "chain", "chain-aside", "aside")[seed % 10]


def _attempt(rng: np.random.Generator, seed: int, objects: int, unsolvable: str | None) -> str | None:
    side = 1.0 if rng.random() < 0.5 else -1.0
    spoiling = None if unsolvable is None else spoiler(unsolvable, rng)
    plan = Plan(rng, objects, "plain" if spoiling else table_kind(seed), seed // 10 + 2 * seed, side)
    groups = _groups(plan, spoiling)
    room = Room(spoiling.room if spoiling else ROOM)
    pan = float(rng.uniform(0.63, 0.67))
    if any(piece.goes == "dustpan" for group in groups for piece in group.pieces):
        # The sponge's lane, and the space behind the last crumb from which it comes.
        groups = [replace(g, zone=(pan - 0.03, pan + 0.03, -0.13, -0.02)) if _is_crumbs(g) else g for g in groups]
        (lane,) = (k for k, group in enumerate(groups) if _is_crumbs(group))
        found = arrange([groups[lane]], Room((0.42, 0.82, -0.28, 0.38)), 0.0, rng)
        if found is None:
            return None
        room.taken.append((pan - 0.11, pan + 0.11, -0.28, found[0].y + groups[lane].half[1] + 0.10))
        rest = arrange(groups[:lane] + groups[lane + 1 :], room, plan.margin, rng)
        spots = None if rest is None else [*rest[:lane], found[0], *rest[lane:]]
    else:
        spots = arrange(groups, room, plan.margin, rng)
    if spots is None:
        return None
    text = _text(plan, seed, unsolvable, _scene(plan, pan, groups, spots, spoiling), groups)
    try:
        build_scenario(parse_document(text, "generated"))
    except SceneInvalid:
        return None
    return text


def _is_crumbs(group: Group) -> bool:
    return group.pieces[0].goes == "dustpan"


def _groups(plan: Plan, spoiling: Spoiler | None) -> list[Group]:
    """Groups of as many things as were asked for, those that the plan's kind needs first."""
    rng, left = plan.rng, plan.objects
    found: list[Group] = []
    scale = 1.0 if plan.objects <= 10 else 0.82 if plan.objects <= 14 else 0.7

    def take(group: Group | None) -> None:
        nonlocal left
        if group is not None and len(group.pieces) <= left:
            found.append(group)
            left -= len(group.pieces)

    def number_of() -> str:
        return str(1 + plan.objects - left)

    if spoiling is not None and spoiling.group is not None:
        take(spoiling.group)
    has_crumbs = spoiling.may_have_crumbs if spoiling else rng.random() < 0.7
    if plan.kind == "chain":
        chains = [stack(rng, number_of(), 3), beside(rng, number_of(), topped=True)]
        take(chains[int(rng.integers(2))])
    if "aside" in plan.kind:
        take(stack(rng, number_of(), 3 if plan.kind == "chain-aside" else 2, goes="table"))
    if plan.kind == "order":
        orders = [stack(rng, number_of(), 2), beside(rng, number_of()), flat(rng, number_of())]
        orders.append(flat_under(rng, number_of()))
        take(orders[plan.turn % (4 if plan.objects <= FLAT_UP_TO else 2)])
    elif plan.kind == "chain" and rng.random() < 0.5 and 2 < left <= FLAT_UP_TO:
        take(flat(rng, number_of()))
    if has_crumbs and left and not (spoiling and spoiling.group and _is_crumbs(spoiling.group)):
        take(crumbs(rng, number_of(), min(left, int(rng.integers(1, 2 + left // 4)), 3)))
    while left:
        take(lone(rng, number_of(), scale))
    return found


def _scene(plan: Plan, pan: float, groups: list[Group], spots: list[Spot], spoiling: Spoiler | None) -> dict[str, Any]:
    """The scene as plain data."""
    rng, side = plan.rng, plan.side
    bins = ["left_bin", "right_bin"]
    needs_pan = any(_is_crumbs(group) for group in groups)
    has_pan = needs_pan or (spoiling is None and rng.random() < 0.3)
    data: dict[str, Any] = {
        "version": 1,
        "name": "generated",
        "robot": {"model": "iiwa14_wsg50", "base": {"xyz": [0.0, 0.0, 0.0]}},
        "table": {"size": [0.44, 0.68, TOP], "pose": {"xyz": [0.62, number(0.06 * side), TOP / 2]}, "friction": 0.5},
        "regions": {
            name: {"kind": "bin", "size": [0.36, 0.36, 0.13], "pose": {"xyz": [0.05, y, -0.145]}}
            for name, y in zip(bins, (0.62, -0.62), strict=True)
        },
    }
    if has_pan:
        data["regions"]["dustpan"] = {
            "kind": "dustpan",
            "size": [0.22, 0.15, 0.055],
            "pose": {"xyz": [number(pan), number(-0.355 * side), -0.0075]},
            "open_side": "+y" if side > 0 else "-y",
        }
    data["fixed"] = {}
    data["objects"] = {}
    colors = [COLORS[k] for k in rng.permutation(len(COLORS))]
    literals = []
    for group, spot in zip(groups, spots, strict=True):
        for piece in group.pieces:
            thing = _thing(piece, spot, side, colors[len(literals) % len(colors)])
            data["objects"][piece.name] = thing | {"noise": _noise(group, plan)}
            literals.append(_literal(piece, data["objects"][piece.name], bins, plan))
    if has_pan:
        data["tools"] = {"sponge": _sponge(pan, side)}
        if rng.random() < 0.5:
            literals.append("(put_away sponge)")
    data["goal"] = f"(and {' '.join(literals)})"
    if spoiling is not None:
        spoiling.change(data, side)
    if not data["fixed"]:
        del data["fixed"]
    return data


def _thing(piece: Piece, spot: Spot, side: float, color: str) -> dict[str, Any]:
    c, s = np.cos(spot.turn), np.sin(spot.turn)
    turn = spot.turn + piece.turn
    # The middle of the bounding box goes to the spot; the pose is that of the centre of volume.
    off = np.array(piece.offset) - _turned(piece.ware.drift, piece.turn)
    x, y = spot.x + c * off[0] - s * off[1], spot.y + s * off[0] + c * off[1]
    yaw = np.degrees(turn) * side
    yaw_deg = number((yaw + 180.0) % 360.0 - 180.0)
    pose: dict[str, Any] = {"on": "table", "xy": [number(x), number(y * side)], "yaw_deg": yaw_deg}
    if piece.height > 0.0:
        z = TOP + piece.height + piece.ware.size[2] / 2
        pose = {"xyz": [*pose["xy"], number(z)], "rpy_deg": [0.0, 0.0, yaw_deg]}
    mass = piece.ware.mass if piece.mass is None else piece.mass
    return {"shape": piece.ware.shape, "mass": mass, "friction": 0.55, "color": color, "pose": pose}


def _noise(group: Group, plan: Plan) -> dict[str, float]:
    """Start noise small enough that what must come first still must, and that room for the fingers stays."""
    if len(group.pieces) > 1:
        return {"xy": 0.002, "yaw_deg": 2.0}
    return {"xy": number(plan.margin / 4), "yaw_deg": 5.0}


def _turned(p: tuple[float, float], turn: float) -> np.ndarray:
    c, s = np.cos(turn), np.sin(turn)
    return np.array([c * p[0] - s * p[1], s * p[0] + c * p[1]])


def _literal(piece: Piece, thing: dict[str, Any], bins: list[str], plan: Plan) -> str:
    if piece.goes in ("table", "dustpan"):
        return f"(in_bin {piece.name} {piece.goes})"
    if plan.objects <= 8 and plan.rng.random() < 0.3:
        thing["home"] = bins[int(plan.rng.integers(2))]
        return f"(in_bin {piece.name} {thing['home']})"
    return f"(put_away {piece.name})"


def _sponge(pan: float, side: float) -> dict[str, Any]:
    sponge: Ware = box(0.09, 0.06, 0.04)
    return {
        "kind": "sponge",
        "shape": sponge.shape,
        "mass": 0.06,
        "friction": 0.5,
        "pose": {"on": "dustpan", "xy": [number(pan), number(-0.35 * side)]},
        "noise": {"xy": 0.005, "yaw_deg": 4.0},
    }


class _Plain(yaml.SafeDumper):
    """Writes equal values out instead of referring to the first one."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(plan: Plan, seed: int, unsolvable: str | None, scene: dict[str, Any], groups: list[Group]) -> str:
    """The file: what it is in a comment, then the scene."""
    option = "" if unsolvable is None else f" --unsolvable {unsolvable}"
    lines = [f"# bt-tamp generate --seed {seed} --objects {plan.objects}{option}"]
    if unsolvable is None:
        orders = [f"{first} before {then}" for group in groups for first, then in group.orders]
        lines.append(f"# Solvable by construction; {', '.join(orders) if orders else 'in any order'}.")
    else:
        lines.append(f"# Not solvable: {KINDS_TOLD[unsolvable]}.")
    body = yaml.dump(scene, Dumper=_Plain, sort_keys=False, default_flow_style=None, width=120)
    return "\n".join(lines) + "\n" + body


KINDS_TOLD = {
    "goal-too-small": "the bin that something must go into is smaller than it",
    "crumb-behind-wall": "a fixed wall stands across the whole table between a crumb and the dustpan",
    "out-of-reach": "something stands farther away than the arm reaches",
    "too-heavy": "something is heavier than the fingers' friction holds",
    "flat-blocked": "something lies flat, wider than the hand opens, and fixed walls stand along all edges",
}
