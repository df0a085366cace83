"""Shorter polylines from longer ones, by straight edges that are free."""

import numpy as np
from numba import njit

from planner.motion.checking import CollisionChecker
from planner.motion.collision import JOINT_STEP, TRAVEL_STEP, FastChecker
from planner.motion.kernels import edge_is_free

CUTS = np.random.default_rng(0).uniform(size=(48, 3))
"""Where the cuts lie, see `shorten`: at random, but the same for all paths (drawing takes longer than cutting)."""

GOOD = 1.1
"""Times the straight way, which nothing undercuts: a path no longer than that is short enough."""

WORTH = 0.01
"""Part of the path's length that a shortcut must save for its edge to be looked at."""


def shortened(path: np.ndarray, checker: CollisionChecker, cuts: np.ndarray = CUTS) -> np.ndarray:
    """Leave out waypoints of the path (n,7) where the way round them is free, then try the `cuts` (k,3) of corners
    until it is short enough.

    A corner is cut from somewhere on the two edges before it to somewhere on the two after it, see `shorten` (compare
    Geraerts, Overmars: Creating high-quality paths for motion planning, 2007). The exact model, a hundred times slower,
    is not asked about any.
    """
    if isinstance(checker, FastChecker):
        points, checks = shorten(np.array(path, dtype=float), cuts, checker.packed)
        checker.checks += checks
        return points
    kept, i = [path[0]], 0
    while i < len(path) - 1:
        j = len(path) - 1
        while j > i + 1 and not checker.edge_is_free(path[i], path[j]):
            j -= 1
        kept.append(path[j])
        i = j
    return np.array(kept)


@njit(cache=True)
def shorten(path, cuts, packed):
    """The path (n,7) made shorter, and the number of configurations checked; cuts (k,3), from 0 to 1: which corner each
    is at, and how far before and after it the cut ends."""
    # Room for what the cuts add: two points each at most.
    points = np.empty((path.shape[0] + 2 * cuts.shape[0], 7))
    points[: path.shape[0]] = path
    count, checks = _without_detours(points, path.shape[0], packed)
    way, tail = np.zeros(points.shape[0]), np.empty_like(points)
    enough = GOOD * np.sqrt(np.sum((path[-1] - path[0]) ** 2))
    for n in range(cuts.shape[0]):
        for i in range(1, count):
            way[i] = way[i - 1] + np.sqrt(np.sum((points[i] - points[i - 1]) ** 2))
        length = way[count - 1]
        if count == 2 or length <= enough:
            break
        corner = 1 + int(cuts[n, 0] * (count - 2))
        first = way[corner] - cuts[n, 1] * (way[corner] - way[max(corner - 2, 0)])
        second = way[corner] + cuts[n, 2] * (way[min(corner + 2, count - 1)] - way[corner])
        i = min(np.searchsorted(way[:count], first, side="right"), count - 1) - 1
        j = min(np.searchsorted(way[:count], second, side="right"), count - 1) - 1
        if i == j:
            continue
        qa = points[i] + (points[i + 1] - points[i]) * ((first - way[i]) / (way[i + 1] - way[i]))
        qb = points[j] + (points[j + 1] - points[j]) * ((second - way[j]) / (way[j + 1] - way[j]))
        if second - first - np.sqrt(np.sum((qb - qa) ** 2)) < WORTH * length:
            continue
        free, looked = edge_is_free(qa, qb, packed, JOINT_STEP, TRAVEL_STEP)
        checks += looked
        if free:
            left = count - j - 1
            tail[:left] = points[j + 1 : count]
            points[i + 1], points[i + 2] = qa, qb
            points[i + 3 : i + 3 + left] = tail[:left]
            count = i + 3 + left
    count, looked = _without_needless(points, count, packed)
    return points[:count].copy(), checks + looked


@njit(cache=True)
def _without_detours(points, count, packed):
    """Leave out points in place, as many at a time as can be; how many are left, and the number of configurations
    checked."""
    kept, i, checks = 1, 0, 0
    while i < count - 1:
        j = count - 1
        while j > i + 1:
            free, looked = edge_is_free(points[i], points[j], packed, JOINT_STEP, TRAVEL_STEP)
            checks += looked
            if free:
                break
            j -= 1
        # kept ≤ j: nothing still needed is written over.
        points[kept] = points[j]
        kept += 1
        i = j
    return kept, checks


@njit(cache=True)
def _without_needless(points, count, packed):
    """The same, one point at a time."""
    kept, checks = 1, 0
    for i in range(1, count - 1):
        free, looked = edge_is_free(points[kept - 1], points[i + 1], packed, JOINT_STEP, TRAVEL_STEP)
        checks += looked
        if not free:
            points[kept] = points[i]
            kept += 1
    points[kept] = points[count - 1]
    return kept + 1, checks
