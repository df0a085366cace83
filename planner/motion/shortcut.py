"""Shorter polylines from longer ones, by straight edges that are free."""

import numpy as np
from numba import njit

from planner.motion.checking import CollisionChecker
from planner.motion.collision import JOINT_STEP, TRAVEL_STEP, FastChecker
from planner.motion.kernels import edge_is_free

TRIES = 24

WORTH = 0.01
"""Part of the path's length that a shortcut must save for its edge to be looked at."""


def shortened(path: np.ndarray, checker: CollisionChecker, rng: np.random.Generator, tries: int = TRIES) -> np.ndarray:
    """Leave out waypoints of the path (n,7) where the way round them is free, then try `tries` random shortcuts.

    A random shortcut joins two points anywhere on the path (Geraerts, Overmars: Creating high-quality
    paths for motion planning, 2007). The exact model, a hundred times slower, is not asked about any.
    """
    if isinstance(checker, FastChecker):
        points, checks = shorten(np.array(path, dtype=float), rng.uniform(size=(tries, 2)), checker.packed)
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
def shorten(path, parts, packed):
    """The path (n,7) made shorter, and the number of configurations checked; parts (k,2): between which two parts of
    its length, from 0 to 1, each of the random shortcuts is."""
    # Room for what the shortcuts add: two points each at most.
    points = np.empty((path.shape[0] + 2 * parts.shape[0], 7))
    points[: path.shape[0]] = path
    count, checks = _without_detours(points, path.shape[0], packed)
    way, tail = np.zeros(points.shape[0]), np.empty_like(points)
    for n in range(parts.shape[0] if count > 2 else 0):
        for i in range(1, count):
            way[i] = way[i - 1] + np.sqrt(np.sum((points[i] - points[i - 1]) ** 2))
        length = way[count - 1]
        first, second = min(parts[n, 0], parts[n, 1]) * length, max(parts[n, 0], parts[n, 1]) * length
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
    count, looked = _without_detours(points, count, packed)
    return points[:count].copy(), checks + looked


@njit(cache=True)
def _without_detours(points, count, packed):
    """Leave out points in place; how many are left, and the number of configurations checked."""
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
