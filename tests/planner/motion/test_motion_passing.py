import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.motion.passing import passing
from planner.motion.timing import haste, joined, time_path
from planner.motion.trajectory import Trajectory


@pytest.fixture(scope="module")
def motions(robot):
    """Two motions from rest to rest, the second from where the first ends."""

    def drawn(seed: int) -> tuple[Trajectory, Trajectory]:
        corners = np.random.default_rng(seed).uniform(-1.0, 1.0, (4, 7))
        return time_path(robot, corners[:3]), time_path(robot, corners[2:])

    return drawn


@settings(max_examples=20, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10**6), share=st.floats(0.05, 0.95))
def test_motions_that_pass_into_each_other_are_added_up(motions, seed, share):
    first, second = motions(seed)
    overlap = share * min(first.duration, second.duration)
    head, entry = passing(first, second, overlap)
    cut = first.duration - overlap
    assert head.duration + entry.duration == pytest.approx(first.duration + second.duration - overlap)
    for t in np.linspace(1e-6, cut - 1e-6, 40):
        np.testing.assert_allclose(head.at(t), first.at(t), atol=1e-6)
    # Accelerations jump at knots, so they are compared between them only.
    for t in np.linspace(1e-6, second.duration - 1e-6, 40):
        q, v, _ = entry.at(t)
        q1, v1, _ = first.at(cut + t)
        q2, v2, _ = second.at(t)
        np.testing.assert_allclose(q, q1 - first.end + q2, atol=1e-7)
        np.testing.assert_allclose(v, v1 + v2, atol=1e-5)


@settings(max_examples=20, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_second_goes_on_from_where_and_how_fast_the_first_is(motions, seed):
    first, second = motions(seed)
    head, entry = passing(first, second, 0.3 * min(first.duration, second.duration))
    assert head.ends_moving
    assert not entry.ends_moving
    np.testing.assert_allclose(head.q[-1], entry.q[0], atol=1e-9)
    np.testing.assert_allclose(head.v[-1], entry.v[0], atol=1e-9)
    np.testing.assert_allclose(entry.end, second.end, atol=1e-9)
    both = joined([head, entry])
    q = np.array([both.at(t)[0] for t in np.linspace(0.0, both.duration, 2000)])
    speed = np.linalg.norm(np.diff(q, axis=0), axis=1) * 1999 / both.duration
    assert np.abs(np.diff(speed)).max() < 0.2


def test_motions_can_overlap_no_longer_than_they_last(motions):
    first, second = motions(0)
    for overlap in (0.0, first.duration + 0.1):
        with pytest.raises(ValueError, match="can't overlap"):
            passing(first, second, overlap)


def test_haste_is_how_much_longer_a_motion_has_to_take(robot, motions):
    first, _ = motions(1)
    hasty = Trajectory(first.times / 3, first.q, 3 * first.v)
    rate = haste(hasty, robot)
    assert 2.0 < rate <= 3.0
    assert haste(hasty.slowed(rate), robot) == pytest.approx(1.0)
