"""Shorter polylines from longer ones, by straight edges that are free."""

import numpy as np

from planner.motion.checking import CollisionChecker

TRIES = 40


def shortened(path: np.ndarray, checker: CollisionChecker, rng: np.random.Generator, tries: int = TRIES) -> np.ndarray:
    """Leave out waypoints of the path (n,7) where the way round them is free, then try `tries` random shortcuts.

    A random shortcut joins two points anywhere on the path (Geraerts, Overmars: Creating high-quality
    paths for motion planning, 2007).
    """
    path = _without_detours(path, checker)
    for _ in range(tries if len(path) > 2 else 0):
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
        a, b = np.sort(rng.uniform(0.0, way[-1], 2))
        i, j = np.searchsorted(way, [a, b], side="right") - 1
        i, j = min(i, len(path) - 2), min(j, len(path) - 2)
        if i == j:
            continue
        qa = path[i] + (path[i + 1] - path[i]) * (a - way[i]) / (way[i + 1] - way[i])
        qb = path[j] + (path[j + 1] - path[j]) * (b - way[j]) / (way[j + 1] - way[j])
        if checker.edge_is_free(qa, qb):
            path = np.concatenate([path[: i + 1], qa[None], qb[None], path[j + 1 :]])
    return _without_detours(path, checker)


def _without_detours(path: np.ndarray, checker: CollisionChecker) -> np.ndarray:
    kept, i = [path[0]], 0
    while i < len(path) - 1:
        j = len(path) - 1
        while j > i + 1 and not checker.edge_is_free(path[i], path[j]):
            j -= 1
        kept.append(path[j])
        i = j
    return np.array(kept)
