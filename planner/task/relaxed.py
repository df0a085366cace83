"""Heuristics of delete relaxation, compiled: what a state is away from the goal if nothing were ever deleted.

h^max and h^FF in the terms of Hoffmann and Nebel (The FF Planning System, 2001) with supporters by h^add (Bonet and
Geffner, Planning as Heuristic Search, 2001). They stand in for Pyperplan's, where nearly all its time goes.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numba import njit

FAR = np.int32(2**28)
"""Cost of what can't be reached; sums of a few of them don't overflow."""


class RelaxedHeuristic:
    """h^FF or, with `is_max`, h^max of the states of a task whose facts are the numbers 0, 1, 2, …"""

    def __init__(self, task: Any, is_max: bool) -> None:
        self._is_max = is_max
        self._needs = _table(operator.preconditions for operator in task.operators)
        self._adds = _table(operator.add_effects for operator in task.operators)
        users: list[list[int]] = [[] for _ in task.facts]
        for index, operator in enumerate(task.operators):
            for fact in sorted(operator.preconditions):
                users[fact].append(index)
        self._users = _table(users)
        self._goal = np.array(sorted(task.goals), dtype=np.int32)
        self._count = len(task.facts)

    def __call__(self, node: Any) -> float:
        """Estimate for a search node's state, infinite where even the relaxed goal is out of reach."""
        state = np.fromiter(node.state, dtype=np.int32, count=len(node.state))
        state.sort()
        value = _estimate(state, self._goal, self._count, *self._needs, *self._adds, *self._users, self._is_max)
        return float("inf") if value >= FAR else int(value)


def _table(rows: Iterable[Iterable[int]]) -> tuple[np.ndarray, np.ndarray]:
    """The rows one after the other, each sorted, and where each begins (one more than there are rows)."""
    lists = [sorted(row) for row in rows]
    starts = np.zeros(len(lists) + 1, dtype=np.int32)
    np.cumsum([len(row) for row in lists], out=starts[1:])
    return np.array([entry for row in lists for entry in row], dtype=np.int32), starts


@njit(cache=True)
def _estimate(state, goal, count, needs, needs_at, adds, adds_at, users, users_at, is_max):
    """h^max or h^FF of a state (n,), FAR if the relaxed goal can't be reached."""
    cost = np.full(count, FAR, dtype=np.int32)
    supporter = np.full(count, -1, dtype=np.int32)
    queue = np.empty(count, dtype=np.int32)
    is_queued = np.zeros(count, dtype=np.bool_)
    head, waiting = 0, 0
    for fact in state:
        cost[fact] = 0
        queue[waiting] = fact
        is_queued[fact] = True
        waiting += 1
    operators = needs_at.size - 1
    for operator in range(operators):
        if needs_at[operator] == needs_at[operator + 1]:
            for k in range(adds_at[operator], adds_at[operator + 1]):
                fact = adds[k]
                if cost[fact] > 1:
                    cost[fact] = 1
                    supporter[fact] = operator
                    queue[(head + waiting) % count] = fact
                    is_queued[fact] = True
                    waiting += 1
    while waiting > 0:
        reached = queue[head]
        head = (head + 1) % count
        waiting -= 1
        is_queued[reached] = False
        for u in range(users_at[reached], users_at[reached + 1]):
            operator = users[u]
            before = _combined(needs, needs_at[operator], needs_at[operator + 1], cost, is_max)
            if before >= FAR:
                continue
            for k in range(adds_at[operator], adds_at[operator + 1]):
                fact = adds[k]
                if before + 1 < cost[fact]:
                    cost[fact] = before + 1
                    supporter[fact] = operator
                    if not is_queued[fact]:
                        queue[(head + waiting) % count] = fact
                        is_queued[fact] = True
                        waiting += 1
    total = _combined(goal, 0, goal.size, cost, is_max)
    if is_max or total >= FAR:
        return total
    return _relaxed_plan_length(goal, needs, needs_at, supporter, operators, queue, is_queued)


@njit(cache=True)
def _combined(facts, first, last, cost, is_max):
    """Sum or maximum of the facts' costs, at most FAR."""
    total = np.int64(0)
    for k in range(first, last):
        one = np.int64(cost[facts[k]])
        total = max(total, one) if is_max else total + one
    return np.int32(min(total, np.int64(FAR)))


@njit(cache=True)
def _relaxed_plan_length(goal, needs, needs_at, supporter, operators, stack, is_met):
    """Number of operators that support the goal, each counted once; `stack` and `is_met` are overwritten."""
    is_met[:] = False
    is_taken = np.zeros(operators, dtype=np.bool_)
    depth, length = 0, 0
    for fact in goal:
        stack[depth] = fact
        is_met[fact] = True
        depth += 1
    while depth > 0:
        depth -= 1
        operator = supporter[stack[depth]]
        if operator < 0 or is_taken[operator]:
            continue
        is_taken[operator] = True
        length += 1
        for k in range(needs_at[operator], needs_at[operator + 1]):
            fact = needs[k]
            if not is_met[fact]:
                is_met[fact] = True
                stack[depth] = fact
                depth += 1
    return np.int32(length)
