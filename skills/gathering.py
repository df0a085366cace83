"""Which strokes gather the crumbs that lie on a surface: the fewest that take them all, and of those the shortest.

Straight strokes come first. Bent ones are for crumbs that no straight one takes: those off to the side, from
where every straight way leads past the dustpan's opening.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np

from scenarios.scenario import Table
from skills.strokes import (
    EDGE,
    OVERRUN,
    SIDE_MARGIN,
    SUPPORT,
    Crumbs,
    Opening,
    Stroke,
    Tool,
    along,
    crossing_of,
    is_supported,
    left,
    taken,
)

GAP = 0.012
"""Metres between the sponge and the crumbs behind which it comes down."""

SLANTS = np.radians([0.0, -15.0, 15.0, -30.0, 30.0])
STEEPEST = np.radians(60.0)
TURNS = np.radians([-30.0, 30.0, -60.0, 60.0, -90.0, 90.0])
RUNS = (0.01, 0.07, 0.15)
"""Metres straight into the dustpan after a bend."""

ROOM = 0.02
"""Metres by which the smallest arc is wider than half the sponge: its inner end must go forwards too."""

EXITS = 7
LATERAL_STEP = 0.015
FULL = 0.1
"""Metres of way that taking one more crumb is worth, among the strokes for one of them."""

MAX_NODES = 3000
"""Partial covers looked at in search of one with fewer strokes."""

BEND_COST = 0.3
SLANT_COST = 0.2
OFFSET_COST = 2.0
"""Metres of way that a bend counts for, a slant of one rad, and a crumb one metre off the sponge's middle."""


@dataclass(frozen=True)
class Place:
    """Where it is swept: crumbs on a table, the tool, and the opening through which they are to go."""

    table: Table
    tool: Tool
    opening: Opening
    crumbs: Crumbs

    def taken(self, stroke: Stroke, surely: bool = True) -> np.ndarray:
        """Which crumbs (n,) the stroke brings through the opening, see `strokes.taken`."""
        return taken(stroke, self.tool, self.crumbs, self.opening, surely)

    def cost(self, stroke: Stroke, mask: np.ndarray) -> float:
        """What a stroke counts for among those that take the same crumbs, in metres."""
        _, where = self.crumbs_met(stroke)
        slant = float(np.arccos(np.clip(along(stroke.heading + stroke.turn) @ self.opening.inward, -1.0, 1.0)))
        off = float(np.abs(where[mask]).mean()) if mask.any() else 0.0
        return stroke.length + SLANT_COST * slant + OFFSET_COST * off + (BEND_COST if stroke.turn else 0.0)

    def comes_down_on(self, stroke: Stroke) -> bool:
        """Does a crumb lie where the sponge or the fingers come down?"""
        start, heading = stroke.legs[0]
        offset = self.crumbs.p - start
        ahead, off = offset @ along(heading), offset @ left(heading)
        met = np.abs(off) <= self.tool.span / 2 + self.crumbs.r
        return bool(np.any(met & (ahead < self.crumbs.r) & (ahead > -self.tool.depth - self.crumbs.r)))

    def crumbs_met(self, stroke: Stroke) -> tuple[np.ndarray, np.ndarray]:
        """When and where the sponge or the fingers come upon each crumb, see `Stroke.met`."""
        return stroke.met(self.crumbs.p, self.tool.span / 2)


def cover(place: Place) -> list[Stroke]:
    """Strokes that together take every crumb that any stroke takes, in order across the opening."""
    strokes = list(_distinct(_aligned(place)))
    masks = _masks(place, strokes)
    for k in np.flatnonzero(~masks.any(axis=0)):
        bent = list(bent_strokes(place, int(k)))
        strokes += bent
        masks = np.concatenate([masks, _masks(place, bent)])
    costs = np.array([place.cost(stroke, mask) for stroke, mask in zip(strokes, masks, strict=True)])
    chosen = [strokes[i] for i in fewest(masks, costs)]
    return sorted(chosen, key=lambda stroke: float(stroke.legs[3][0] @ place.opening.across))


def strokes_for(place: Place, name: str) -> Iterator[Stroke]:
    """Strokes that take a crumb: the one of the cover first, then straight and bent ones by turns: what blocks all of a
    kind may not block the other. Last come those that most likely take it."""
    k = place.crumbs.names.index(name)
    best = [stroke for stroke in cover(place) if place.taken(stroke)[k]]
    fans = list(_directed(place, k))
    straight = _by_turns([_in_order(place, [s for s in fan if place.taken(s)[k]]) for fan in fans])
    bent = _in_order(place, list(bent_strokes(place, k)))
    likely = _by_turns([_in_order(place, [s for s in fan if place.taken(s, surely=False)[k]]) for fan in fans])
    yield from dict.fromkeys([*best, *_by_turns([straight[::2], straight[1::2], bent]), *likely])


def _by_turns(lists: Sequence[Sequence[Stroke]]) -> list[Stroke]:
    """The first of each list, then the second of each, and so on."""
    return [stroke for row in zip_longest(*lists) for stroke in row if stroke is not None]


def _in_order(place: Place, strokes: list[Stroke]) -> list[Stroke]:
    masks = [place.taken(stroke) for stroke in strokes]
    costs = [place.cost(stroke, mask) - FULL * int(mask.sum()) for stroke, mask in zip(strokes, masks, strict=True)]
    return [strokes[i] for i in np.argsort(costs, kind="stable")]


def _masks(place: Place, strokes: Sequence[Stroke]) -> np.ndarray:
    return np.array([place.taken(stroke) for stroke in strokes], dtype=bool).reshape(-1, len(place.crumbs.names))


def _distinct(strokes: Iterator[Stroke]) -> Iterator[Stroke]:
    yield from dict.fromkeys(strokes)


def _aligned(place: Place) -> Iterator[Stroke]:
    """Straight strokes in some directions, the sponge over the middle of what it takes with its end at some crumb."""
    crumbs, half = place.crumbs, place.tool.width / 2 - EDGE
    for slant in SLANTS:
        heading = place.opening.heading + float(slant)
        aside = crumbs.p @ left(heading)
        for k in range(len(crumbs.names)):
            low = float(aside[k] - crumbs.r[k])
            within = (aside - crumbs.r >= low - 1e-9) & (aside + crumbs.r <= low + 2 * half)
            for group in (within, np.arange(len(aside)) == k):
                if group.any():
                    middle = float((aside - crumbs.r)[group].min() + (aside + crumbs.r)[group].max()) / 2
                    yield from _fitted(place, heading, middle)


def _directed(place: Place, k: int) -> Iterator[list[Stroke]]:
    """For points along the opening, those nearest to square before the crumb first: straight strokes from the crumb,
    with the sponge at some offsets from it."""
    crumbs, opening = place.crumbs, place.opening
    p, r = crumbs.p[k], float(crumbs.r[k])
    reach = max(0.0, opening.half_width - r - SIDE_MARGIN)
    widest = max(0.0, opening.half_width - r / 2)
    square = float(np.clip((p - opening.middle) @ opening.across, -widest, widest))
    exits = [exit_ for exit_ in np.linspace(-reach, reach, EXITS) if abs(exit_ - square) > LATERAL_STEP]
    room = max(place.tool.width / 2 - r - EDGE, 0.0)
    steps = np.arange(-int(room / LATERAL_STEP), int(room / LATERAL_STEP) + 1) * LATERAL_STEP
    # Beside a wall only the sponge's very end gets behind the crumb.
    offsets = sorted({*steps.tolist(), -room, room})
    for exit_ in [square, *sorted(exits, key=lambda exit_: abs(exit_ - square))]:
        way = opening.middle + opening.across * exit_ - p
        heading = float(np.arctan2(way[1], way[0]))
        asides = [float(p @ left(heading)) + offset for offset in offsets]
        yield [stroke for aside in asides for stroke in _fitted(place, heading, aside, k)]


def _fitted(place: Place, heading: float, aside: float, behind: int | None = None) -> Iterator[Stroke]:
    """The straight stroke along a line (`aside` metres left of W's origin) from behind all crumbs that it meets, or
    from behind as many as there is room for; and the one from right behind one of them."""
    opening, u = place.opening, along(heading)
    pace = float(u @ opening.inward)
    if pace < np.cos(STEEPEST):
        return
    foot = aside * left(heading)
    crossing = float((opening.middle - foot) @ opening.inward) / pace
    wall = opening.half_width - (0.0 if opening.is_edge else place.tool.span / 2 + SIDE_MARGIN)
    if abs(float((foot + crossing * u - opening.middle) @ opening.across)) > wall:
        return
    starts = [start for start in _starts(place, heading, aside, behind) if start < crossing]
    for start in starts:
        point = foot + start * u
        bare = Stroke((float(point[0]), float(point[1])), heading, crossing - start)
        yield _long_enough(place, bare)


def _long_enough(place: Place, stroke: Stroke) -> Stroke:
    """The stroke with its last leg long enough for all crumbs before the sponge, as far as the table supports it."""
    when, where = stroke.met(place.crumbs.p, place.tool.width / 2)
    before = np.isfinite(when) & (when >= 0.0)
    _, middle = crossing_of(stroke, place.opening, np.zeros(1))
    _, needed = crossing_of(stroke, place.opening, where[before])
    furthest = float(needed.max(initial=float(middle[0]))) + OVERRUN
    if place.opening.is_edge:
        furthest = min(furthest, float(middle[0]) + SUPPORT * place.tool.depth)
    return replace(stroke, last=furthest)


def _starts(place: Place, heading: float, aside: float, behind: int | None) -> list[float]:
    """How far along a line the front may come down on bare table, from behind the rearmost crumb there; the first that
    has room, and the one nearest behind a crumb."""
    crumbs, tool = place.crumbs, place.tool
    ahead, off = crumbs.p @ along(heading), crumbs.p @ left(heading) - aside
    met = np.abs(off) <= tool.span / 2 + crumbs.r
    rear, fore = (ahead - crumbs.r)[met], (ahead + crumbs.r)[met]
    found = []
    for start in np.sort(rear) - GAP:
        under = (fore > start - tool.depth - GAP / 2) & (rear < start)
        point = aside * left(heading) + start * along(heading)
        if not under.any() and is_supported(place.table, tool, point, heading):
            found.append(float(start))
    if behind is not None:
        found = [start for start in found if start < ahead[behind]]
        return found[:1] + found[-1:] if len(found) > 1 else found
    return found[:1]


def bent_strokes(place: Place, k: int) -> Iterator[Stroke]:
    """Strokes that take a crumb round a bend and then square into the dustpan."""
    opening, tool = place.opening, place.tool
    wall = opening.half_width - (tool.width / 2 if opening.is_edge else tool.span / 2 + SIDE_MARGIN)
    smallest = tool.width / 2 + ROOM
    for exit_ in np.linspace(-max(wall, 0.0), max(wall, 0.0), 3 if wall > 0.0 else 1):
        for run in RUNS:
            leave = opening.middle + exit_ * opening.across - run * opening.inward
            for turn in TURNS:
                for radius in (smallest, 2 * smallest):
                    stroke = _bent(place, leave, float(turn), radius, k)
                    if stroke is not None and place.taken(stroke)[k]:
                        yield stroke


def _bent(place: Place, leave: np.ndarray, turn: float, radius: float, k: int) -> Stroke | None:
    """The stroke that leaves its arc at a point, heading into the dustpan, from behind a crumb before the bend."""
    opening = place.opening
    after, heading = opening.heading, opening.heading - turn
    side = float(np.sign(turn)) * radius
    bend = leave - side * (left(heading) - left(after))
    u, aside = along(heading), float(bend @ left(heading))
    reach = float(place.crumbs.p[k] @ u) - float(bend @ u)
    if reach > 0.0 or abs(float(place.crumbs.p[k] @ left(heading)) - aside) > place.tool.width / 2:
        return None
    starts = _starts(place, heading, aside, k)
    if not starts:
        return None
    start = bend + u * (starts[0] - float(bend @ u))
    way = float((bend - start) @ u)
    stroke = _long_enough(place, Stroke((float(start[0]), float(start[1])), heading, 0.0, way, turn, radius))
    on_table = (is_supported(place.table, place.tool, point, at) for point, at in stroke.course()[:-1])
    return stroke if all(on_table) else None


def fewest(masks: np.ndarray, costs: np.ndarray) -> list[int]:
    """Indices of the fewest rows of masks (m,n) that together hold every column that any row holds; among equally
    many, cheap ones by costs (m,). Optimal as long as the search stays within MAX_NODES, else at least good."""
    wanted = np.asarray(masks.any(axis=0))
    rows = _undominated(masks, costs)
    best = _greedy(masks, costs, wanted, rows)
    best_cost = float(costs[best].sum())
    nodes = 0

    def search(chosen: list[int], left_over: np.ndarray, cost: float) -> None:
        nonlocal best, best_cost, nodes
        nodes += 1
        if not left_over.any():
            if (len(chosen), cost) < (len(best), best_cost):
                best, best_cost = list(chosen), cost
            return
        gains = masks[rows][:, left_over].sum(axis=1)
        least = int(np.ceil(left_over.sum() / max(int(gains.max()), 1)))
        if nodes > MAX_NODES or len(chosen) + least > len(best):
            return
        if len(chosen) + least == len(best) and cost >= best_cost:
            return
        columns = np.flatnonzero(left_over)
        rarest = columns[int(np.argmin(masks[rows][:, columns].sum(axis=0)))]
        options = [i for i in range(len(rows)) if masks[rows[i], rarest]]
        for i in sorted(options, key=lambda i: (-int(gains[i]), float(costs[rows[i]]))):
            row = rows[i]
            search([*chosen, row], left_over & ~masks[row], cost + float(costs[row]))

    search([], wanted, 0.0)
    return best


def _undominated(masks: np.ndarray, costs: np.ndarray) -> list[int]:
    """Rows that no other row holds wholly at no more cost."""
    kept: list[int] = []
    for i in np.lexsort((costs, -masks.sum(axis=1))):
        if masks[i].any() and not any(np.all(masks[j] >= masks[i]) and costs[j] <= costs[i] for j in kept):
            kept.append(int(i))
    return kept


def _greedy(masks: np.ndarray, costs: np.ndarray, wanted: np.ndarray, rows: list[int]) -> list[int]:
    chosen: list[int] = []
    left_over = wanted.copy()
    while left_over.any():
        row = min(rows, key=lambda row: (-int(masks[row][left_over].sum()), float(costs[row])))
        chosen.append(row)
        left_over &= ~masks[row]
    return chosen
