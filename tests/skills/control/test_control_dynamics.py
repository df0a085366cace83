import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from sim.robot import RobotModel
from skills.control.dynamics import Dynamics

AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
numbers = st.lists(st.floats(-2.5, 2.5), min_size=7, max_size=7).map(np.array)


@pytest.fixture(scope="module")
def loaded():
    """An arm that stands askew, with something in its hand."""
    robot = RobotModel(X_WB=SE3(pin.rpy.rpyToMatrix(0.1, -0.2, 0.7), np.array([0.3, -0.1, 0.5])))
    return robot.with_payload(0.8, np.array([0.01, 0.02, 0.05]), np.diag([1e-3, 2e-3, 3e-3]))


@settings(max_examples=50, derandomize=True, deadline=None)
@given(q=numbers, v=numbers)
def test_the_arms_state_is_what_pinocchio_makes_of_it(loaded, q, v):
    model, data, tool = loaded.model, loaded.data(), loaded.tcp_id
    state = Dynamics(loaded).state(q, v)
    np.testing.assert_allclose(state.M, pin.crba(model, data, q), atol=1e-12)
    np.testing.assert_allclose(state.bias, pin.nonLinearEffects(model, data, q, v), atol=1e-11)
    np.testing.assert_allclose(state.J, pin.computeFrameJacobian(model, data, q, tool, AXES), atol=1e-12)
    np.testing.assert_allclose(state.V, state.J @ v, atol=1e-12)
    pin.forwardKinematics(model, data, q, v, np.zeros(7))
    pose = pin.updateFramePlacement(model, data, tool)
    np.testing.assert_allclose(state.p, pose.translation, atol=1e-13)
    np.testing.assert_allclose(state.R, pose.rotation, atol=1e-13)
    drift = pin.getFrameClassicalAcceleration(model, data, tool, AXES).vector
    np.testing.assert_allclose(state.drift, drift, atol=1e-12)


@settings(max_examples=50, derandomize=True, deadline=None)
@given(q=numbers, v=numbers, a=numbers)
def test_a_target_is_where_pinocchio_sees_the_tool(loaded, q, v, a):
    model, data, tool = loaded.model, loaded.data(), loaded.tcp_id
    target = Dynamics(loaded).target(q, v, a)
    pin.forwardKinematics(model, data, q, v, a)
    pose = pin.updateFramePlacement(model, data, tool)
    np.testing.assert_allclose(target.p, pose.translation, atol=1e-13)
    np.testing.assert_allclose(target.R, pose.rotation, atol=1e-13)
    np.testing.assert_allclose(target.V, pin.getFrameVelocity(model, data, tool, AXES).vector, atol=1e-12)
    acceleration = pin.getFrameClassicalAcceleration(model, data, tool, AXES).vector
    np.testing.assert_allclose(target.A, acceleration, atol=1e-11)


@settings(max_examples=20, derandomize=True, deadline=None)
@given(q=numbers, wrench=st.lists(st.floats(-50.0, 50.0), min_size=6, max_size=6).map(np.array))
def test_a_wrench_and_its_torques_do_the_same_work(robot, q, wrench):
    state = Dynamics(robot).state(q, np.full(7, 0.3))
    assert state.torques_of(wrench) @ state.v == pytest.approx(wrench @ state.V, abs=1e-9)
