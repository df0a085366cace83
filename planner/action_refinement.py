"""Refines one action, with what is known of it: what worked or was blocked by something now away is tried first."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from planner.crash import crash_of
from planner.failure import Blocked, RefinementFailure
from planner.refinement import Budget, Hints, Refinement, Refiners, Work
from planner.task.learned import Learned
from planner.task.situation import Situation, Spot
from planner.task.symbols import GroundAction
from sim.scene import SceneState

Report = Callable[[str, Mapping[str, Any]], None]
"""Takes an event's kind and its data."""

MAX_WORKED = 4
"""Samples of an action that are kept because they worked, the latest first."""


class ActionRefiner:
    """Refines single actions and remembers what worked where."""

    def __init__(self, refiners: Refiners, learned: Learned, report: Report) -> None:
        self._refiners = refiners
        self._learned = learned
        self._report = report
        self._refined: dict[tuple[GroundAction, bytes], Refinement] = {}
        self._worked: dict[tuple[GroundAction, Spot], tuple[Any, ...]] = {}

    def begin(self) -> None:
        """Another plan is sought, from another observed scene. What worked is tried first again."""
        self._refined.clear()

    def refine(
        self,
        action: GroundAction,
        situation: Situation,
        rng: np.random.Generator,
        budget: Budget,
        work: Work,
        first: Collection[Any] = (),
        avoid: Collection[Any] = (),
    ) -> tuple[Refinement | RefinementFailure, tuple[Any, ...]]:
        """The action made concrete, or why not; and the samples that were to be tried first.

        `first` and `avoid` come on top of what was learned. Samples to be tried first count as tries;
        an action that failed often in the same place gets no others.
        """
        key = (action, _fingerprint(situation.scene))
        known = self._refined.get(key)
        if known is not None and known.sample not in avoid:
            return known, ()
        place = (action, situation.spot(action.args[0]))
        learned, is_fresh = self._learned.hints(action, situation)
        avoided = learned.avoid.union(avoid)
        # What failed when it was carried out (pressed too lightly, say) had worked when it was planned.
        worked = () if learned.failed else self._worked.get(place, ())
        wanted = dict.fromkeys((*first, *worked, *learned.first))
        hints = replace(learned, first=tuple(sample for sample in wanted if sample not in avoided), avoid=avoided)
        tries = len(hints.first) + (budget.tries if is_fresh else 0)
        work.add("refinements")
        outcome = self._outcome(action, situation.scene, rng, replace(budget, tries=max(1, tries)), hints)
        if outcome.crashes:
            crashes = list(dict.fromkeys(outcome.crashes))
            self._report("planner_crashed", {"action": str(action), "doing": "working out", "crashes": crashes})
        if isinstance(outcome, Refinement):
            self._refined[key] = outcome
            earlier = (sample for sample in self._worked.get(place, ()) if sample != outcome.sample)
            self._worked[place] = (outcome.sample, *earlier)[:MAX_WORKED]
        return outcome, hints.first

    def _outcome(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        try:
            return self._refiners[action.name].refine(action, scene, rng, budget, hints)
        except Exception as error:  # Whatever goes wrong in a planner, the arm is in the middle of something.
            reason = f"working it out crashed, {crash_of(error)}"
            return RefinementFailure(action, reason, (Blocked(None, reason),), crashes=(crash_of(error),))

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState | RefinementFailure:
        """The scene after the refined action went as meant, or that foreseeing it crashed."""
        action = refinement.action
        try:
            return self._refiners[action.name].predict(scene, refinement)
        except Exception as error:
            crash = crash_of(error)
            self._report("planner_crashed", {"action": str(action), "doing": "foreseeing", "crashes": [crash]})
            reason = f"foreseeing its outcome crashed, {crash}"
            return RefinementFailure(action, reason, (Blocked(refinement.sample, reason),), crashes=(crash,))


def _fingerprint(scene: SceneState) -> bytes:
    """Equal for scenes in which everything is at exactly the same place."""
    poses = b"".join(name.encode() + X.homogeneous.tobytes() for name, X in sorted(scene.poses.items()))
    held = scene.held.name.encode() + scene.held.X_GO.homogeneous.tobytes() if scene.held else b""
    return poses + held + scene.q.tobytes() + np.float64(scene.opening).tobytes()
