"""Groups of things for generated tables, each of which the arm can clear in the order it tells."""

from itertools import pairwise

import numpy as np

from scenarios.arranging import Group, Piece
from scenarios.wares import Ware, bowl, box, can, mug, prism, wedge

GAP = 0.01
"""Metres between two things that stand side by side: less than a finger takes."""


def lone(rng: np.random.Generator, number: str, scale: float) -> Group:
    """One thing of any kind that the fingers can span, made smaller by `scale`."""
    ware = _ware(rng, scale)
    half = (ware.size[0] / 2, ware.size[1] / 2)
    return Group((Piece(f"{ware.kind}_{number}", ware),), half, may_turn=True)


def crumbs(rng: np.random.Generator, number: str, count: int) -> Group:
    """Cubes too small to be grasped, near each other."""
    pieces = []
    for k in range(count):
        edge = float(rng.uniform(0.02, 0.026))
        offset = ((k - (count - 1) / 2) * 0.035, float(rng.uniform(-0.012, 0.012)))
        turn = float(rng.uniform(0.0, np.pi / 2))
        crumb = Ware("crumb", box(edge, edge, edge).shape, (edge, edge, edge), 0.015)
        pieces.append(Piece(f"crumb_{int(number) + k}", crumb, offset, turn, goes="dustpan"))
    return Group(tuple(pieces), (0.0175 * count + 0.01, 0.025))


def stack(rng: np.random.Generator, number: str, count: int, goes: str = "bin") -> Group:
    """Boxes on top of each other, the top one first. `goes`: where the top one must end."""
    edges = {2: (0.075, 0.052), 3: (0.085, 0.066, 0.048)}[count]
    pieces, height = [], 0.0
    for k, edge in enumerate(edges):
        x, y, z = edge * rng.uniform(0.95, 1.05), edge * rng.uniform(0.95, 1.05), rng.uniform(0.042, 0.052)
        ware = box(x, y, round(float(z), 4))
        is_top = k == count - 1
        name = f"box_{int(number) + k}"
        pieces.append(Piece(name, ware, height=round(height, 4), goes=goes if is_top else "bin"))
        height += ware.size[2]
    names = [piece.name for piece in pieces]
    orders = tuple((upper, lower) for lower, upper in pairwise(names))[::-1]
    return Group(tuple(pieces), (edges[0] * 0.525, edges[0] * 0.525), orders, may_turn=True)


def beside(rng: np.random.Generator, number: str, topped: bool = False) -> Group:
    """A long block that can only be taken across, and a shorter one so near to it that no finger fits between: the
    shorter one, taken by its ends, comes first. `topped`: something stands on that one."""
    height = round(float(rng.uniform(0.05, 0.06)), 4)
    deep, thin = round(float(rng.uniform(0.048, 0.055)), 4), round(float(rng.uniform(0.044, 0.05)), 4)
    long, short = box(0.125, deep, height, "bar"), box(0.097, thin, height, "block")
    span = deep + GAP + thin
    first = int(number)
    pieces = [
        Piece(f"bar_{first}", long, (0.0, (deep - span) / 2)),
        Piece(f"block_{first + 1}", short, (0.0, (span - thin) / 2)),
    ]
    orders = [(pieces[1].name, pieces[0].name)]
    if topped:
        cube = box(0.042, 0.042, 0.042)
        pieces.append(Piece(f"box_{first + 2}", cube, (0.0, (span - thin) / 2), height=height))
        orders.insert(0, (pieces[2].name, pieces[1].name))
    return Group(tuple(pieces), (0.0625, span / 2), tuple(orders))


def flat(rng: np.random.Generator, number: str) -> Group:
    """A flat box, wider than the hand opens both ways: it must be dragged over the edge before it is taken."""
    ware = box(rng.uniform(0.145, 0.165), rng.uniform(0.2, 0.22), 0.03, "book")
    name = f"book_{number}"
    return Group((Piece(name, ware, (0.0, 0.0)),), (0.085, 0.125), ((f"drag {name}", f"pick {name}"),), _EDGE)


def flat_under(rng: np.random.Generator, number: str) -> Group:
    """The same with something on top of it that must go first."""
    group = flat(rng, number)
    (book,) = group.pieces
    cube = box(0.05, 0.05, round(float(rng.uniform(0.045, 0.06)), 4))
    on_top = Piece(f"box_{int(number) + 1}", cube, (0.0, 0.0), height=book.ware.size[2])
    return Group((book, on_top), group.half, ((on_top.name, book.name), *group.orders), _EDGE)


_EDGE = (0.55, 0.61, 0.22, 0.235)
"""Where a flat box may lie, near the table's edge opposite the dustpan."""


def _ware(rng: np.random.Generator, scale: float) -> Ware:
    kind = int(rng.integers(7))
    if kind <= 1:
        x, y = scale * rng.uniform(0.045, 0.075, 2)
        return box(x, y, scale * rng.uniform(0.05, 0.12))
    if kind == 2:
        return can(scale * rng.uniform(0.025, 0.035), scale * rng.uniform(0.06, 0.11))
    if kind == 3:
        return prism(rng, scale * rng.uniform(0.028, 0.036), scale * rng.uniform(0.05, 0.09))
    if kind == 4:
        return wedge(*(scale * rng.uniform((0.06, 0.045, 0.04), (0.08, 0.06, 0.055))))
    if kind == 5:
        return mug(max(scale, 0.85) * rng.uniform(0.034, 0.04), rng.uniform(0.08, 0.095))
    return bowl(max(scale, 0.85) * rng.uniform(0.044, 0.048), rng.uniform(0.05, 0.06))
