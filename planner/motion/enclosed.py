"""Is a configuration walled in, and by what? A cheap look once a search has failed, before more of the budget is spent.

It is no proof, but evidence like that of the search itself.
"""

import numpy as np

from planner.motion.checking import CollisionChecker
from planner.motion.collision import FastChecker
from planner.motion.exact import ExactChecker
from planner.motion.ompl_ import Query

TRIES = 100
STEPS = (0.03, 0.5)
"""Shortest and longest step in rad of the walks that seek a way out."""

CARRYING = 4
"""The joints, from the base on, that carry the wrist: a turning hand leads nowhere."""

AWAY = 0.3
"""Rad that these have to come away from where they were."""

LOOKS, LOOK = 30, 0.15
"""Steps of this length in rad whose ends tell what the walls are."""


def enclosed_end(checker: CollisionChecker, query: Query) -> tuple[str, np.ndarray] | None:
    """The query's "start", or one "goal" if all are walled in, as a configuration (7,); None if there is a way out.

    Only the fast model is asked: the exact one would take longer than the search that it saves.
    """
    if not isinstance(checker, FastChecker):
        return None
    if _is_enclosed(checker, query.start, query):
        return "start", query.start
    if all(_is_enclosed(checker, goal, query) for goal in query.goals):
        return "goal", query.goals[0]
    return None


def _is_enclosed(checker: FastChecker, q: np.ndarray, query: Query) -> bool:
    """Does no random step, of any length and from wherever those before led, bring the wrist away from q?"""
    rng = np.random.default_rng(query.seed)
    reached = [q]
    for _ in range(TRIES):
        start = reached[rng.integers(len(reached))]
        end = _step(start, np.exp(rng.uniform(*np.log(STEPS))), query.limits, rng)
        if checker.edge_is_free(start, end):
            if np.linalg.norm((end - q)[:CARRYING]) > AWAY:
                return False
            reached.append(end)
    return True


def walls_about(exact: ExactChecker, q: np.ndarray, query: Query) -> list[str]:
    """Names of what is hit a step away from q (7,), sorted."""
    rng = np.random.default_rng(query.seed)
    contacts = exact.contacts(np.array([_step(q, LOOK, query.limits, rng) for _ in range(LOOKS)]))
    return sorted(frozenset().union(*(contact.pair for contact in contacts)) - exact.parts)


def _step(q: np.ndarray, length: float, limits: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    way = rng.normal(size=7)
    return np.clip(q + way * length / np.linalg.norm(way), limits[0], limits[1])
