"""Shorter polylines from longer ones, by straight edges that are free."""

from bisect import bisect_right
from itertools import accumulate, pairwise
from math import dist

import numpy as np

from planner.motion.checking import CollisionChecker

TRIES = 40

WORTH = 0.01
"""Part of the path's length that a shortcut must save for its edge to be looked at."""


def shortened(path: np.ndarray, checker: CollisionChecker, rng: np.random.Generator, tries: int = TRIES) -> np.ndarray:
    """Leave out waypoints of the path (n,7) where the way round them is free, then try `tries` random shortcuts.

    A random shortcut joins two points anywhere on the path (Geraerts, Overmars: Creating high-quality
    paths for motion planning, 2007).
    """
    points = _without_detours(list(path), checker)
    way = _way(points)
    for parts in rng.uniform(size=(tries if len(points) > 2 else 0, 2)):
        first, second = sorted((parts * way[-1]).tolist())
        i, qa = _at(points, way, first)
        j, qb = _at(points, way, second)
        if i == j or second - first - dist(qa, qb) < WORTH * way[-1]:
            continue
        if checker.edge_is_free(qa, qb):
            points = [*points[: i + 1], qa, qb, *points[j + 1 :]]
            way = _way(points)
    return np.array(_without_detours(points, checker))


def _way(points: list[np.ndarray]) -> list[float]:
    return list(accumulate((dist(a, b) for a, b in pairwise(points)), initial=0.0))


def _at(points: list[np.ndarray], way: list[float], where: float) -> tuple[int, np.ndarray]:
    """The stretch on which the point `where` rad along the path lies, and that point."""
    i = min(bisect_right(way, where) - 1, len(points) - 2)
    return i, points[i] + (points[i + 1] - points[i]) * ((where - way[i]) / (way[i + 1] - way[i]))


def _without_detours(points: list[np.ndarray], checker: CollisionChecker) -> list[np.ndarray]:
    kept, i = [points[0]], 0
    while i < len(points) - 1:
        j = len(points) - 1
        while j > i + 1 and not checker.edge_is_free(points[i], points[j]):
            j -= 1
        kept.append(points[j])
        i = j
    return kept
