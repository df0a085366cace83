"""Strokes in the plane of a surface: where a sponge's front goes, and which crumbs it takes into a dustpan.

A stroke runs straight, or straight, round an arc and straight again. The sponge stays broadside: its front
is always square to its course, and on the arc it turns about a point on the line of its front, so what lies
before it is not dragged sideways. Whatever lies before the front is taken along at the same `lateral`.
So the crumbs that are taken never leave the stripe that the sponge itself sweeps, and what stands
in their way stands in its way too.

Points are (2,) in W, metres; angles in rad about z of W.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from scenarios.regions import OUTWARD, interior
from scenarios.scenario import Region, Table

EDGE = 0.005
"""Metres within each end of the front that take nothing along for certain."""

SIDE_MARGIN = 0.01
"""Metres that crumbs keep from the side walls of a dustpan."""

OVERRUN = 0.008
"""Metres by which the front passes the open side at every crumb it takes, if it can."""

LEAST_OVERRUN = 0.003
TIPPING = 0.5
"""What it must pass it by: LEAST_OVERRUN less this share of the crumb's radius, for a crumb falls when its middle is
beyond the edge."""

SUPPORT = 0.25
"""Share of the sponge's depth that may stand out beyond the edge of the table: with 0.37 a sponge pressed with 10 N
began to rock and crept up in the hand."""

CHORD = np.radians(7.5)
"""Turn between two poses on an arc: below the 10° at which a line stops at its corners."""

CLEAR = 0.01
"""Metres beyond all that a stroke sweeps from which a crumb is lost for certain."""

HEAPED = 0.05
"""Metres before the front to which crumbs may be pushed by others."""

ROUNDING = 1e-9
"""Metres by which legs overlap, lest a point where they join be missed."""


@dataclass(frozen=True)
class Stroke:
    """The course of the front's middle: it comes down at `start`, runs `first` metres at `heading`, turns by `turn`
    (left is positive) on an arc of `radius`, and runs `last` metres. A straight stroke has no turn."""

    start: tuple[float, float]
    heading: float
    last: float
    first: float = 0.0
    turn: float = 0.0
    radius: float = 0.0

    @cached_property
    def legs(self) -> tuple[tuple[np.ndarray, float], ...]:
        """Point and heading where the straight, the arc and the last straight begin, and where all ends."""
        start = np.array(self.start)
        bend = start + self.first * along(self.heading)
        after = self.heading + self.turn
        leave = bend
        if self.turn:
            side = float(np.sign(self.turn)) * self.radius
            leave = bend + side * (left(self.heading) - left(after))
        end = leave + self.last * along(after)
        return (start, self.heading), (bend, self.heading), (leave, after), (end, after)

    @property
    def length(self) -> float:
        """Metres that the front's middle travels."""
        return self.first + abs(self.turn) * self.radius + self.last

    def course(self) -> list[tuple[np.ndarray, float]]:
        """Points (2,) and headings from start to end, on the arc at most CHORD apart."""
        start, bend, leave, end = self.legs
        if not self.turn:
            return [start, end]
        steps = int(np.ceil(abs(self.turn) / CHORD))
        side = float(np.sign(self.turn)) * self.radius
        arc = []
        for k in range(1, steps):
            heading = self.heading + self.turn * k / steps
            arc.append((bend[0] + side * (left(self.heading) - left(heading)), heading))
        straight = [start] if self.first > 0.0 else []
        return [*straight, bend, *arc, leave, end]

    def after(self, way: float) -> "Stroke":
        """What is left of the stroke once the front has gone `way` metres."""
        start, bend, leave, _ = self.legs
        past_bend = way - self.first
        past_arc = past_bend - abs(self.turn) * self.radius
        if past_bend < 0.0:
            return replace(self, start=_point(start[0] + way * along(self.heading)), first=-past_bend)
        if past_arc >= 0.0:
            begin = _point(leave[0] + past_arc * along(leave[1]))
            return Stroke(begin, leave[1], max(self.last - past_arc, 0.0))
        side = float(np.sign(self.turn))
        turned = side * past_bend / self.radius
        heading = self.heading + turned
        begin = _point(bend[0] + side * self.radius * (left(self.heading) - left(heading)))
        return Stroke(begin, heading, self.last, 0.0, self.turn - turned, self.radius)

    def met(self, points: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """When and where the front comes upon points (n,2) that lie within `reach` of its middle.

        Metres travelled (n,), negative behind the start, infinite where it never comes; and how far to the left of
        the middle (n,).
        """
        start, bend, leave, _ = self.legs
        when, where = np.full(len(points), np.inf), np.zeros(len(points))

        def note(ahead: np.ndarray, lateral: np.ndarray, passed: float, begin: float, end: float) -> None:
            hit = (ahead >= begin - ROUNDING) & (ahead <= end + ROUNDING) & (np.abs(lateral) <= reach)
            when[hit], where[hit] = passed + ahead[hit], lateral[hit]

        if not self.turn:
            note(*_straight(points, *leave), 0.0, -np.inf, self.last)
            return when, where
        arc = abs(self.turn) * self.radius
        note(*_straight(points, *leave), self.first + arc, 0.0, self.last)
        side = float(np.sign(self.turn))
        offset = points - (bend[0] + side * self.radius * left(self.heading))
        spoke = -side * left(self.heading)
        angle = np.arctan2(side * (spoke[0] * offset[:, 1] - spoke[1] * offset[:, 0]), offset @ spoke)
        lateral = side * (self.radius - np.linalg.norm(offset, axis=1))
        note(angle * self.radius, lateral, self.first, 0.0, arc)
        note(*_straight(points, *start), 0.0, -np.inf, self.first)
        return when, where


def _straight(points: np.ndarray, start: np.ndarray, heading: float) -> tuple[np.ndarray, np.ndarray]:
    offset = points - start
    return offset @ along(heading), offset @ left(heading)


def _point(p: np.ndarray) -> tuple[float, float]:
    return float(p[0]), float(p[1])


def along(heading: float) -> np.ndarray:
    """Unit vector (2,) of a heading."""
    return np.array([np.cos(heading), np.sin(heading)])


def left(heading: float) -> np.ndarray:
    """Unit vector (2,) to the left of a heading."""
    return np.array([-np.sin(heading), np.cos(heading)])


@dataclass(frozen=True)
class Tool:
    """A sponge broadside to its course: `width` of its front, `depth` along the course, and `span`, the width of
    sponge and fingers together, in metres."""

    width: float
    depth: float
    span: float


@dataclass(frozen=True)
class Crumbs:
    """Crumbs on a surface: names, positions (n,2) and radii (n,) of the circles about their footprints."""

    names: tuple[str, ...]
    p: np.ndarray
    r: np.ndarray


@dataclass(frozen=True)
class Opening:
    """Where crumbs enter a dustpan: `middle` (2,), unit vector `inward` (2,), half its inner width in metres.

    `is_edge`: the sponge stands out beyond the table's edge there; otherwise it climbs a ramp between side walls.
    """

    middle: np.ndarray
    inward: np.ndarray
    half_width: float
    is_edge: bool

    @property
    def heading(self) -> float:
        """The heading square into the dustpan."""
        return float(np.arctan2(self.inward[1], self.inward[0]))

    @property
    def across(self) -> np.ndarray:
        """Unit vector (2,) along the open side, to the left of who enters."""
        return left(self.heading)


def opening_of(pan: Region, table: Table) -> Opening | None:
    """Where crumbs leave the table's plane for a dustpan; None if a rim of the dustpan is in their way.

    Raises ValueError for a region without an open side.
    """
    if pan.open_side is None:
        raise ValueError(f"region {pan.name!r} has no open side, expected a dustpan")
    out = OUTWARD[pan.open_side]
    axis = int(np.argmax(np.abs(out)))
    lower, upper = interior(pan)
    middle = (lower + upper) / 2
    middle[axis] = upper[axis] if out[axis] > 0 else lower[axis]
    half_width = float(upper[1 - axis] - lower[1 - axis]) / 2
    inward = -(pan.X_WR.rotation @ out)[:2]
    inward /= np.linalg.norm(inward)
    entry = pan.X_WR.act(middle)[:2]
    floor = float(pan.X_WR.act(np.array([0.0, 0.0, lower[2]]))[2])
    if pan.ramp_deg is not None:
        return Opening(entry, inward, half_width, is_edge=False)
    if floor > top_of(table):
        return None
    return Opening(entry + inward * max(0.0, _to_edge(table, entry, inward)), inward, half_width, is_edge=True)


def top_of(table: Table) -> float:
    """Height in W of the table's upper side."""
    return float(table.X_WT.translation[2]) + table.size[2] / 2


def _to_edge(table: Table, point: np.ndarray, direction: np.ndarray) -> float:
    """Metres from a point (2,) in a direction (2,) to where the table ends; negative if it lies beyond."""
    R = table.X_WT.rotation[:2, :2]
    p, d = R.T @ (point - table.X_WT.translation[:2]), R.T @ direction
    axis = int(np.argmax(np.abs(d)))
    return float((np.sign(d[axis]) * table.size[axis] / 2 - p[axis]) / d[axis])


def is_supported(table: Table, tool: Tool, front: np.ndarray, heading: float) -> bool:
    """Does the sponge with its front's middle there stand on the table with all of its inner half?"""
    centre = front - along(heading) * tool.depth / 2
    reach = np.array([[i * tool.depth, j * tool.width] for i in (-1.0, 1.0) for j in (-1.0, 1.0)]) / 4
    corners = centre + reach @ np.stack([along(heading), left(heading)])
    p = (corners - table.X_WT.translation[:2]) @ table.X_WT.rotation[:2, :2]
    return bool(np.all(np.abs(p) <= np.array(table.size[:2]) / 2))


def taken(stroke: Stroke, tool: Tool, crumbs: Crumbs, opening: Opening, surely: bool = True) -> np.ndarray:
    """Which crumbs (n,) the stroke brings through the opening: surely those that are wholly before the sponge and pass
    clear of the dustpan's walls, most likely all whose middle the sponge or a finger meets."""
    when, where = stroke.met(crumbs.p, tool.span / 2)
    kept = np.isfinite(when) & (when >= crumbs.r)
    if surely:
        kept &= np.abs(where) + crumbs.r <= tool.width / 2 - EDGE
    crossing, needed = crossing_of(stroke, opening, where)
    aside = crumbs.r + SIDE_MARGIN if surely else crumbs.r / 2
    inside = np.abs(crossing) + aside <= opening.half_width + 1e-9
    enough = needed + LEAST_OVERRUN - TIPPING * crumbs.r <= stroke.last
    return kept & inside & enough & (when <= stroke.length)


def crossing_of(stroke: Stroke, opening: Opening, lateral: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where along the opening what is pushed at `lateral` (n,) crosses it, and how far along the last leg."""
    leave, heading = stroke.legs[2]
    points = leave + lateral[:, None] * left(heading)
    pace = float(along(heading) @ opening.inward)
    way = (opening.middle - points) @ opening.inward / pace
    return (points + way[:, None] * along(heading) - opening.middle) @ opening.across, way


def is_lost(rest: Stroke, tool: Tool, opening: Opening, point: np.ndarray, radius: float) -> bool:
    """Is a crumb at a point (2,), of a radius in metres, for certain none that the rest of a stroke takes along?

    What has passed the opening isn't lost, nor what lies beneath the sponge or in a heap before it.
    """
    offset = point - opening.middle
    is_through = offset @ opening.inward >= -radius and abs(offset @ opening.across) <= opening.half_width + radius
    room = radius + CLEAR
    further = replace(rest, last=rest.last + HEAPED)
    when = float(further.met(point[None], tool.span / 2 + room)[0][0])
    return not is_through and not (np.isfinite(when) and when >= -tool.depth - room)
