"""Which bodies a failing sample is blamed on, and how much is tried to find that out."""

import pytest

from planner.failure import MotionFailure, RefinementFailure
from planner.refinement import Budget, Hints, Refinement
from planner.task.symbols import GroundAction
from scenarios.load import load_scenario
from sim.scene import SceneState
from skills.skill import Unfit, refine_by_sampling

PICK = GroundAction("pick", ("book", "table"))
SCENE = SceneState.initial(load_scenario("fig1"), 0.1)


class Trials:
    """Tries samples by asking which bodies still in the scene are in the way of each, and counts."""

    def __init__(self, in_the_way, refusal):
        self._in_the_way, self._refusal = in_the_way, refusal
        self.count = 0

    def __call__(self, sample, scene):
        self.count += 1
        hits = frozenset(self._in_the_way[sample]) & frozenset(scene.poses)
        return self._refusal("something is hit", hits) if hits else ()

    def refine(self):
        samples = list(self._in_the_way)
        return refine_by_sampling(PICK, SCENE, samples, self, Budget(tries=len(samples)), Hints())


def blamed(outcome):
    assert isinstance(outcome, RefinementFailure)
    return {attempt.sample: set(attempt.culprits) for attempt in outcome.attempts}


@pytest.mark.parametrize("refusal", [Unfit, MotionFailure])
def test_each_sample_is_blamed_on_what_it_hits(refusal):
    trials = Trials({0: {"box"}, 1: {"carrot"}}, refusal)
    assert blamed(trials.refine()) == {0: {"box"}, 1: {"carrot"}}


def test_what_needs_more_than_another_sample_is_not_looked_into():
    samples = {0: {"box"}, **{n: {"box", "carrot"} for n in range(1, 10)}}
    trials = Trials(samples, Unfit)
    assert blamed(trials.refine()) == samples
    assert trials.count == len(samples) + 1, "only the first one was tried again without the box"


@pytest.mark.parametrize("refusal", [Unfit, MotionFailure])
def test_what_hits_the_same_one_body_is_not_looked_into(refusal):
    trials = Trials({n: {"box"} for n in range(10)}, refusal)
    assert blamed(trials.refine()) == {n: {"box"} for n in range(10)}
    assert trials.count == 11


def test_of_what_a_motion_hits_only_those_count_without_which_there_is_one():
    class Misled(Trials):
        def __call__(self, sample, scene):
            outcome = super().__call__(sample, scene)
            return outcome if outcome == () else MotionFailure("it hits", frozenset({"box", "carrot"}))

    assert blamed(Misled({0: {"carrot"}}, MotionFailure).refine()) == {0: {"carrot"}}


def test_a_sample_with_nothing_in_its_way_is_taken():
    outcome = Trials({0: {"box"}, 1: set()}, Unfit).refine()
    assert isinstance(outcome, Refinement)
    assert outcome.sample == 1
