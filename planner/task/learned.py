"""What failures taught: which samples of an action were blocked, by what, and what must therefore move first.

A `Case` is one action while its object is at one spot. Each of its samples keeps its own set of
bodies (at their spots) that have to be away before it is worth another try; sets of different
samples are never pooled, and a sample that fails again although its set was away gets a larger one.
A case has failed when nothing that was tried worked; then the action needs one of the minimal sets
away, or its own object elsewhere. Facts about observed poses stand until a body they speak of is
seen displaced; facts about poses that the plan itself would bring about are dropped with the plan.
"""

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from planner.failure import ArmStopped, Blocked, ExecutionFailure, GraspSlipped, RefinementFailure
from planner.refinement import Hints
from planner.task.pddl import Domain
from planner.task.primitives import achievers_of_grasps, grasping
from planner.task.situation import Situation, Spot, Whereabouts, in_order, is_displaced, whereabouts
from planner.task.symbols import GroundAction
from sim.scene import SceneState

MAX_FRESH_FAILURES = 3
"""An action that failed so often at one spot gets no new samples until the budget is widened: its sets only grow."""

MAX_EXECUTION_FAILURES = 3
"""An action that failed so often in execution, its object lying at one spot, counts as failed."""

Needs = frozenset[Spot]
"""Spots that bodies have to leave."""

Options = frozenset[Needs]
"""Any one of these sets is enough; no set: nothing helps."""


@dataclass(frozen=True)
class Kept:
    """A sample that failed. `needs`: what has to be away before another try; None: no use.

    `context` is what the failure depended on besides: the spot of what the hand held.
    """

    reason: str
    needs: Needs | None
    context: frozenset[Spot] = frozenset()
    is_executed: bool = False

    @property
    def spots(self) -> frozenset[Spot]:
        return (self.needs or frozenset()) | self.context


@dataclass
class Case:
    """One action while its object is at one spot."""

    samples: dict[Any, Kept] = field(default_factory=dict)
    has_failed: bool = False
    failures: int = 0
    tries: int = 0
    reason: str = ""
    is_proof: bool = False

    def minimal(self) -> Options:
        """The minimal sets over all samples; empty when no sample is worth another try."""
        return minimal(kept.needs for kept in self.samples.values() if kept.needs)

    def ways_out(self, own: Spot) -> Options:
        """Any one of these sets has to leave its spots: the minimal sets, or else what the hand holds has to be held
        otherwise. own: the spot of the action's object."""
        held = {spot for kept in self.samples.values() for spot in kept.context if spot.left_by is None}
        return self.minimal() or frozenset(frozenset({spot}) for spot in held - {own})

    def forget(self, is_gone: Callable[[Spot], bool]) -> None:
        """Take such spots out of what the samples need.

        A sample that needs nothing any more is worth another try, and the case no longer failed;
        one that needs more than what is gone is still blocked by the rest.
        """
        reopened = False
        for sample, kept in list(self.samples.items()):
            rest = kept.needs and frozenset(spot for spot in kept.needs if not is_gone(spot))
            is_stale = any(map(is_gone, kept.context))
            if is_stale or (kept.needs and not rest):
                del self.samples[sample]
                reopened = reopened or not is_stale or not self.minimal()
            elif rest != kept.needs:
                self.samples[sample] = replace(kept, needs=rest)
        if reopened:
            self.has_failed, self.failures = False, 0


def minimal(sets: Iterable[Needs]) -> Options:
    """The sets of which no other one is a part."""
    distinct = set(sets)
    return frozenset(s for s in distinct if not any(other < s for other in distinct))


def _bodies(needs: Needs) -> list[str]:
    """The spots to be left, for people: by body, as observed and where the plan puts it."""
    observed = {spot.body for spot in needs if spot.left_by is None}
    texts = {name: name for name in sorted(observed)}
    for spot in in_order(needs):
        if spot.left_by is not None:
            even = "even " if spot.body in observed else ""
            texts[spot.body] = f"{texts.get(spot.body, spot.body)} ({even}where {spot.left_by} leaves it)"
    return list(texts.values())


class Learned:
    """What is known of actions' failures. `domain` says which primitives need a grasp."""

    def __init__(self, domain: Domain) -> None:
        self._domain = domain
        self._grasping = grasping(domain)
        self._cases: dict[tuple[GroundAction, Spot], Case] = {}
        self._never: dict[GroundAction, str] = {}
        self._executed: dict[tuple[str, str], list[tuple[Any, bool]]] = {}
        self._seen: dict[str, Whereabouts | None] = {}
        self._stood: dict[str, Whereabouts] = {}
        self._is_lenient = False
        self._forget_derived()

    def _forget_derived(self) -> None:
        """What is asked at every tick of the tree follows from the cases: it is worked out when it is asked for."""
        self._binding: frozenset[str] | None = None
        self._graspless: frozenset[str] | None = None

    def learn(self, failure: RefinementFailure, situation: Situation, hinted: Collection[Any], tries: int) -> None:
        """Take in that an action can't be refined in a situation, with a budget of so many tries.

        `hinted` are the samples that were to be tried first: those not among the attempts are spent too.
        """
        self._forget_derived()
        if failure.proof == "anywhere":
            self._never[failure.action] = failure.reason
            return
        own = situation.spot(failure.action.args[0])
        case = self._cases.setdefault((failure.action, own), Case())
        tried = {attempt.sample: self._kept(attempt, case, situation) for attempt in failure.attempts}
        missed = (Blocked(sample, failure.reason) for sample in hinted if sample not in tried)
        case.samples |= tried | {attempt.sample: self._kept(attempt, case, situation) for attempt in missed}
        case.has_failed = True
        case.failures += 1
        case.tries = max(case.tries, tries)
        case.reason = failure.reason
        case.is_proof = case.is_proof or (failure.proof == "here" and own.left_by is None)
        self._watch(situation, {own}.union(*(kept.spots for kept in case.samples.values())))

    def learn_execution(self, failure: ExecutionFailure, scene: SceneState) -> bool:
        """Take in that an action failed while running; `scene` is as observed, the object where the failure left it.

        Returns whether the action counts as failed there now.
        """
        self._forget_derived()
        situation = Situation.now(scene)
        own = situation.spot(failure.action.args[0])
        case = self._cases.setdefault((failure.action, own), Case())
        # An arm that was stopped says nothing about what it was doing, one that lost its tool nothing about pressing.
        has_lost_tool = isinstance(failure, GraspSlipped) and failure.action.name not in self._grasping
        if not isinstance(failure, ArmStopped) and not has_lost_tool:
            self._keep_executed(failure.action, failure.sample, False)
        context = self._context(situation) - {own}
        counts = not isinstance(failure, ArmStopped)
        case.samples[failure.sample] = Kept(failure.reason, None, context, is_executed=counts)
        case.reason = failure.reason
        self._watch(situation, {own} | context)
        if sum(kept.is_executed for kept in case.samples.values()) >= MAX_EXECUTION_FAILURES:
            case.has_failed = True
        return case.has_failed

    def learn_success(self, action: GroundAction, sample: Any) -> None:
        """Take in that an action was carried out with a sample and came to its effect."""
        self._keep_executed(action, sample, True)

    def _keep_executed(self, action: GroundAction, sample: Any, is_done: bool) -> None:
        if sample is not None:
            self._executed.setdefault((action.name, action.args[0]), []).append((sample, is_done))

    def hints(self, action: GroundAction, situation: Situation) -> tuple[Hints, bool]:
        """Samples to try first (what blocked them is away) and to avoid; and are new samples worth trying?"""
        executed = self._executed.get((action.name, action.args[0]), [])
        done = tuple(sample for sample, is_done in executed if is_done)
        failed = tuple(sample for sample, is_done in executed if not is_done)
        case = self._cases.get((action, situation.spot(action.args[0])))
        if case is None:
            return Hints(done=done, failed=failed), True
        first = [
            sample
            for sample, kept in case.samples.items()
            if kept.needs is not None and all(map(situation.is_away, kept.needs))
        ]
        avoid = frozenset(sample for sample in case.samples if sample not in first)
        return Hints(tuple(first), avoid, done, failed), case.failures < MAX_FRESH_FAILURES

    def constraints(self) -> dict[GroundAction, Options]:
        """What each failed action needs: one of the sets of spots left. An empty set of sets: it is out for good."""
        found: dict[GroundAction, Options] = {}
        for (action, own), case in self._cases.items():
            if case.has_failed and not self._is_grasp_fact(action, own):
                options = minimal({*case.ways_out(own), frozenset({own})}) if not case.is_proof else {frozenset({own})}
                known = found.get(action, frozenset({frozenset()}))
                found[action] = minimal(first | second for first in known for second in options)
        return {**found, **dict.fromkeys(self._never, frozenset())}

    def proofs(self) -> "Learned":
        """Only what was proven."""
        proven = Learned(self._domain)
        proven._cases = {key: case for key, case in self._cases.items() if case.is_proof}
        proven._never, proven._seen = self._never, self._seen
        proven._is_lenient = self._is_lenient
        return proven

    def __bool__(self) -> bool:
        return bool(self._never) or any(case.has_failed for case in self._cases.values())

    def ungraspable(self, scene: SceneState) -> frozenset[str]:
        """Bodies known to have no grasp as they lie."""
        if self._graspless is None:
            found = (own.body for action, own in self._failed() if self._is_grasp_fact(action, own))
            self._graspless = frozenset(found)
        return self._still_there(self._graspless, scene)

    def stuck(self, scene: SceneState) -> frozenset[str]:
        """Bodies that can't be taken up as they lie and must be moved otherwise first.

        Those that are merely surrounded are among them only once a budget was widened: what surrounds them goes first.
        """
        never = frozenset(action.args[0] for action in self._never if action.name in self._grasping)
        if not self._is_lenient:
            return self.ungraspable(scene) | never
        taken = {own.body for action, own in self._failed() if action.name in self._grasping and own.left_by is None}
        return self._still_there(taken, scene) | never

    def in_the_way(self, scene: SceneState) -> frozenset[str]:
        """Bodies that lie where they are known to be in the way."""
        if self._binding is None:
            spots = (spot for options in self.constraints().values() for needs in options for spot in needs)
            self._binding = frozenset(spot.body for spot in spots if spot.left_by is None)
        return self._still_there(self._binding, scene)

    def observe(self, scene: SceneState) -> frozenset[str]:
        """Void what was learned of bodies that lie elsewhere now, and of regions that stand elsewhere; returns the
        bodies' names."""
        self._look_at_regions(scene)
        moved = frozenset(name for name in self._seen if self._has_moved(name, scene))
        self._drop(lambda spot: spot.left_by is None and spot.body in moved)
        for name in moved:
            del self._seen[name]
        return moved

    def _look_at_regions(self, scene: SceneState) -> None:
        stand = {name: Whereabouts(region.X_WR, False) for name, region in scene.scenario.regions.items()}
        shifted = {name for name, now in stand.items() if is_displaced(self._stood.setdefault(name, now), now)}
        if not shifted:
            return
        self._stood |= {name: stand[name] for name in shifted}
        self._never = {action: why for action, why in self._never.items() if shifted.isdisjoint(action.args)}
        self._cases = {key: case for key, case in self._cases.items() if shifted.isdisjoint(key[0].args)}
        self._forget_derived()

    def begin(self, scene: SceneState) -> None:
        """Void what the scene contradicts, before another plan is sought with the budgets one begins with.

        What rests on samples still stands, and is open to a wider budget again: the arm may be elsewhere now.
        """
        self._is_lenient = False
        self.observe(scene)
        for case in self._cases.values():
            case.tries = 0

    def forget_predicted(self) -> None:
        """Drop what was learned of poses that only a plan would have brought about."""
        self._drop(lambda spot: spot.left_by is not None)

    def retract(self, tries: int) -> None:
        """Drop sampled facts established with fewer tries. Proofs stay; what failed in execution is still avoided, and
        an action that did so twice as often as it takes to count as failed is out as its object lies."""
        self._is_lenient = True
        self._forget_derived()
        for key, case in list(self._cases.items()):
            if not case.is_proof and case.tries < tries:
                executed = {sample: kept for sample, kept in case.samples.items() if kept.is_executed}
                is_out = len(executed) >= 2 * MAX_EXECUTION_FAILURES
                self._cases[key] = Case(executed, is_out, reason=case.reason)

    def culprits(self) -> frozenset[str]:
        """Bodies that are known to be in the way of something, or that can't be handled as they lie."""
        failed = ((own, case.minimal()) for (_, own), case in self._cases.items() if case.has_failed)
        spots = {spot for own, options in failed for needs in options or {frozenset({own})} for spot in needs}
        return frozenset(spot.body for spot in spots) | {action.args[0] for action in self._never}

    def sentences(self) -> list[str]:
        """What is known, for people."""
        said = [f"{action} is impossible: {reason}" for action, reason in self._never.items()]
        said += [self._sentence(action, own, case) for (action, own), case in self._cases.items() if case.has_failed]
        return said

    def sentence(self, action: GroundAction, situation: Situation) -> str:
        """What is known of one action in a situation, for people."""
        if action in self._never:
            return f"{action} is impossible: {self._never[action]}"
        own = situation.spot(action.args[0])
        return self._sentence(action, own, self._cases[action, own])

    def _kept(self, attempt: Blocked, case: Case, situation: Situation) -> Kept:
        """The sample's record after one more failed attempt.

        A new sample found blocked while other known obstacles are away is known to work without all of them only.
        """
        culprits = frozenset(situation.spot(name) for name in attempt.culprits)
        old = case.samples.get(attempt.sample)
        if not culprits or (old is not None and old.needs is None):
            return Kept(attempt.reason, None, self._context(situation), old is not None and old.is_executed)
        if old is not None:
            return Kept(attempt.reason, culprits | (old.needs or frozenset()))
        known = frozenset[Spot]().union(*(kept.needs for kept in case.samples.values() if kept.needs))
        return Kept(attempt.reason, culprits | {spot for spot in known if situation.is_away(spot)})

    def _context(self, situation: Situation) -> frozenset[Spot]:
        return frozenset({situation.held}) if situation.held is not None else frozenset()

    def _is_grasp_fact(self, action: GroundAction, own: Spot) -> bool:
        """Is the failure stated by `graspable` rather than by what has to be away?"""
        case = self._cases[action, own]
        return action.name in self._grasping and own.left_by is None and (case.is_proof or not case.minimal())

    def _failed(self) -> list[tuple[GroundAction, Spot]]:
        return [key for key, case in self._cases.items() if case.has_failed]

    def _still_there(self, names: Iterable[str], scene: SceneState) -> frozenset[str]:
        return frozenset(name for name in names if not self._has_moved(name, scene))

    def _has_moved(self, name: str, scene: SceneState) -> bool:
        return name in self._seen and is_displaced(self._seen[name], whereabouts(scene, name))

    def _watch(self, situation: Situation, spots: Iterable[Spot]) -> None:
        for spot in spots:
            if spot.left_by is None:
                self._seen.setdefault(spot.body, whereabouts(situation.observed, spot.body))

    def _drop(self, is_gone: Callable[[Spot], bool]) -> None:
        self._forget_derived()
        self._cases = {key: case for key, case in self._cases.items() if not is_gone(key[1])}
        for case in self._cases.values():
            case.forget(is_gone)

    def _sentence(self, action: GroundAction, own: Spot, case: Case) -> str:
        seen = self._seen.get(own.body)
        lies = "is held" if seen is not None and seen.is_held else "lies"
        place = f"as {own.body} {lies}" if own.left_by is None else f"with {own}"
        if case.is_proof:
            return f"{action} is impossible {place}: {case.reason}"
        options = sorted(case.minimal(), key=lambda needs: (len(needs), str(in_order(needs))))
        where = "" if own.left_by is None else f" {place}"
        if len(options) == 1:
            bodies = _bodies(options[0])
            return f"{' and '.join(bodies)} {'obstruct' if len(bodies) > 1 else 'obstructs'} {action}{where}"
        if options:
            texts = [" and ".join(_bodies(needs)) for needs in options]
            return f"{action} needs {' or '.join(texts)} out of the way{where}"
        if self._is_grasp_fact(action, own):
            first = " or ".join(achievers_of_grasps(self._domain))
            change = f"; {first} may change that" if first else ""
            return f"{own.body} cannot be grasped as it lies ({case.reason}){change}"
        return f"{action} doesn't work {place}: {case.reason}"
