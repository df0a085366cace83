import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.motion.trajectory import Trajectory
from skills.control.dynamics import Dynamics
from skills.control.limits import FREE, AccelerationLimit, PositionLimit, VelocityLimit
from skills.control.reference import Reference
from skills.control.tasks import JointTask
from skills.control.torque_qp import TorqueQP

PERIOD = 0.002


class Moving:
    """The part of an arm's state that joint limits look at."""

    def __init__(self, q, v):
        self.q, self.v = q, v


class Together:
    """Limits that narrow one after the other."""

    def __init__(self, *limits):
        self._limits = limits

    def bounds(self, state):
        lower, upper = np.full(7, -FREE), np.full(7, FREE)
        for limit in self._limits:
            limit.narrow(state, lower, upper)
        return lower, upper


@pytest.fixture(scope="module")
def limits(robot):
    return Together(
        AccelerationLimit(10.0 * robot.a_max),
        VelocityLimit(robot.v_max, robot.a_max, PERIOD),
        PositionLimit(robot.q_min, robot.q_max, robot.a_max, PERIOD),
    )


def test_each_limit_bounds_what_it_is_about_and_nothing_else(robot):
    slow, fast = Moving(np.zeros(7), np.zeros(7)), Moving(np.zeros(7), 0.99 * robot.v_max)
    lower, upper = Together(AccelerationLimit(robot.a_max)).bounds(fast)
    np.testing.assert_array_equal(upper, robot.a_max)
    np.testing.assert_array_equal(lower, -robot.a_max)
    speed = Together(VelocityLimit(robot.v_max, robot.a_max, PERIOD))
    np.testing.assert_allclose(speed.bounds(slow)[1], robot.v_max / PERIOD)
    np.testing.assert_allclose(speed.bounds(fast)[1], 0.01 * robot.v_max / PERIOD)
    position = Together(PositionLimit(robot.q_min, robot.q_max, robot.a_max, PERIOD))
    near = Moving(robot.q_max - 1e-3, np.zeros(7))
    assert np.all(position.bounds(near)[1] < position.bounds(slow)[1])
    assert np.all(position.bounds(near)[0] < -robot.a_max)


@settings(max_examples=100, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10**6), beyond=st.floats(0.5, 1.5))
def test_bounds_never_contradict_each_other_even_beyond_the_limits(robot, limits, seed, beyond):
    rng = np.random.default_rng(seed)
    state = Moving(beyond * rng.uniform(robot.q_min, robot.q_max), beyond * rng.uniform(-robot.v_max, robot.v_max))
    lower, upper = limits.bounds(state)
    assert np.all(lower <= upper)
    assert np.all(lower <= robot.a_max)
    assert np.all(upper >= -robot.a_max)


@settings(max_examples=6, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_whatever_is_chosen_within_the_bounds_stays_within_the_limits(robot, limits, seed):
    rng = np.random.default_rng(seed)
    q, v = np.zeros(7), np.zeros(7)
    push = rng.choice([-1.0, 1.0], 7)
    for tick in range(2000):
        if tick % 400 == 0:
            push = rng.choice([-1.0, 1.0], 7) * rng.uniform(0.0, 30.0, 7)
        lower, upper = limits.bounds(Moving(q, v))
        a = np.clip(push, lower, upper)
        q, v = q + v * PERIOD + a * PERIOD**2 / 2, v + a * PERIOD
        assert np.all(np.abs(v) <= robot.v_max + 1e-9)
        assert np.all((q >= robot.q_min - 1e-6) & (q <= robot.q_max + 1e-6))


def test_a_joint_found_beyond_its_limit_is_led_back(robot, limits):
    q, v = robot.q_max + 0.1, np.zeros(7)
    for _ in range(1500):
        _, upper = limits.bounds(Moving(q, v))
        q, v = q + v * PERIOD, v + np.minimum(upper, 30.0) * PERIOD
    assert np.all(q < robot.q_max + 0.001)


def test_the_qp_stops_a_joint_that_is_sent_through_its_limit(robot):
    q, v, dynamics = np.zeros(7), np.zeros(7), Dynamics(robot)
    q[3] = -1.0
    qp = TorqueQP(robot, PERIOD)
    goal = q.copy()
    goal[3] = robot.q_min[3] - 0.5
    for _ in range(1200):
        solution = qp.solve(dynamics.state(q, v), [JointTask(goal, np.zeros(7), np.zeros(7))], np.zeros(7))
        q, v = q + v * PERIOD + solution.a * PERIOD**2 / 2, v + solution.a * PERIOD
    assert robot.q_min[3] - 1e-4 < q[3] < robot.q_min[3] + 0.01
    assert qp.fallbacks == 0


def test_the_arm_keeps_its_limits_when_a_reference_leads_through_them(lab):
    rig = lab.rig(np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 110.0, 0.0]))
    start = rig.q
    end = start + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.6, 0.0])
    # Twice as fast as joint 6 may be, to a place 0.4 rad beyond its limit.
    swing = Trajectory(np.array([0.0, 0.2]), np.stack([start, end]), np.zeros((2, 7)))
    rig.controller.follow(Reference(swing))
    seen = rig.run(0.6, lambda o: (o.q[5], abs(o.v[5])))
    assert max(q for q, _ in seen) < lab.robot.q_max[5] + 2e-3
    assert max(v for _, v in seen) < lab.robot.v_max[5] * 1.01
    assert rig.controller.torque_limit_violations == 0
