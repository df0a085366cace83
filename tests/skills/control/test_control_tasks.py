import numpy as np
import pinocchio as pin
from hypothesis import given, settings
from hypothesis import strategies as st

from skills.control.dynamics import Dynamics
from skills.control.state import Target
from skills.control.tasks import PoseTask, PostureTask, pose_error

STILL = np.zeros(7)
angles = st.lists(st.floats(-1.5, 1.5), min_size=7, max_size=7).map(np.array)


def state_at(robot, q, v=STILL):
    return Dynamics(robot).state(q, v)


@settings(max_examples=50, derandomize=True, deadline=None)
@given(turn=st.lists(st.floats(-1.8, 1.8), min_size=3, max_size=3).map(np.array))
def test_the_pose_error_is_the_rotation_that_leads_to_the_target(robot, turn):
    state = state_at(robot, np.full(7, 0.3))
    shift = np.array([0.1, -0.2, 0.3])
    target = Target(state.p + shift, pin.exp3(turn) @ state.R, np.zeros(6), np.zeros(6))
    error = pose_error(target, state)
    np.testing.assert_allclose(error[:3], shift, atol=1e-12)
    np.testing.assert_allclose(pin.exp3(error[3:]) @ state.R, target.R, atol=1e-9)
    assert np.linalg.norm(error[3:]) <= np.pi + 1e-9


@settings(max_examples=50, derandomize=True, deadline=None)
@given(q=angles)
def test_a_force_at_the_tool_does_no_work_on_the_posture(robot, q):
    state = state_at(robot, q)
    row = PostureTask(q, STILL, STILL).rows(state).A[0]
    answer = np.linalg.solve(state.M, state.J.T)
    assert np.linalg.norm(row) > 0.99 or np.linalg.svd(state.J)[1].min() < 0.01
    assert np.abs(row @ answer).max() < 1e-8 * np.abs(answer).max()


@settings(max_examples=30, derandomize=True, deadline=None)
@given(q=angles)
def test_the_impedance_spring_answers_with_stiffness_through_the_tools_inertia(robot, q):
    state = state_at(robot, q)
    stiffness = np.array([1000.0, 800.0, 500.0, 50.0, 40.0, 30.0])
    error = np.array([0.01, -0.02, 0.03, 0.0, 0.0, 0.0])
    target = Target(state.p + error[:3], state.R, np.zeros(6), np.zeros(6))
    rows = PoseTask(target, stiffness, 0.002).rows(state)
    np.testing.assert_allclose(rows.b, state.mobility @ (stiffness * error), atol=1e-8 * np.abs(rows.b).max())


@settings(max_examples=20, derandomize=True, deadline=None)
@given(bend=angles)
def test_every_mode_of_the_sampled_impedance_is_critically_damped(lab, bend):
    """Linearised, sampled and held, the loop has real poles only, in equal pairs."""
    state, period = state_at(lab.robot, lab.home + 0.3 * bend), 0.002
    target = Target(state.p, state.R, np.zeros(6), np.zeros(6))

    def answer(**moved):
        return PoseTask(target, lab.stiffness, period).rows(state._replace(drift=np.zeros(6), **moved)).b

    small, eye = 1e-6, np.eye(6)
    shifts = [answer(p=state.p + small * e) / small for e in np.eye(3)]
    turns = [answer(R=pin.exp3(small * e) @ state.R) / small for e in np.eye(3)]
    damper = np.array([answer(V=e) for e in eye]).T
    feedback = np.hstack([np.array(shifts + turns).T, damper])
    free = np.block([[eye, period * eye], [0 * eye, eye]])
    held = np.vstack([period**2 / 2 * eye, period * eye])
    poles = np.sort_complex(np.linalg.eigvals(free + held @ feedback))
    # A double pole splits by the square root of what rounding does to it.
    assert np.abs(poles.imag).max() < 2e-3
    assert np.abs(poles[0::2].real - poles[1::2].real).max() < 2e-3
    assert np.all((poles.real > 0.0) & (poles.real < 1.0))


def test_a_damping_ratio_scales_what_answers_velocity_and_nothing_else(lab):
    state = state_at(lab.robot, lab.home)
    target = Target(state.p + 0.01, state.R, np.zeros(6), np.zeros(6))

    def answer(ratio, V):
        return PoseTask(target, lab.stiffness, 0.002, ratio).rows(state._replace(V=np.full(6, V))).b

    still = answer(1.0, 0.0)
    np.testing.assert_allclose(answer(2.0, 0.0), still)
    np.testing.assert_allclose(answer(2.0, 0.1) - still, 2.0 * (answer(1.0, 0.1) - still), rtol=1e-9)


def test_the_target_moves_as_the_joints_make_it_move(robot):
    rng = np.random.default_rng(2)
    q, v, a = rng.uniform(-1.0, 1.0, (3, 7))
    dynamics, h = Dynamics(robot), 1e-5
    now = dynamics.target(q, v, a)
    soon = dynamics.target(q + h * v + h * h / 2 * a, v + h * a, a)
    np.testing.assert_allclose((soon.p - now.p) / h, now.V[:3], atol=1e-4)
    np.testing.assert_allclose(pin.log3(soon.R @ now.R.T) / h, now.V[3:], atol=1e-4)
    np.testing.assert_allclose((soon.V - now.V) / h, now.A, atol=1e-3)
