"""What is made of a motion planner's answer that is no motion: it isn't carried out, and the failure says why."""

from dataclasses import replace

import numpy as np
import pytest
from bench import Bench, action, scene_with

from planner.failure import RefinementFailure
from planner.motion.motion_planner import MotionPlanner
from planner.motion.trajectory import Trajectory
from planner.refinement import Refinement

PICK = action("pick(box, table)")


def bulging(found: Trajectory, joint: int, by: float) -> Trajectory:
    bulge = by * np.sin(np.pi * (found.times - found.times[0]) / found.duration)[:, None] ** 2
    q = found.q + bulge * np.eye(7)[joint]
    v = np.gradient(q, found.times, axis=0)
    v[[0, -1]] = 0.0
    return Trajectory(found.times, q, v).slowed(20.0)


def beyond_the_limits(found: Trajectory) -> Trajectory:
    return bulging(found, 6, 6.0)


def through_the_table(found: Trajectory) -> Trajectory:
    return bulging(found, 1, 1.2)


def through_the_table_between_two_knots(found: Trajectory) -> Trajectory:
    q = np.stack([found.start, found.start + 1e-3, found.end])
    v = np.zeros((3, 7))
    v[1, 1] = 1.4
    return Trajectory(np.array([0.0, 1.0, 8.0]), q, v)


def elsewhere(found: Trajectory) -> Trajectory:
    return replace(found, q=found.q + 0.01)


def to_no_goal(found: Trajectory) -> Trajectory:
    return Trajectory(found.times[:-5], found.q[:-5], found.v[:-5])


def too_fast(found: Trajectory) -> Trajectory:
    return found.slowed(0.1)


def not_finite(found: Trajectory) -> Trajectory:
    return replace(found, q=found.q * np.nan)


def nothing(found: Trajectory) -> None:
    return None


SPOILT = {
    beyond_the_limits: "passes a joint limit",
    through_the_table: "comes too near",
    through_the_table_between_two_knots: "comes too near",
    elsewhere: "does not begin where the arm is",
    to_no_goal: "does not end at a goal",
    too_fast: "faster than the joints",
    not_finite: "not finite",
    nothing: "of type NoneType",
}


def spoiling(method: str, spoil) -> type[MotionPlanner]:
    """A motion planner that spoils every motion it answers with."""

    def answer(self, *args, **kwargs):
        found = getattr(MotionPlanner, method)(self, *args, **kwargs)
        return spoil(found) if isinstance(found, Trajectory) else found

    return type("Spoiling", (MotionPlanner,), {method: answer})


def picked(kind: type[MotionPlanner]):
    bench = Bench(scene_with("box"), motion=kind)
    return bench, bench.refine(PICK)


@pytest.mark.parametrize(("spoil", "why"), SPOILT.items())
def test_a_move_that_is_no_motion_is_a_failure_that_says_so(spoil, why):
    _, found = picked(spoiling("move", spoil))
    assert isinstance(found, RefinementFailure)
    assert "the motion planner's answer is no motion" in found.reason
    assert why in found.reason


@pytest.mark.parametrize("spoil", SPOILT)
def test_nor_is_a_line_believed(spoil):
    _, found = picked(spoiling("timed_line", spoil))
    assert isinstance(found, RefinementFailure)
    assert "the motion planner's answer is no motion" in found.reason


def test_a_motion_of_another_planner_is_looked_at_and_taken():
    _, found = picked(spoiling("move", lambda motion: motion.slowed(1.5)))
    _, plain = picked(MotionPlanner)
    assert isinstance(found, Refinement)
    assert isinstance(plain, Refinement)
    assert found.sample == plain.sample


def test_what_was_just_confirmed_is_not_looked_at_again():
    bench, found = picked(MotionPlanner)
    other, again = picked(spoiling("move", lambda motion: replace(motion)))
    assert isinstance(found, Refinement)
    assert isinstance(again, Refinement)
    assert other.motion.work.counts["exact_checks"] > bench.motion.work.counts["exact_checks"]
