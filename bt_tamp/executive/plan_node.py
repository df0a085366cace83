"""The planner node: feeds back what failed, plans from what is observed now, and rebuilds `act`."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from bt_tamp.executive.agenda import Agenda
from bt_tamp.executive.rest import is_unsettled
from planner.failure import ExecutionFailure, RefinementFailure
from planner.refinement import Refinement, Work
from planner.search_then_sample import NoPlan, SearchThenSample, Solution
from planner.task.situation import Whereabouts, is_displaced, whereabouts
from planner.task.symbols import Fact, GroundAction
from sim.scene import SceneState
from skills.context import SkillContext

COST = {"checks": 5e-6, "exact_checks": 2e-5, "ik": 1e-4, "expansions": 1e-4}
"""Simulated seconds that one unit of planning work costs: the world does not stop while the robot thinks."""

PATIENCE = 2.0
"""Seconds for which planning waits, at most, until what falls or rolls has come to rest."""

SECOND_LOOK = 0.5
"""Seconds after which what was planned from must still be so, once the robot is at work, for no plan to be a verdict:
something may yet slip, or be grasped."""

LOST_PATIENCE = 15.0
"""Seconds for which the arm waits, when it can't go on, for what is nowhere to be seen to turn up again."""


@dataclass
class Thinking:
    """What planning has cost so far: CPU and wall seconds, rounds, replans."""

    work: Work
    cpu_s: float = 0.0
    wall_s: float = 0.0
    rounds: int = 0
    plans: int = 0
    verdict: NoPlan | None = None
    _started: tuple[float, float] = (0.0, 0.0)

    def __enter__(self) -> "Thinking":
        self._started = (time.process_time(), time.perf_counter())
        return self

    def __exit__(self, *_: object) -> None:
        cpu, wall = self._started
        self.cpu_s += time.process_time() - cpu
        self.wall_s += time.perf_counter() - wall

    def simulated_cost(self) -> float:
        """Simulated seconds that the work counted so far stands for."""
        return sum(COST.get(what, 0.0) * amount for what, amount in self.work.counts.items())


class Planner:
    """Search-then-sample with its random stream and its costs: what the planner node and `refine` share."""

    def __init__(self, search: SearchThenSample, seed: int, work: Work) -> None:
        self.search = search
        self.thinking = Thinking(work)
        self._rng = np.random.default_rng([seed, 7])

    def plan(self, scene: SceneState, agenda: Agenda) -> Solution | NoPlan:
        """A plan from the believed scene, refined whole, or why there is none."""
        with self.thinking as thinking:
            outcome = self.search.plan(scene, agenda.pursued(scene), self._rng, thinking.work)
        thinking.rounds += outcome.rounds
        thinking.plans += 1
        return outcome

    def refine(
        self, action: GroundAction, scene: SceneState, rest: Sequence[GroundAction] = ()
    ) -> tuple[Refinement | RefinementFailure, float]:
        """One action refined again in the scene as it is believed now, `rest` to follow, and the simulated seconds it
        costs."""
        with self.thinking as thinking:
            before = thinking.simulated_cost()
            outcome = self.search.refine(action, scene, self._rng, thinking.work, rest)
            return outcome, thinking.simulated_cost() - before


class PlanNode(Behaviour):
    """Plans once everything is at rest, lets the simulated time that this costs pass, then puts the plan in force.

    Fails when there is no plan; `planner.thinking.verdict` says why. Once the robot is at work it first does what there
    is a way to, and looks once more for a way to the rest then. While something is nowhere to be seen, it waits for
    that to turn up first.
    """

    def __init__(self, planner: Planner, agenda: Agenda, context: SkillContext) -> None:
        super().__init__("plan")
        self._planner, self._agenda, self._context = planner, agenda, context
        self._outcome: Solution | NoPlan | None = None
        self._since = self._settling_since = 0.0
        self._ready_at = 0.0
        self._why = "planned"
        self._waits_for: tuple[str, ...] = ()
        self._told_missing: tuple[str, ...] = ()
        self._scene = context.scene
        self._pursued: frozenset[Fact] = frozenset()
        self._put_off: set[frozenset[Fact]] = set()

    def initialise(self) -> None:
        self._outcome = None
        self._waits_for = self._told_missing = ()
        self._put_off = set()
        self._since = self._settling_since = self._context.observation.t

    def update(self) -> Status:
        context, thinking = self._context, self._planner.thinking
        if self._waits_for:
            missing = self._agenda.missing(context.scene)
            is_as_before = missing == self._waits_for and not self._has_changed(context.scene)
            if is_as_before and not self._is_out_of_patience():
                return Status.RUNNING
            if not is_as_before:
                self._outcome, self._waits_for = None, ()
                self._settling_since = context.observation.t
        if self._outcome is None:
            observation = context.observation
            if is_unsettled(observation) and observation.t - self._settling_since < PATIENCE:
                return Status.RUNNING
            self._take_in_failure()
            before = thinking.simulated_cost()
            self._scene, self._pursued = context.scene, self._agenda.pursued(context.scene)
            self._outcome = self._planner.plan(context.scene, self._agenda)
            self._ready_at = context.observation.t + thinking.simulated_cost() - before
        if context.observation.t < self._ready_at:
            return Status.RUNNING
        if isinstance(self._outcome, NoPlan):
            if self._has_changed(context.scene):
                self._outcome, self._settling_since = None, context.observation.t
                return Status.RUNNING
            if self._agenda.has_begun and context.observation.t < self._ready_at + SECOND_LOOK:
                return Status.RUNNING
            missing = self._agenda.missing(context.scene)
            if missing and not self._is_out_of_patience():
                self._waits_for = missing
                if missing != self._told_missing:
                    self._told_missing = missing
                    context.report("missing", bodies=list(missing))
                return Status.RUNNING
            if self._does_the_rest_first(self._outcome):
                self._outcome = None
                return Status.RUNNING
            if missing:
                self._outcome = nowhere_to_be_seen(missing, self._outcome)
            if self._agenda.has_put_off and self._outcome.attainable <= self._agenda.facts(context.scene):
                self._outcome = replace(self._outcome, reason=f"{self._outcome.reason}; the rest is done")
            thinking.verdict = self._outcome
            self.feedback_message = self._outcome.reason
            return Status.FAILURE
        solution = self._outcome
        context.report(
            "plan_installed",
            actions=[str(action) for action in solution.plan.actions],
            rounds=solution.rounds,
            cpu_s=thinking.cpu_s,
        )
        self._agenda.adopt(solution.plan, solution.refinements, context, self._why)
        self._why = "replanned"
        return Status.SUCCESS

    def _does_the_rest_first(self, outcome: NoPlan) -> bool:
        """Once the robot is at work: put off what there is no way to, if there may be one to the rest; and if there is
        none to the rest either, look for one to everything once more."""
        agenda, facts = self._agenda, self._agenda.facts(self._context.scene)
        if not agenda.has_begun:
            return False
        hopeless = self._pursued - outcome.attainable
        if hopeless and hopeless | agenda.put_off not in self._put_off and not outcome.attainable <= facts:
            agenda.put_off |= hopeless
            agenda.has_put_off = True
            self._put_off.add(agenda.put_off)
            self._context.report("put_off", goal=[str(fact) for fact in sorted(hopeless)], reason=outcome.reason)
            return True
        was_put_off, agenda.put_off = agenda.put_off, frozenset()
        return bool(was_put_off)

    def _has_changed(self, scene: SceneState) -> bool:
        """Is the scene, or what is wanted, no longer what was planned for? Then what was found says nothing."""
        if self._pursued != self._agenda.pursued(scene):
            return True
        before = self._scene
        return any(
            is_displaced(whereabouts(before, name), whereabouts(scene, name))
            for name in before.poses.keys() | scene.poses.keys()
        ) or any(
            is_displaced(Whereabouts(before.scenario.regions[name].X_WR, False), Whereabouts(region.X_WR, False))
            for name, region in scene.scenario.regions.items()
        )

    def _is_out_of_patience(self) -> bool:
        return self._context.observation.t - self._since > LOST_PATIENCE

    def _take_in_failure(self) -> None:
        context = self._context
        failure = context.failure
        reason = self._agenda.review(context)
        if isinstance(failure, (ExecutionFailure, RefinementFailure)):
            self._planner.search.learn(failure, context.scene)
        if failure is not None or self._agenda.plan is not None:
            context.report("replan", reason=reason)
        self._agenda.drop()
        context.failure = None


def nowhere_to_be_seen(missing: tuple[str, ...], outcome: NoPlan) -> NoPlan:
    """There is no plan, and this is missing: no proof, for it may turn up."""
    names = ", ".join(missing)
    reason = f"{names} {'is' if len(missing) == 1 else 'are'} nowhere to be seen; {outcome.reason}"
    return replace(outcome, verdict="budget", reason=reason, culprits=outcome.culprits.union(missing))
