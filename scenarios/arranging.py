"""Room on a table: groups of things, and places for them on which nothing comes too near to another."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from scenarios.wares import Ware

NEAREST, FARTHEST = 0.45, 0.79
"""Metres from the robot's axis within which a hand that points down reaches the table."""


@dataclass(frozen=True)
class Piece:
    """A thing in a group: at `offset` (2,) metres from the group's middle, turned by `turn` rad, `height` metres up.

    goes: where it must end: "bin" (any, or its home), "dustpan" or "table".
    """

    name: str
    ware: Ware
    offset: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    height: float = 0.0
    goes: str = "bin"
    mass: float | None = None


@dataclass(frozen=True)
class Group:
    """Things that stand together, their outline `half` (2,) in metres, and what must happen in which order.

    orders: (first, then) by name. zone: (lowest x, highest x, lowest y, highest y) for its middle, None: anywhere.
    """

    pieces: tuple[Piece, ...]
    half: tuple[float, float]
    orders: tuple[tuple[str, str], ...] = ()
    zone: tuple[float, float, float, float] | None = None
    may_turn: bool = False


@dataclass
class Room:
    """The table's free part: (lowest x, highest x, lowest y, highest y), and rectangles taken already."""

    bounds: tuple[float, float, float, float]
    taken: list[tuple[float, float, float, float]] = field(default_factory=list)

    def is_free(self, rectangle: tuple[float, float, float, float]) -> bool:
        """Does a rectangle lie within the bounds and beside all others?"""
        low_x, high_x, low_y, high_y = rectangle
        bounds = self.bounds
        if low_x < bounds[0] or high_x > bounds[1] or low_y < bounds[2] or high_y > bounds[3]:
            return False
        return not any(low_x < b and a < high_x and low_y < d and c < high_y for a, b, c, d in self.taken)


@dataclass(frozen=True)
class Spot:
    """Where a group stands: its middle x, y, and its turn in rad."""

    x: float
    y: float
    turn: float


def arrange(groups: Sequence[Group], room: Room, margin: float, rng: np.random.Generator) -> list[Spot] | None:
    """A spot for each group, at least `margin` metres of space about each; the largest come first. None: no room."""
    spots: dict[int, Spot] = {}
    for k in sorted(range(len(groups)), key=lambda k: (groups[k].zone is None, -groups[k].half[0] * groups[k].half[1])):
        spot = _spot(groups[k], room, margin, rng)
        if spot is None:
            return None
        spots[k] = spot
    return [spots[k] for k in range(len(groups))]


def _spot(group: Group, room: Room, margin: float, rng: np.random.Generator) -> Spot | None:
    low_x, high_x, low_y, high_y = group.zone or room.bounds
    for _ in range(400):
        turn = float(rng.uniform(0.0, 2 * np.pi)) if group.may_turn else 0.0
        x, y = float(rng.uniform(low_x, high_x)), float(rng.uniform(low_y, high_y))
        c, s = abs(np.cos(turn)), abs(np.sin(turn))
        half_x = c * group.half[0] + s * group.half[1]
        half_y = s * group.half[0] + c * group.half[1]
        if not NEAREST <= np.hypot(x, y) <= FARTHEST:
            continue
        around = (x - half_x - margin, x + half_x + margin, y - half_y - margin, y + half_y + margin)
        if room.is_free(around):
            room.taken.append((x - half_x, x + half_x, y - half_y, y + half_y))
            return Spot(x, y, turn)
    return None
