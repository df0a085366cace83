import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.motion.timing import joined
from planner.motion.trajectory import Trajectory
from skills.control.reference import Course, Reference

PERIOD = 0.002
A_MAX = np.array([6.0, 6.0, 8.0, 8.0, 10.0, 12.0, 12.0])
STAY = Trajectory.standstill(np.zeros(7), 1.0)


def walked(course, duration):
    seen = []
    for _ in range(round(duration / PERIOD)):
        seen.append(course.now())
        course.advance(PERIOD)
    return [np.array(part) for part in zip(*seen, strict=True)]


@settings(max_examples=25, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10**6), gap=st.floats(0.0, 0.3), slip=st.floats(0.0, 0.8))
def test_joining_a_trajectory_starts_where_the_arm_is_and_never_jumps(seed, gap, slip):
    rng = np.random.default_rng(seed)
    trajectory = Trajectory(np.array([0.0, 3.0]), np.stack([np.zeros(7), rng.uniform(-1, 1, 7)]), np.zeros((2, 7)))
    q0, v0 = gap * rng.uniform(-1, 1, 7), slip * rng.uniform(-1, 1, 7)
    course = Course.joined(trajectory, q0, v0, A_MAX)
    q, v, a = walked(course, 3.5)
    np.testing.assert_allclose(q[0], q0, atol=1e-6)
    np.testing.assert_allclose(v[0], v0, atol=1e-6)
    np.testing.assert_allclose(np.diff(q, axis=0) / PERIOD, (v[1:] + v[:-1]) / 2, atol=1e-3)
    assert np.all(np.abs(a) <= 2.5 * A_MAX)
    np.testing.assert_allclose(q[-1], trajectory.end, atol=1e-9)
    assert course.over


@settings(max_examples=25, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_stop_brakes_without_turning_back(seed):
    v0 = np.random.default_rng(seed).uniform(-1.5, 1.5, 7)
    _, v, a = walked(Course.stop(np.zeros(7), v0, A_MAX), 1.0)
    assert np.all(np.abs(a) <= A_MAX * 1.001)
    assert np.all(v * np.sign(v0) >= -1e-9)
    np.testing.assert_allclose(v[-1], 0.0, atol=1e-9)
    np.testing.assert_allclose(a[-1], 0.0, atol=1e-9)


def test_a_frozen_course_stays_where_it_was():
    course = Course(Trajectory(np.array([0.0, 1.0]), np.stack([np.zeros(7), np.ones(7)]), np.zeros((2, 7))))
    walked(course, 0.5)
    course.freeze()
    before = course.time
    q, v, _ = walked(course, 0.3)
    assert np.all(q == q[0])
    assert np.all(v == 0.0)
    assert course.time == before


@pytest.mark.parametrize(
    ("parts", "complaint"),
    [
        ({"mode": "magic"}, "control mode 'magic'"),
        ({"force": -1.0}, "-1.0 N"),
        ({"force": float("nan")}, "nan N"),
        ({"force": 3.0}, "position mode can't press with 3.0 N"),
        ({"mode": "hybrid"}, "needs a force above 0"),
        ({"mode": "impedance", "until_contact": True, "stiffness": np.ones(6)}, "needs a force above 0"),
        ({"mode": "hybrid", "force": 3.0, "then": STAY}, "hybrid mode can't pass into another trajectory"),
        ({"mode": "impedance"}, "six positive stiffnesses, got None"),
        ({"mode": "impedance", "stiffness": np.zeros(6)}, "six positive stiffnesses"),
        ({"mode": "impedance", "stiffness": np.ones(3)}, "six positive stiffnesses"),
    ],
)
def test_references_that_make_no_sense_are_refused(parts, complaint):
    with pytest.raises(ValueError, match=complaint):
        Reference(STAY, **parts)


def test_a_course_that_passes_into_another_goes_on_as_if_it_were_one():
    q = np.stack([np.zeros(7), np.full(7, 0.3), np.full(7, 0.5)])
    v = np.stack([np.zeros(7), np.full(7, 0.4), np.zeros(7)])
    first, second = Trajectory(np.array([0.0, 1.0]), q[:2], v[:2]), Trajectory(np.array([0.0, 0.8]), q[1:], v[1:])
    course = Course.joined(Reference(first, then=second).course, np.full(7, 0.05), np.zeros(7), A_MAX)
    seen = walked(course, 1.01)
    seen = [np.concatenate(parts) for parts in zip(seen, walked(course.passed(second, 1.0), 1.0), strict=True)]
    whole = Course.joined(joined([first, second]), np.full(7, 0.05), np.zeros(7), A_MAX)
    for part, same in zip(seen, walked(whole, 2.01), strict=True):
        np.testing.assert_allclose(part, same, atol=1e-9)
