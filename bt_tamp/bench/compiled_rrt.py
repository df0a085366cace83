"""The limit for `bench motion`: a bidirectional RRT, compiled like the planner's own kernels and shortcuts.

Bidirectional RRT as in Kuffner, LaValle: RRT-Connect, an efficient approach to single-query path planning, 2000.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from planner.motion.collision import JOINT_STEP, TRAVEL_STEP, FastChecker
from planner.motion.kernels import edge_is_free
from planner.motion.ompl_ import Query
from planner.motion.shortcut import CUTS, shorten

NODES = 4000

_part = njit(inline="always")
"""Compiled into `_plan` only: every function of its own would have the kernels compiled into it anew."""


@dataclass(frozen=True)
class CompiledPath:
    """Waypoints (n,7) of the path as found, and those after shortcutting."""

    found: np.ndarray
    short: np.ndarray


def plan_compiled(checker: FastChecker, query: Query, step: float) -> CompiledPath | None:
    """A path from the start to the first goal, edges of the trees at most `step` rad long; None within NODES nodes."""
    ends = np.array(query.start), np.array(query.goals[0])
    rng = np.random.default_rng(query.seed)
    path = _plan(*ends, checker.packed, np.array(query.limits), step, rng)
    if not len(path):
        return None
    return CompiledPath(path, shorten(path, CUTS, checker.packed)[0])


@njit(cache=True)
def _plan(start, goal, packed, limits, step, rng):
    found = np.empty((2 * NODES, 7))
    return found[: _search(start, goal, packed, limits, step, rng, found)].copy()


@_part
def _search(start, goal, packed, limits, step, rng, found):
    """Write the waypoints to `found`; how many there are."""
    if edge_is_free(start, goal, packed, JOINT_STEP, TRAVEL_STEP)[0]:
        found[0], found[1] = start, goal
        return 2
    trees, parents = np.empty((2, NODES, 7)), np.zeros((2, NODES), dtype=np.int64)
    sizes = np.ones(2, dtype=np.int64)
    trees[0, 0], trees[1, 0] = start, goal
    sample, q = np.empty(7), np.empty(7)
    grown = 0
    while max(sizes[0], sizes[1]) < NODES - 1:
        for k in range(7):
            sample[k] = rng.uniform(limits[0, k], limits[1, k])
        if _extend(trees[grown], parents[grown], sizes, grown, sample, step, packed, q) > 0:
            tip = trees[grown, sizes[grown] - 1].copy()
            other = 1 - grown
            outcome = 1
            while outcome == 1 and sizes[other] < NODES - 1:
                outcome = _extend(trees[other], parents[other], sizes, other, tip, step, packed, q)
            if outcome == 2:
                return _joined(trees, parents, sizes, found)
        grown = 1 - grown
    return 0


@_part
def _extend(tree, parent, sizes, n, target, step, packed, q):
    """Add an edge towards the target: 0 if it is blocked, 1 if there is some way left, 2 if the target is reached."""
    nearest, least = 0, np.inf
    for i in range(sizes[n]):
        square = 0.0
        for k in range(7):
            square += (tree[i, k] - target[k]) ** 2
        if square < least:
            nearest, least = i, square
    way = np.sqrt(least)
    part = min(1.0, step / max(way, 1e-12))
    for k in range(7):
        q[k] = tree[nearest, k] + (target[k] - tree[nearest, k]) * part
    # The goal's tree too is checked outwards: its near end is known to be free.
    if not edge_is_free(tree[nearest], q, packed, JOINT_STEP, TRAVEL_STEP)[0]:
        return 0
    tree[sizes[n]], parent[sizes[n]] = q, nearest
    sizes[n] += 1
    return 2 if part == 1.0 else 1


@_part
def _joined(trees, parents, sizes, found):
    """Write the path through the last nodes of both trees, which are the same, to `found`; its waypoints."""
    count, node = 0, sizes[0] - 1
    while True:
        found[count] = trees[0, node]
        count += 1
        if node == 0:
            break
        node = parents[0, node]
    for i in range(count // 2):
        for k in range(7):
            found[i, k], found[count - 1 - i, k] = found[count - 1 - i, k], found[i, k]
    node = sizes[1] - 1
    while node != 0:
        node = parents[1, node]
        found[count] = trees[1, node]
        count += 1
    return count
