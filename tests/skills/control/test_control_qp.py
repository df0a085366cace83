import numpy as np
import pytest
import qpsolvers
from hypothesis import given, settings
from hypothesis import strategies as st

from skills.control.dynamics import Dynamics
from skills.control.limits import ApproachLimit
from skills.control.osqp_ import Problem, Workspace
from skills.control.state import Target
from skills.control.tasks import HybridTask, JointTask, PostureTask
from skills.control.torque_qp import FALLBACK_DAMPING, SPARE_ROWS, TorqueQP

PERIOD = 0.002
NOTHING = np.zeros(7)


def random_problem(seed):
    """Positive definite P, and limits of which some are active."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(7, 7))
    R = rng.normal(size=(7, 7))
    width = rng.uniform(0.1, 3.0, 14)
    return Problem(root @ root.T + 0.1 * np.eye(7), 5.0 * rng.normal(size=7), R, -width, width)


def random_state(robot, rng):
    q = robot.q_min + (robot.q_max - robot.q_min) * rng.uniform(0.05, 0.95, 7)
    return Dynamics(robot).state(q, robot.v_max * rng.uniform(-0.9, 0.9, 7))


@pytest.fixture(scope="module")
def workspace():
    return Workspace(7, 7)


@settings(max_examples=60, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_optimum_is_that_of_another_solver(workspace, seed):
    P, g, R, lower, upper = problem = random_problem(seed)
    x, status = workspace.solve(problem)
    G, h = np.vstack([R, -R]), np.concatenate([upper[7:], -lower[7:]])
    reference = qpsolvers.solve_qp(P, g, G=G, h=h, lb=lower[:7], ub=upper[:7], solver="daqp")
    assert status == "solved"
    np.testing.assert_allclose(x, reference, atol=1e-4)


def test_the_persistent_workspace_answers_like_a_fresh_one(workspace):
    for seed in range(20):
        problem = random_problem(seed)
        np.testing.assert_allclose(workspace.solve(problem)[0], Workspace(7, 7).solve(problem)[0], atol=1e-5)


def test_bounds_that_cross_are_infeasible_instead_of_silently_ignored(workspace):
    problem = random_problem(0)
    problem.lower[3] = problem.upper[3] + 1.0
    assert workspace.solve(problem)[1] == "primal infeasible"


def test_a_problem_with_no_feasible_point_is_reported_and_forgotten(workspace):
    problem = random_problem(0)._replace(R=np.eye(7))
    problem.lower[7:] = problem.upper[7:] = 100.0
    assert workspace.solve(problem)[1] == "primal infeasible"
    assert workspace.solve(random_problem(1))[1] == "solved"


@pytest.mark.parametrize("part", ["P", "g", "R", "lower"])
def test_a_number_that_is_not_finite_is_reported_and_forgotten(workspace, part):
    problem = random_problem(0)
    getattr(problem, part).flat[2] = np.nan
    assert workspace.solve(problem)[1] == "problem not finite"
    assert workspace.solve(random_problem(1))[1] == "solved"


def test_too_few_iterations_are_reported():
    assert Workspace(7, 7, max_iter=1).solve(random_problem(3))[1] == "maximum iterations reached"


class Watched:
    """OSQP, and the joints' bounds of the problem it solved last."""

    def __init__(self):
        self._workspace = Workspace(7, 7 + SPARE_ROWS)

    def solve(self, problem):
        self.bounds = problem.lower[:7].copy(), problem.upper[:7].copy()
        return self._workspace.solve(problem)


@settings(max_examples=60, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10**6), demand=st.floats(0.01, 3.0))
def test_torques_and_accelerations_keep_their_limits_whatever_is_asked(robot, seed, demand):
    rng = np.random.default_rng(seed)
    state = random_state(robot, rng)
    target = Target(state.p + demand * rng.normal(size=3), state.R, np.zeros(6), np.zeros(6))
    goal = state.q + demand * rng.normal(size=7)
    tasks = [
        [JointTask(goal, NOTHING, NOTHING)],
        [HybridTask(target, np.eye(3)), PostureTask(goal, NOTHING, NOTHING)],
    ][seed % 2]
    solver = Watched()
    qp = TorqueQP(robot, PERIOD, solver=solver)
    solution = qp.solve(state, tasks, state.J.T @ (10.0 * rng.normal(size=6)))
    lower, upper = solver.bounds
    assert np.all(np.abs(solution.tau) <= robot.tau_max)
    assert np.all(lower <= upper)
    assert solution.status != "solved" or np.all((solution.a >= lower - 1e-2) & (solution.a <= upper + 1e-2))
    assert qp.torque_limit_violations == 0


def test_tasks_are_met_exactly_while_no_limit_is_near(robot):
    state = Dynamics(robot).state(np.radians([10.0, 30.0, 5.0, -80.0, 0.0, 60.0, 20.0]), NOTHING)
    target = Target(state.p, state.R, np.zeros(6), np.array([0.5, -1.0, 0.0, 2.0, 1.0, -1.0]))
    solution = TorqueQP(robot, PERIOD).solve(
        state, [HybridTask(target, np.eye(3)), PostureTask(state.q, NOTHING, NOTHING)], NOTHING
    )
    np.testing.assert_allclose(state.J @ solution.a, target.A, atol=1e-3)


def test_more_limits_than_there_are_rows_for_are_refused(robot):
    state = random_state(robot, np.random.default_rng(7))
    limit = ApproachLimit(np.array([0.0, 0.0, 1.0]), 0.05)
    qp = TorqueQP(robot, PERIOD)
    task = [JointTask(state.q, NOTHING, NOTHING)]
    assert qp.solve(state, task, NOTHING, [limit] * SPARE_ROWS).status == "solved"
    with pytest.raises(ValueError, match="3 limits besides the torques', expected 2 at most"):
        qp.solve(state, task, NOTHING, [limit] * (SPARE_ROWS + 1))


class FixedAnswer:
    """Stands where the OSQP workspace does and gives one answer, whatever the joints' bounds are."""

    def __init__(self, a, status):
        self._answer = a, status

    def solve(self, problem):
        self.bounds = problem.lower[:7].copy(), problem.upper[:7].copy()
        return self._answer


def test_a_solution_beyond_a_torque_limit_is_counted_not_hidden(robot):
    state = random_state(robot, np.random.default_rng(4))
    qp = TorqueQP(robot, PERIOD)
    qp._workspace = FixedAnswer(np.linalg.solve(state.M, 1.001 * robot.tau_max - state.bias), "solved")
    solution = qp.solve(state, [JointTask(state.q, NOTHING, NOTHING)], NOTHING)
    assert qp.torque_limit_violations == 1
    assert np.all(np.abs(solution.tau) > robot.tau_max)


@pytest.mark.parametrize(
    "status",
    [
        "solved inaccurate",
        "primal infeasible",
        "primal infeasible inaccurate",
        "dual infeasible",
        "dual infeasible inaccurate",
        "maximum iterations reached",
        "run time limit reached",
        "problem non convex",
        "interrupted",
        "unsolved",
        "problem not finite",
    ],
)
def test_every_status_but_solved_fades_into_braking_within_the_limits(robot, status):
    state = random_state(robot, np.random.default_rng(5))
    qp = TorqueQP(robot, PERIOD)
    before = qp.solve(state, [JointTask(state.q + 0.01, NOTHING, NOTHING)], NOTHING)
    solver = qp._workspace = FixedAnswer(np.full(7, np.nan), status)
    solutions = [qp.solve(state, [JointTask(state.q + 0.01, NOTHING, NOTHING)], NOTHING) for _ in range(60)]
    assert all(s.status == status and np.all(np.abs(s.tau) <= robot.tau_max) for s in solutions)
    assert qp.fallbacks == 60
    assert np.linalg.norm(solutions[0].a - before.a) < np.linalg.norm(solutions[-1].a - before.a)
    lower, upper = solver.bounds
    np.testing.assert_allclose(solutions[-1].a, np.clip(-FALLBACK_DAMPING * state.v, lower, upper), atol=1e-3)


def test_the_solver_is_used_again_after_a_fallback(robot):
    state = random_state(robot, np.random.default_rng(6))
    task = [JointTask(state.q, NOTHING, NOTHING)]
    qp = TorqueQP(robot, PERIOD)
    beyond_all_torques = np.full(7, 1e6)
    assert qp.solve(state, task, beyond_all_torques).status == "primal infeasible"
    assert qp.solve(state, task, NOTHING).status == "solved"
    assert qp.fallbacks == 1


def test_running_out_of_iterations_falls_back(robot):
    state = random_state(robot, np.random.default_rng(6))
    qp = TorqueQP(robot, PERIOD, max_iter=1)
    solution = qp.solve(state, [JointTask(state.q + 3.0, NOTHING, NOTHING)], NOTHING)
    assert solution.status == "maximum iterations reached"
    assert np.all(np.abs(solution.tau) <= robot.tau_max)
