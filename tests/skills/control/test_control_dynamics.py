from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from sim.robot import RobotModel
from skills.control.dynamics import Dynamics

STEP = 1e-5
STILL = np.zeros(7)
X_WB = SE3(pin.rpy.rpyToMatrix(0.1, -0.2, 0.7), np.array([0.3, -0.1, 0.5]))
LOAD = 0.8, np.array([0.01, 0.02, 0.05]), np.diag([1e-3, 2e-3, 3e-3])
GRAVITY = np.array([0.0, 0.0, -9.81])

numbers = st.lists(st.floats(-2.5, 2.5), min_size=7, max_size=7).map(np.array)
laws = settings(max_examples=30, derandomize=True, deadline=None)


@pytest.fixture(scope="module")
def empty() -> RobotModel:
    """An arm that stands askew."""
    return RobotModel(X_WB=X_WB)


@pytest.fixture(scope="module")
def loaded(empty) -> RobotModel:
    """The same with something in its hand."""
    return empty.with_payload(*LOAD)


def rate(value: Callable[[float], np.ndarray]) -> np.ndarray:
    """What changes with time, differentiated at time 0."""
    return (value(STEP) - value(-STEP)) / (2 * STEP)


def twist(pose: Callable[[float], tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """How fast position and rotation change at time 0, in W axes."""
    (p0, R0), (p1, R1) = pose(-STEP), pose(STEP)
    return np.concatenate([p1 - p0, pin.log3(R1 @ R0.T)]) / (2 * STEP)


@laws
@given(q=numbers)
def test_the_tool_is_where_the_arms_frames_lead(loaded, q):
    X_WG = loaded.X_WG(q)
    state = Dynamics(loaded).state(q, STILL)
    np.testing.assert_allclose(state.p, X_WG.translation, atol=1e-12)
    np.testing.assert_allclose(state.R, X_WG.rotation, atol=1e-12)


@laws
@given(q=numbers, v=numbers)
def test_the_velocity_is_how_fast_the_tools_pose_changes(loaded, q, v):
    dynamics = Dynamics(loaded)

    def pose(t):
        state = dynamics.state(q + v * t, v)
        return state.p, state.R

    state = dynamics.state(q, v)
    np.testing.assert_allclose(state.V, twist(pose), atol=1e-6)
    np.testing.assert_allclose(state.J @ v, state.V, atol=1e-12)


@laws
@given(q=numbers, v=numbers)
def test_the_drift_is_how_the_tool_accelerates_while_no_joint_does(loaded, q, v):
    dynamics = Dynamics(loaded)
    expected = rate(lambda t: dynamics.state(q + v * t, v).V)
    np.testing.assert_allclose(dynamics.state(q, v).drift, expected, atol=1e-5)


@laws
@given(q=numbers, v=numbers, a=numbers)
def test_inertia_and_bias_give_the_torques_that_the_motion_takes(loaded, q, v, a):
    state = Dynamics(loaded).state(q, v)
    torques = pin.rnea(loaded.model, loaded.data(), q, v, a)
    np.testing.assert_allclose(state.M @ a + state.bias, torques, atol=1e-9)


@laws
@given(q=numbers, v=numbers, a=numbers)
def test_what_the_torques_do_is_what_the_arm_gains_in_energy(loaded, q, v, a):
    data = loaded.data()
    state = Dynamics(loaded).state(q, v)

    def energy(t):
        return pin.computeMechanicalEnergy(loaded.model, data, q + v * t + a * t**2 / 2, v + a * t)

    power = (state.M @ a + state.bias) @ v
    assert power == pytest.approx(rate(energy), rel=1e-5, abs=1e-4)
    assert np.linalg.eigvalsh(state.M).min() > 0.0
    np.testing.assert_allclose(state.M, state.M.T, atol=1e-12)


@laws
@given(q=numbers, v=numbers, a=numbers)
def test_a_targets_velocity_and_acceleration_are_those_of_its_pose_along_the_joints_way(loaded, q, v, a):
    dynamics = Dynamics(loaded)

    def at(t):
        return dynamics.target(q + v * t + a * t**2 / 2, v + a * t, a)

    target = at(0.0)
    np.testing.assert_allclose(target.V, twist(lambda t: (at(t).p, at(t).R)), atol=1e-6)
    np.testing.assert_allclose(target.A, rate(lambda t: at(t).V), atol=1e-5)


@laws
@given(q=numbers, v=numbers, a=numbers)
def test_a_target_that_the_joints_are_at_is_where_the_tool_is(loaded, q, v, a):
    dynamics = Dynamics(loaded)
    state, target = dynamics.state(q, v), dynamics.target(q, v, a)
    for have, want in ((target.p, state.p), (target.R, state.R), (target.V, state.V)):
        np.testing.assert_allclose(have, want, atol=1e-12)
    np.testing.assert_allclose(target.A, state.J @ a + state.drift, atol=1e-9)


@laws
@given(q=numbers)
def test_a_load_adds_its_mass_at_its_centre_and_its_own_inertia_and_weighs_on_the_joints(empty, loaded, q):
    mass, com_G, inertia_G = LOAD
    before, after = Dynamics(empty).state(q, STILL), Dynamics(loaded).state(q, STILL)
    lever = before.R @ com_G
    J_centre = before.J[:3] - pin.skew(lever) @ before.J[3:]
    turning = before.J[3:].T @ before.R @ inertia_G @ before.R.T @ before.J[3:]
    np.testing.assert_allclose(after.M - before.M, mass * J_centre.T @ J_centre + turning, atol=1e-10)
    np.testing.assert_allclose(after.bias - before.bias, -mass * J_centre.T @ GRAVITY, atol=1e-10)


@laws
@given(q=numbers, wrench=st.lists(st.floats(-50.0, 50.0), min_size=6, max_size=6).map(np.array))
def test_a_wrench_and_its_torques_do_the_same_work(loaded, q, wrench):
    state = Dynamics(loaded).state(q, np.full(7, 0.3))
    assert state.torques_of(wrench) @ state.v == pytest.approx(wrench @ state.V, abs=1e-9)


def test_what_was_told_stays_as_it_was_when_the_next_is_asked(loaded):
    rng, dynamics = np.random.default_rng(0), Dynamics(loaded)
    q, v, a = rng.uniform(-1.0, 1.0, (3, 7))
    told = *dynamics.state(q, v), *dynamics.target(q, v, a)
    kept = [one.copy() for one in told]
    dynamics.state(-q, 2 * v)
    dynamics.target(-q, 2 * v, -a)
    for one, before in zip(told, kept, strict=True):
        np.testing.assert_array_equal(one, before)
