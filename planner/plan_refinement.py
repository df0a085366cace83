"""Makes a task plan concrete, action after action, before anything moves.

Where an action fails because of a pose or grasp that the plan itself chose earlier, the search goes
back to that choice, a bounded number of times, before the failure is held against the plan.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from planner.action_refinement import ActionRefiner, Report
from planner.failure import Blocked, RefinementFailure
from planner.refinement import Budget, Refinement, Work
from planner.task.facts import OBSERVED
from planner.task.situation import Situation
from planner.task.symbols import Fact, Step, TaskPlan, resume_at
from sim.scene import SceneState


@dataclass(frozen=True)
class Chosen:
    """A step made concrete: its place in the plan, what was chosen, and the situation before it."""

    position: int
    step: Step
    refinement: Refinement
    before: Situation


@dataclass(frozen=True)
class RefinedPlan:
    """The steps that are needed, what was chosen for each, and the scene predicted after each."""

    steps: tuple[Step, ...]
    refinements: tuple[Refinement, ...]
    scenes: tuple[SceneState, ...]


@dataclass(frozen=True)
class Stuck:
    """A step that can't be made concrete, where that is, and the samples that were to be tried first there."""

    position: int
    failure: RefinementFailure
    situation: Situation
    hinted: tuple[Any, ...]


@dataclass
class _Pending:
    """The deepest failure so far, the choices (depths) to go back to, the latest first, and those already revised."""

    depth: int
    stuck: Stuck
    targets: list[int]
    failures: list[RefinementFailure] = field(default_factory=list)
    revised: set[int] = field(default_factory=set)


class PlanRefiner:
    """Refines whole plans within a budget; `state` gives the facts that a scene alone decides."""

    def __init__(
        self, actions: ActionRefiner, state: Callable[[SceneState], frozenset[Fact]], backtracks: int, report: Report
    ) -> None:
        self._actions = actions
        self._state = state
        self._backtracks = backtracks
        self._report = report

    def refine(
        self, plan: TaskPlan, start: Situation, rng: np.random.Generator, budget: Budget, work: Work
    ) -> RefinedPlan | Stuck:
        """The plan made concrete from `start`, or the step at which that ended."""
        chosen: list[Chosen] = []
        avoid: dict[int, set[Any]] = {}
        situation, position = start, resume_at(plan, start.facts) or 0
        pending: _Pending | None = None
        left = self._backtracks
        while position < len(plan.steps):
            step, depth = plan.steps[position], len(chosen)
            outcome, hinted = self._actions.refine(
                step.action, situation, rng, budget, work, avoid=avoid.get(depth, ())
            )
            if isinstance(outcome, Refinement):
                seen = self._after(plan, position, situation, outcome)
                if isinstance(seen, RefinementFailure):
                    chosen.append(Chosen(position, step, outcome, situation))
                    failure = seen
                else:
                    after, resumed = seen
                    effects = _as_predicted(step, situation.facts, after.facts)
                    chosen.append(Chosen(position, effects, outcome, situation))
                    if resumed is not None:
                        self._report("refined", {"action": str(step.action)})
                        situation, position = after, resumed
                        continue
                    failure = _spoiled(outcome, step.adds - after.facts)
                targets = [depth]
            else:
                revised = pending.revised if pending is not None and pending.depth == depth else set[int]()
                failure, targets = outcome, _targets(outcome, situation, chosen, revised)
            self._report(
                "refinement_failed",
                {
                    "action": str(step.action),
                    "reason": failure.reason,
                    "culprits": sorted(set().union(*failure.culprit_sets)),
                    "attempts": len(failure.attempts),
                },
            )
            pending = _updated(pending, depth, Stuck(position, failure, situation, hinted), targets)
            if not pending.targets or left == 0:
                return replace(pending.stuck, failure=_merged(pending))
            left -= 1
            back = pending.targets[0]
            pending.revised.add(back)
            self._report("backtracked", {"action": str(step.action), "to": str(chosen[back].step.action)})
            avoid = {d: samples for d, samples in avoid.items() if d <= back}
            avoid.setdefault(back, set()).add(chosen[back].refinement.sample)
            situation, position = chosen[back].before, chosen[back].position
            del chosen[back:]
        scenes = (*(entry.before.scene for entry in chosen[1:]), situation.scene) if chosen else ()
        return RefinedPlan(
            tuple(entry.step for entry in chosen), tuple(entry.refinement for entry in chosen), tuple(scenes)
        )

    def _after(
        self, plan: TaskPlan, position: int, before: Situation, refinement: Refinement
    ) -> tuple[Situation, int | None] | RefinementFailure:
        """The situation after a step, and the step to go on with (None: the rest of the plan no longer applies)."""
        scene = self._actions.predict(before.scene, refinement)
        if isinstance(scene, RefinementFailure):
            return scene
        kept = {fact for fact in plan.steps[position].apply(before.facts) if fact.predicate not in OBSERVED}
        facts = frozenset(kept) | self._state(scene)
        return before.after(refinement.action, scene, facts), resume_at(plan, facts, position + 1)


def _as_predicted(step: Step, before: frozenset[Fact], after: frozenset[Fact]) -> Step:
    """The step with everything that the refined action is predicted to bring about: a stroke takes more than one crumb
    along, and the rest of the plan counts on it."""
    expected = step.apply(before)
    return replace(step, adds=step.adds | (after - expected), deletes=step.deletes | (expected - after))


def _spoiled(refinement: Refinement, missing: frozenset[Fact]) -> RefinementFailure:
    reason = "it would bring about something that stands against the rest of the plan"
    if missing:
        reason = f"it is not expected to bring about {', '.join(map(str, sorted(missing)))}"
    return RefinementFailure(refinement.action, reason, (Blocked(refinement.sample, reason),))


def _targets(
    failure: RefinementFailure, situation: Situation, chosen: list[Chosen], revised: Collection[int]
) -> list[int]:
    """Depths of the choices that the failure depends on, the latest first.

    They are those that brought the object and the culprits where they are; without culprits, the
    grasp on what the hand holds as well. With culprits, what brought the object there is revised once at most.
    """
    if failure.proof == "anywhere":
        return []
    culprits = frozenset().union(*failure.culprit_sets)
    bodies = {failure.action.args[0], *culprits}
    if not culprits and situation.held is not None:
        bodies.add(situation.held.body)
    movers = {situation.movers[body] for body in bodies if body in situation.movers}
    latest = {entry.step.action: depth for depth, entry in enumerate(chosen)}
    own = situation.movers.get(failure.action.args[0])
    if culprits and own is not None and latest[own] in revised:
        movers.discard(own)
    return sorted((latest[action] for action in movers), reverse=True)


def _updated(pending: _Pending | None, depth: int, stuck: Stuck, targets: list[int]) -> _Pending:
    """The pending failure after one more.

    One farther on replaces it. One at the same step adds to it. One before it only means that the
    choice gone back to, or the step between, has nothing else to offer.
    """
    if pending is None or depth > pending.depth:
        return _Pending(depth, stuck, targets, [stuck.failure])
    remaining = {target for target in pending.targets if target < depth}
    if depth < pending.depth:
        return replace(pending, targets=sorted(remaining.union({depth}.intersection(targets)), reverse=True))
    targets = sorted((remaining - pending.revised).union(targets), reverse=True)
    return replace(pending, stuck=stuck, targets=targets, failures=[*pending.failures, stuck.failure])


def _merged(pending: _Pending) -> RefinementFailure:
    """All failures at that step as one: of each sample the attempt that depends least on what the plan chose."""
    movers = pending.stuck.situation.movers

    def cost(attempt: Blocked) -> tuple[bool, int, int]:
        return not attempt.culprits, sum(name in movers for name in attempt.culprits), len(attempt.culprits)

    best: dict[Any, Blocked] = {}
    for failure in pending.failures:
        for attempt in failure.attempts:
            if attempt.sample not in best or cost(attempt) < cost(best[attempt.sample]):
                best[attempt.sample] = attempt
    return replace(pending.failures[-1], attempts=tuple(best.values()))
