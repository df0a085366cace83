"""What never changes in a scenario, prepared for stating facts often: surfaces as spans, bodies by kind."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from pinocchio import SE3

from scenarios.goal import is_crumb
from scenarios.names import TABLE
from scenarios.regions import interior
from scenarios.scenario import Body, Scenario
from scenarios.shapes import reach

REST_ABOVE = 0.02
REST_BELOW = 0.01
"""Metres that a body's lowest point may lie above or below a surface on which it counts as resting."""


@dataclass(frozen=True)
class Span:
    """Points p of W with low ≤ axis · p ≤ high: a slab between two parallel planes, in metres."""

    axis: tuple[float, float, float]
    low: float
    high: float

    def holds(self, p: tuple[float, float, float]) -> bool:
        """Is the point (3,) of W between the planes?"""
        x, y, z = self.axis
        return self.low <= x * p[0] + y * p[1] + z * p[2] <= self.high

    def is_below(self, p: tuple[float, float, float]) -> bool:
        """Does the point (3,) of W lie beyond the higher plane?"""
        x, y, z = self.axis
        return x * p[0] + y * p[1] + z * p[2] > self.high


class Layout:
    """A scenario's regions and table as spans, and the PDDL type of each of its bodies and surfaces."""

    def __init__(self, scenario: Scenario) -> None:
        self.kinds = {name: _kind(body, scenario.robot.model) for name, body in scenario.bodies.items()}
        self.sponges = frozenset(name for name, body in scenario.bodies.items() if body.tool == "sponge")
        self.surfaces = {**{name: region.kind for name, region in scenario.regions.items()}, TABLE: "tabletop"}
        self.bins = frozenset(name for name, kind in self.surfaces.items() if kind == "bin")
        self._shapes = {name: body.shape for name, body in scenario.bodies.items()}
        self._regions = []
        self._open: list[tuple[str, tuple[Span, ...]]] = []
        # Asked at every tick of the tree; most of what lies there has not moved since the last one.
        self._last: dict[str, tuple[SE3, str | None]] = {}
        for name, region in scenario.regions.items():
            lower, upper = interior(region)
            spans = _spans(region.X_WR, lower - [0.0, 0.0, REST_BELOW], upper)
            self._regions.append((name, spans))
            if region.kind == "dustpan":
                self._open.append((name, spans))
        table = scenario.table
        half = np.array(table.size) / 2
        *self._plate, top = _spans(table.X_WT, -half, half)
        self._up, self._top = np.array(top.axis), top.high
        self._open.append((TABLE, (*self._plate, top)))

    def place_of(self, name: str, X_WO: SE3) -> str | None:
        """The region in which a body's centre lies, or the table on which it rests, or None."""
        X_last, place = self._last.get(name, (None, None))
        if X_last is not X_WO:
            place = self._found_place_of(name, X_WO)
            self._last[name] = X_WO, place
        return place

    def _found_place_of(self, name: str, X_WO: SE3) -> str | None:
        x, y, z = X_WO.translation.tolist()
        p_W = (x, y, z)
        for region, spans in self._regions:
            if all(span.holds(p_W) for span in spans):
                return region
        if all(span.holds(p_W) for span in self._plate):
            lowest = float(self._up @ X_WO.translation) - reach(self._shapes[name], -X_WO.rotation.T @ self._up)
            if -REST_BELOW <= lowest - self._top <= REST_ABOVE:
                return TABLE
        return None

    def over(self, X_WO: SE3) -> str | None:
        """The table or dustpan above which a body's centre lies, at whatever height. In a bin, what is heaped above
        the rim isn't in it."""
        x, y, z = X_WO.translation.tolist()
        p_W = (x, y, z)
        for name, (*sides, top) in self._open:
            if all(side.holds(p_W) for side in sides) and top.is_below(p_W):
                return name
        return None


def layout(scenario: Scenario) -> Layout:
    """The scenario's layout; the same object for the same scenario."""
    return _layout(Identity(scenario))


class Identity:
    """Makes an object a key by what it is, not what it holds."""

    def __init__(self, it: Any) -> None:
        self.it = it

    def __hash__(self) -> int:
        return id(self.it)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Identity) and self.it is other.it


@lru_cache(maxsize=8)
def _layout(scenario: Identity) -> Layout:
    return Layout(scenario.it)


def _kind(body: Body, model: str) -> str:
    if body.tool is not None:
        return "tool"
    return "crumb" if is_crumb(body, model) else "movable"


def _spans(X_WS: SE3, lower: np.ndarray, upper: np.ndarray) -> tuple[Span, ...]:
    """The box between two corners (3,), given in S, as three slabs of W along the axes of S."""
    spans = []
    for i in range(3):
        axis = X_WS.rotation[:, i]
        offset = float(axis @ X_WS.translation)
        x, y, z = axis.tolist()
        spans.append(Span((x, y, z), offset + float(lower[i]), offset + float(upper[i])))
    return tuple(spans)
