"""Whom a sample's failure is held against: bodies without which it works, no more and no others."""

from planner.failure import MotionFailure, RefinementFailure
from planner.refinement import Budget, Hints
from planner.task.symbols import GroundAction
from scenarios.load import load_scenario
from sim.scene import SceneState
from skills.skill import refine_by_sampling

SCENE = SceneState.initial(load_scenario("fig1", 0), 0.1)
PICK = GroundAction("pick", ("book", "table"))


def named(*in_the_way, seen_at_once=9, hopeless=False, mistaken=()):
    """Culprits of the one sample that fails while any of `in_the_way` stands; `mistaken` are blamed without reason."""

    def attempt(sample, scene):
        there = [name for name in (*in_the_way, *mistaken) if name in scene.poses]
        if any(name in scene.poses for name in in_the_way) or (hopeless and not there):
            return MotionFailure("hit", frozenset(there[:seen_at_once]))
        return ()

    failure = refine_by_sampling(PICK, SCENE, [0], attempt, Budget(1), Hints())
    assert isinstance(failure, RefinementFailure)
    return failure.attempts[0].culprits


def test_what_the_sample_works_without_is_the_culprit():
    assert named("box") == {"box"}
    assert named("box", "tomato") == {"box", "tomato"}


def test_a_sample_that_fails_without_the_movables_too_has_no_culprits():
    assert named("box", hopeless=True) == frozenset()


def test_what_comes_to_light_only_behind_another_is_a_culprit_too():
    assert named("box", "tomato", seen_at_once=1) == {"box", "tomato"}


def test_what_may_stay_is_no_culprit():
    assert named("box", mistaken=("tomato",)) == {"box"}


def test_the_object_itself_is_no_culprit():
    assert named("book") == frozenset()
