"""Is a configuration walled in, and by what? A cheap look once a search has failed, before more of the budget is spent.

It is no proof, but evidence like that of the search itself.
"""

from dataclasses import dataclass

import numpy as np

from planner.motion.checking import CollisionChecker
from planner.motion.collision import FastChecker
from planner.motion.exact import ExactChecker
from planner.motion.ompl_ import Query

TRIES = 500
STEPS = (0.05, 1.0)
"""Shortest and longest step in rad of the walk that seeks a way out."""

CANDIDATES = 3
"""Of as many places that were reached, drawn at random, a step sets out from the one that is furthest away."""

ONWARD = 0.75
"""Every second step goes on the way that led to where it sets out, by this share, so that a slot is followed."""

CARRYING = 4
"""The joints, from the base on, that carry the wrist: a turning hand leads nowhere."""

AWAY = 1.0
"""Rad that these have to come away from where they were: a cage may leave half a rad."""

LOOKS, LOOK = 30, 0.15
"""Steps of this length in rad whose ends tell what the walls are."""


@dataclass(frozen=True)
class EnclosedEnd:
    """An end of a query, "start" or "goal", that there is no way out of: q (7,) in rad."""

    which: str
    q: np.ndarray


def enclosed_end(checker: CollisionChecker, query: Query) -> EnclosedEnd | None:
    """The query's "start", or one "goal" if all are walled in, as a configuration (7,); None if there is a way out.

    Only the fast model is asked: the exact one would take longer than the search that it saves.
    """
    if not isinstance(checker, FastChecker):
        return None
    if _is_enclosed(checker, query.start, query):
        return EnclosedEnd("start", query.start)
    if all(_is_enclosed(checker, goal, query) for goal in query.goals):
        return EnclosedEnd("goal", query.goals[0])
    return None


def _is_enclosed(checker: FastChecker, q: np.ndarray, query: Query) -> bool:
    """Does no walk of random steps, of any length, bring the wrist away from q (7,)?"""
    rng = np.random.default_rng(query.seed)
    turns, drawn = rng.normal(size=(TRIES, 7)), rng.uniform(size=(TRIES, CANDIDATES))
    lengths = np.exp(rng.uniform(*np.log(STEPS), size=TRIES))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    turns[::2] *= 1.0 - ONWARD
    reached, ways, far = [q], [np.zeros(7)], [0.0]
    for n in range(TRIES):
        start = max((int(part * len(far)) for part in drawn[n]), key=far.__getitem__)
        way = turns[n] if n % 2 else turns[n] + ONWARD * ways[start]
        way = way / np.sqrt(way @ way)
        end = _within(reached[start] + lengths[n] * way, query.limits)
        if checker.edge_is_free(reached[start], end):
            led = (end - q)[:CARRYING]
            away = float(np.sqrt(led @ led))
            if away > AWAY:
                return False
            reached.append(end)
            ways.append(way)
            far.append(away)
    return True


def walls_about(exact: ExactChecker, q: np.ndarray, limits: np.ndarray, seed: int) -> list[str]:
    """Names of what is hit a step away from q (7,), sorted."""
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(LOOKS, 7))
    around = q + LOOK * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    contacts = exact.contacts(_within(around, limits))
    return sorted(frozenset().union(*(contact.pair for contact in contacts)) - exact.parts)


def _within(q: np.ndarray, limits: np.ndarray) -> np.ndarray:
    # np.clip takes three times as long.
    return np.minimum(np.maximum(q, limits[0]), limits[1])
