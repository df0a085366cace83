"""The paper's fallback, as the ablation of `bench task`: plans one after the other, nothing learned from failures."""

import heapq
import itertools
from collections.abc import Iterator

import numpy as np

from bt_tamp.bench.courses import Course, StandIn
from planner.failure import RefinementFailure
from planner.refinement import Budget, Hints
from planner.task.facts import facts, goal_facts, objects_of
from planner.task.pddl import Domain
from planner.task.primitives import ground
from planner.task.symbols import Fact, Step
from sim.scene import SceneState


class Anything:
    """Nothing is known: all can be grasped, all may be dragged, nothing is in the way."""

    def ungraspable(self, scene: SceneState) -> frozenset[str]:
        return frozenset()

    def stuck(self, scene: SceneState) -> frozenset[str]:
        return frozenset(scene.poses)

    def in_the_way(self, scene: SceneState) -> frozenset[str]:
        return frozenset()


def plans(domain: Domain, scene: SceneState, goal: frozenset[Fact], max_expansions: int) -> Iterator[tuple[Step, ...]]:
    """Task plans, the shorter ones first, until so many nodes are expanded; no state occurs twice in a plan.

    A* over paths with the number of goals that a step can't reach at once as estimate, which is admissible.
    """
    objects = objects_of(scene)
    steps = []
    for schema in domain.actions:
        fitting = [[o for o in objects if domain.is_kind(objects[o], p.type)] for p in schema.parameters]
        steps += [ground(schema, args) for args in itertools.product(*fitting)]
    most = max(len(goal & step.adds) for step in steps)
    start = facts(scene, Anything())
    order = itertools.count()
    heap: list[tuple[float, int, frozenset[Fact], tuple[Step, ...], frozenset[frozenset[Fact]]]] = [
        (len(goal - start) / most, next(order), start, (), frozenset({start}))
    ]
    for _ in range(max_expansions):
        if not heap:
            return
        _, _, state, path, met = heapq.heappop(heap)
        if goal <= state:
            yield path
            continue
        for step in steps:
            after = step.apply(state)
            if step.applicable(state) and after not in met:
                estimate = len(path) + 1 + len(goal - after) / most
                heapq.heappush(heap, (estimate, next(order), after, (*path, step), met | {after}))


def first_that_works(domain: Domain, course: Course, max_expansions: int, budget: Budget) -> tuple[int | None, int]:
    """Length of the first plan that can be refined whole, None within the bound, and how many were tried."""
    scene, stand_in, tried = course.scene(), StandIn(course), 0
    for steps in plans(domain, scene, goal_facts(course.goal), max_expansions):
        tried += 1
        if _works(steps, scene, stand_in, budget):
            return len(steps), tried
    return None, tried


def _works(steps: tuple[Step, ...], scene: SceneState, stand_in: StandIn, budget: Budget) -> bool:
    rng = np.random.default_rng(0)
    for step in steps:
        outcome = stand_in.refine(step.action, scene, rng, budget, Hints())
        if isinstance(outcome, RefinementFailure):
            return False
        scene = stand_in.predict(scene, outcome)
    return True
