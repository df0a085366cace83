"""Search-then-sample: a task plan, refined action by action; what fails is learned, and the search begins again.

Each round states what is believed and what was learned in PDDL, has the task planner find a plan and
refines it whole before anything moves. A round that fails adds a fact or makes one stronger. When
the task planner finds nothing more, budgets are widened and sampled facts retracted, a bounded
number of times; infeasible is only called what follows from proofs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Any, Literal

import numpy as np

from planner.action_refinement import ActionRefiner, Report
from planner.failure import ExecutionFailure, RefinementFailure, SceneChanged
from planner.plan_refinement import PlanRefiner, RefinedPlan, Stuck
from planner.refinement import Budget, Refinement, Refiners, Work
from planner.sharing import shared_out
from planner.task.compilation import with_constraints
from planner.task.facts import facts, objects_of, observed_facts, place_of, stated_in
from planner.task.given import Given
from planner.task.lacking import lacking
from planner.task.learned import Learned
from planner.task.pddl import Domain, Problem, write_domain, write_problem
from planner.task.planner import TaskPlanner
from planner.task.primitives import arities, with_away
from planner.task.sexpr import PddlError
from planner.task.situation import Situation
from planner.task.symbols import Fact, GroundAction, NoTaskPlan, Step, TaskPlan, flaw
from scenarios.names import known
from sim.scene import SceneState, is_on_floor

MAX_PROBES = 3
"""Further actions that are looked at, at most, when one like them was found obstructed."""

FORGIVEN = 3
"""How often a task planner that itself went wrong is asked again before budgets are widened for it."""


@dataclass(frozen=True)
class PlanSettings:
    """Bounds of planning, all counted, none in seconds.

    tries: samples for an action in a round. max_rounds: task plans that are refined. max_expansions:
    search nodes of one task plan. backtracks: choices revised in refining one task plan. widenings:
    how often the tries are doubled. search: how the task planner searches
    (`planner.task.pyperplan_.SEARCHES`).
    """

    tries: int = 20
    max_rounds: int = 20
    max_expansions: int = 10_000
    backtracks: int = 4
    widenings: int = 1
    search: str = "auto"


@dataclass(frozen=True)
class Solution:
    """A task plan with a refinement for each step, and the scene predicted after each."""

    plan: TaskPlan
    refinements: tuple[Refinement, ...]
    scenes: tuple[SceneState, ...]
    rounds: int


@dataclass(frozen=True)
class NoPlan:
    """No plan: "proven" that there is none, or none found within the "budget"; why, and what is in the way.

    attainable: those literals of the goal that hold, or that nothing learned keeps from being reached, each for itself.
    """

    verdict: Literal["proven", "budget"]
    reason: str
    culprits: frozenset[str]
    rounds: int
    attainable: frozenset[Fact] = frozenset()


class SearchThenSample:
    """Plans from scenes, and keeps what failures taught from one plan to the next.

    `refiners` are the primitives by name, `domain` the catalogue's domain or a hand-written one
    with its problem in `given`. Raises PddlError for a domain with actions that no refiner knows.
    """

    def __init__(
        self,
        task_planner: TaskPlanner,
        refiners: Refiners,
        domain: Domain,
        settings: PlanSettings,
        report: Report,
        given: Given | None = None,
    ) -> None:
        for name in arities(domain):
            if name not in refiners:
                raise PddlError(f"action {name!r} is no primitive, {known(name, refiners)}", domain.name)
        self.learned = Learned(domain)
        self._task_planner = task_planner
        self._domain = with_away(domain)
        self._given = given
        self._settings = settings
        self._report = report
        self._actions = ActionRefiner(refiners, self.learned, report)
        self._plans = PlanRefiner(self._actions, self._state, settings.backtracks, report)
        self._budget = Budget(settings.tries)
        self._samples: dict[GroundAction, tuple[Any, ...]] = {}
        self._stated: tuple[SceneState, frozenset[Fact]] | None = None

    def facts(self, scene: SceneState) -> frozenset[Fact]:
        """What holds in a scene as observed, in the predicates of the domain."""
        # At each tick the goal and the plan are judged by the same scene.
        if self._stated is None or self._stated[0] is not scene:
            self._stated = scene, self._facts(scene, self.learned)
        return self._stated[1]

    def plan(self, scene: SceneState, goal: frozenset[Fact], rng: np.random.Generator, work: Work) -> Solution | NoPlan:
        """A plan from the scene as observed, refined whole, or why there is none."""
        self._stated = None
        self.learned.begin(scene)
        self._actions.begin()
        try:
            outcome = self._rounds(scene, goal, rng, work)
            if isinstance(outcome, NoPlan):
                outcome = replace(outcome, attainable=self._attainable(scene, goal, work))
        finally:
            self.learned.forget_predicted()
        if isinstance(outcome, Solution):
            self._samples = {}
            for refinement in reversed(outcome.refinements):
                earlier = self._samples.get(refinement.action, ())
                self._samples[refinement.action] = (refinement.sample, *earlier)
            actions = [str(action) for action in outcome.plan.actions]
            self._report("solved", {"plan": actions, "rounds": outcome.rounds})
        return outcome

    def refine(
        self,
        action: GroundAction,
        scene: SceneState,
        rng: np.random.Generator,
        work: Work,
        rest: Sequence[GroundAction] = (),
    ) -> Refinement | RefinementFailure:
        """One action of the plan in force refined again in the scene as observed, the plan's samples first.

        Another sample than the plan's has to leave its object so that what `rest`, the actions that follow, does next
        with it can be done; where none of a few does, the first is taken. A failure is not learned from until it is
        handed to `learn`.
        """
        self._stated = None
        self.learned.observe(scene)
        situation, first = Situation.now(scene), self._samples.get(action, ())
        follower = next((later for later in rest if later.args[0] == action.args[0]), None)
        chosen: list[Refinement] = []
        for _ in range(self._settings.backtracks + 1):
            avoid = {earlier.sample for earlier in chosen}
            outcome = self._actions.refine(action, situation, rng, self._budget, work, first=first, avoid=avoid)[0]
            if isinstance(outcome, RefinementFailure):
                return chosen[0] if chosen else outcome
            if outcome.sample in first or follower is None or self._is_open(follower, situation, outcome, rng, work):
                return outcome
            chosen.append(outcome)
        return chosen[0]

    def learn(self, failure: RefinementFailure | ExecutionFailure, scene: SceneState) -> None:
        """Take in a failure met while acting; `scene` is as observed."""
        self._stated = None
        self.learned.observe(scene)
        situation = Situation.now(scene)
        if isinstance(failure, SceneChanged):
            return
        if isinstance(failure, ExecutionFailure):
            if self.learned.learn_execution(failure, scene):
                self._report_learned(failure.action, situation)
            return
        hinted = (*self._samples.get(failure.action, ()), *self.learned.hints(failure.action, situation)[0].first)
        self._take_in(failure, situation, hinted)

    def learn_success(self, refinement: Refinement) -> None:
        """Take in that an action was carried out as refined and came to its effect."""
        self._stated = None
        self.learned.learn_success(refinement.action, refinement.sample)

    def _is_open(
        self, follower: GroundAction, situation: Situation, earlier: Refinement, rng: np.random.Generator, work: Work
    ) -> bool:
        """Can an action be done where an earlier one is predicted to leave its object, at least with others away?"""
        scene = self._actions.predict(situation.scene, earlier)
        if isinstance(scene, RefinementFailure):
            return False
        after = situation.after(earlier.action, scene, situation.facts)
        outcome = self._actions.refine(follower, after, rng, self._budget, work)[0]
        return isinstance(outcome, Refinement) or any(outcome.culprit_sets)

    def _rounds(
        self, scene: SceneState, goal: frozenset[Fact], rng: np.random.Generator, work: Work
    ) -> Solution | NoPlan:
        settings = self._settings
        self._budget = Budget(settings.tries)
        widenings, forgiven = settings.widenings, FORGIVEN
        met: set[tuple[Any, ...]] = set()
        for number in range(1, settings.max_rounds + 1):
            problem, found = self._search(scene, goal, self.learned, work, number)
            stale = False
            if isinstance(found, TaskPlan):
                start = Situation.now(scene, problem.init)
                refined = self._plans.refine(found, start, rng, self._budget, work)
                if isinstance(refined, RefinedPlan):
                    plan = TaskPlan(tuple(map(self._without_constraints, refined.steps)), goal, found.expansions)
                    return Solution(plan, refined.refinements, refined.scenes, number)
                self._learn_from(refined, found.steps[refined.position + 1 :], rng, work)
                lesson = (found.actions, refined.position, self.learned.constraints().get(refined.failure.action))
                stale = lesson in met
                met.add(lesson)
            elif (proof := self._proof(scene, goal, found, work, number)) is not None:
                return proof
            if isinstance(found, NoTaskPlan) and found.failure and forgiven > 0:
                forgiven -= 1
                continue
            if isinstance(found, NoTaskPlan) or stale:
                if widenings == 0:
                    return self._exhausted(found, number)
                widenings -= 1
                self._widen()
                met.clear()
        return self._no_plan(f"no plan within {settings.max_rounds} rounds", settings.max_rounds)

    def _attainable(self, scene: SceneState, goal: frozenset[Fact], work: Work) -> frozenset[Fact]:
        known = self._facts(scene, self.learned)
        return frozenset(fact for fact in goal if fact in known or self._may_be_reached(scene, fact, work))

    def _may_be_reached(self, scene: SceneState, literal: Fact, work: Work) -> bool:
        domain, problem = self._posed(scene, frozenset({literal}), self.learned, 0)
        found = self._solved(write_domain(domain), write_problem(problem), problem)
        work.add("expansions", found.expansions)
        return isinstance(found, TaskPlan) or not found.exhausted

    def _search(
        self, scene: SceneState, goal: frozenset[Fact], learned: Learned, work: Work, number: int
    ) -> tuple[Problem, TaskPlan | NoTaskPlan]:
        """State what is believed, given what was learned, and let the task planner search."""
        domain, problem = self._posed(scene, goal, learned, number)
        texts = write_domain(domain), write_problem(problem)
        found = self._solved(*texts, problem)
        if isinstance(found, TaskPlan):
            found = shared_out(found, domain, problem)
        work.add("expansions", found.expansions)
        plan = [str(action) for action in found.actions] if isinstance(found, TaskPlan) else None
        failure = "" if isinstance(found, TaskPlan) else self._failure(found)
        event = {"round": number, "domain": texts[0], "problem": texts[1], "plan": plan, "failure": failure}
        kind = "round" if learned is self.learned else "proof_sought"
        self._report(kind, {**event, "expansions": found.expansions})
        return problem, found

    def _posed(self, scene: SceneState, goal: frozenset[Fact], learned: Learned, number: int) -> tuple[Domain, Problem]:
        """The planner's question in a scene, given what was learned."""
        objects = {n: kind for n, kind in self._objects(scene).items() if n not in self._domain.constants}
        stated = Problem(f"round-{number}", self._domain.name, objects, self._facts(scene, learned), goal)
        return with_constraints(self._domain, stated, learned.constraints())

    def _failure(self, found: NoTaskPlan) -> str:
        """Why it isn't known whether there is a plan; "" if there is none."""
        return found.failure or (
            "" if found.exhausted else f"no plan within {self._settings.max_expansions} expansions"
        )

    def _solved(self, domain: str, problem: str, stated: Problem) -> TaskPlan | NoTaskPlan:
        """What the task planner says, its own failure or a plan that doesn't work taken for finding none."""
        try:
            found = self._task_planner.solve(domain, problem, self._settings.max_expansions)
            if not isinstance(found, TaskPlan | NoTaskPlan):
                return NoTaskPlan(False, 0, f"it answered {found!r}")
            if not isinstance(found.expansions, Integral):
                return NoTaskPlan(False, 0, f"its expansions are {found.expansions!r}, expected a whole number")
            found = replace(found, expansions=int(found.expansions))
            wrong = flaw(found, stated.init, stated.goal) if isinstance(found, TaskPlan) else None
        except PddlError:
            raise
        except Exception as error:  # Whatever goes wrong in a planner, the arm is in the middle of something.
            return NoTaskPlan(False, 0, f"{type(error).__name__}: {error}")
        return found if wrong is None else NoTaskPlan(False, found.expansions, f"its plan does not work: {wrong}")

    def _learn_from(self, stuck: Stuck, rest: tuple[Step, ...], rng: np.random.Generator, work: Work) -> None:
        """Learn from the failure that ended a round, and look what else of the kind stands in the way.

        What obstructs one action often obstructs others like it: those of the plan's rest that could
        come now are tried too, so that one round tells of all of them.
        """
        self._take_in(stuck.failure, stuck.situation, stuck.hinted)
        if not stuck.failure.culprit_sets:
            return
        kin = [step.action for step in rest if step.action.name == stuck.failure.action.name]
        possible = {step.action for step in rest if step.applicable(stuck.situation.facts)}
        for action in [action for action in kin if action in possible][:MAX_PROBES]:
            outcome, hinted = self._actions.refine(action, stuck.situation, rng, self._budget, work)
            if isinstance(outcome, RefinementFailure):
                self._take_in(outcome, stuck.situation, hinted)

    def _take_in(self, failure: RefinementFailure, situation: Situation, hinted: tuple[Any, ...]) -> None:
        self.learned.learn(failure, situation, hinted, self._budget.tries)
        self._report_learned(failure.action, situation)

    def _report_learned(self, action: GroundAction, situation: Situation) -> None:
        self._report("learned", {"action": str(action), "sentence": self.learned.sentence(action, situation)})

    def _widen(self) -> None:
        self._budget = self._budget.widened()
        self.learned.retract(self._budget.tries)
        self._report("widened", {"tries": self._budget.tries})

    def _proof(
        self, scene: SceneState, goal: frozenset[Fact], found: NoTaskPlan, work: Work, number: int
    ) -> NoPlan | None:
        """That nothing can work, if the task planner finds nothing even without what was only sampled."""
        if not found.exhausted:
            return None
        proofs = self.learned.proofs()
        if self.learned:
            _, unhindered = self._search(scene, goal, proofs, work, number)
            if isinstance(unhindered, TaskPlan) or not unhindered.exhausted:
                return None
        missing = sorted(goal - self.facts(scene))
        concerned = {fact.args[0] for fact in missing if fact.args}
        concerned |= {name for name, body in scene.scenario.bodies.items() if body.tool}
        lost = sorted(name for name in concerned if self._is_lost(scene, name))
        reasons = [f"{name} lies neither on the table nor in a region" for name in lost] + proofs.sentences()
        reason = f"no sequence of actions leads to {', '.join(map(str, missing))}"
        reasons += lacking(self._domain, self.facts(scene), missing)
        if reasons:
            reason += f": {'; '.join(reasons)}"
        # What leans or is heaped up somewhere may yet fall to where it can be taken from.
        may_change = any(not is_on_floor(scene, name) for name in lost)
        return NoPlan("budget" if may_change else "proven", reason, proofs.culprits().union(lost), number)

    def _is_lost(self, scene: SceneState, name: str) -> bool:
        is_held = scene.held is not None and scene.held.name == name
        return name in scene.poses and not is_held and place_of(scene, name) is None

    def _exhausted(self, found: TaskPlan | NoTaskPlan, number: int) -> NoPlan:
        if isinstance(found, NoTaskPlan) and found.failure:
            return self._no_plan(f"the task planner failed ({found.failure})", number)
        if isinstance(found, NoTaskPlan) and not found.exhausted:
            return self._no_plan(f"no task plan within {self._settings.max_expansions} expansions", number)
        return self._no_plan("no plan found", number)

    def _no_plan(self, what: str, rounds: int) -> NoPlan:
        reason = f"{what}, with {self._budget.tries} samples for each action"
        sentences = self.learned.sentences()
        if sentences:
            reason += f": {'; '.join(sentences)}"
        return NoPlan("budget", reason, self.learned.culprits(), rounds)

    def _objects(self, scene: SceneState) -> Mapping[str, str]:
        if self._given is not None:
            return {**self._domain.constants, **self._given.problem.objects}
        return objects_of(scene)

    def _facts(self, scene: SceneState, learned: Learned) -> frozenset[Fact]:
        if self._given is not None:
            return self._given.facts(self._domain, scene, learned)
        return facts(scene, learned)

    def _state(self, scene: SceneState) -> frozenset[Fact]:
        return stated_in(self._domain, self._objects(scene), observed_facts(scene))

    def _without_constraints(self, step: Step) -> Step:
        """The step in the predicates of the domain alone: the others have no meaning outside the round."""

        def plain(literals: frozenset[Fact]) -> frozenset[Fact]:
            return frozenset(fact for fact in literals if fact.predicate in self._domain.predicates)

        return Step(step.action, plain(step.preconditions), plain(step.adds), plain(step.deletes))
