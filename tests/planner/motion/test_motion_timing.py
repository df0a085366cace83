from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.interpolate import CubicSpline

from planner.motion.chain import tcp_speeds
from planner.motion.lines import interpolate
from planner.motion.timing import SPEED, TCP_SPEED, joined, time_line, time_path, time_path_with_stops
from planner.motion.topp import fastest_rates
from planner.motion.trajectory import Trajectory
from sim.robot import RobotModel

START = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])


def _corners(seed: int, count: int = 4) -> np.ndarray:
    steps = np.random.default_rng(seed).normal(size=(count - 1, 7)) * 0.4
    return START + np.concatenate([np.zeros((1, 7)), np.cumsum(steps, axis=0)])


def _motion(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    samples = [trajectory.at(t) for t in np.linspace(1e-9, trajectory.duration - 1e-9, 1500)]
    q, v, a = (np.array(column) for column in zip(*samples, strict=True))
    return q, v, a


def _jacobian(robot: RobotModel, q: np.ndarray) -> np.ndarray:
    return pin.computeFrameJacobian(robot.model, robot.data(), q, robot.tcp_id, pin.LOCAL_WORLD_ALIGNED)[:3]


def _distance_to_polyline(q: np.ndarray, waypoints: np.ndarray) -> float:
    """Largest distance in rad of any configuration q (n,7) from the polyline."""
    starts, edges = waypoints[:-1], np.diff(waypoints, axis=0)
    along = np.einsum("nsj,sj->ns", q[:, None] - starts, edges) / (edges**2).sum(axis=1)
    nearest = starts + np.clip(along, 0.0, 1.0)[:, :, None] * edges
    return float(np.linalg.norm(q[:, None] - nearest, axis=2).min(axis=1).max())


@pytest.mark.parametrize("seed", range(6))
def test_a_timed_path_keeps_the_limits_and_uses_them(robot, seed):
    trajectory = time_path(robot, _corners(seed))
    _, v, a = _motion(trajectory)
    assert np.all(np.abs(v) <= robot.v_max * (1 + 1e-9))
    assert np.all(np.abs(a) <= robot.a_max * (1 + 1e-9))
    used = max(np.max(np.abs(v) / robot.v_max), np.max(np.abs(a) / robot.a_max))
    assert used > 0.8


@pytest.mark.parametrize("seed", range(6))
def test_the_hand_of_a_stretched_arm_keeps_below_its_own_limit(robot, seed):
    middle = np.array([0.0, 0.3, 0.0, -0.2, 0.0, 0.1, 0.0]) + np.random.default_rng(seed).normal(size=7) * 0.05
    swing = np.array([0.0, 1.6, 0.0, -1.6, 0.0, 1.6, 0.0])
    trajectory = time_path(robot, np.stack([middle - swing / 2, middle + swing / 2]))
    speeds = [np.linalg.norm(_jacobian(robot, at) @ rate) for at, rate, _ in zip(*_motion(trajectory), strict=True)]
    assert max(speeds) == pytest.approx(TCP_SPEED * robot.tcp_speed_max, rel=0.02)


def test_the_hand_s_speeds_are_those_of_pinocchio_s_jacobian(robot):
    rng = np.random.default_rng(0)
    q, v = rng.uniform(robot.q_min, robot.q_max, (20, 7)), rng.normal(size=(20, 7))
    expected = [np.linalg.norm(_jacobian(robot, at) @ rate) for at, rate in zip(q, v, strict=True)]
    assert np.allclose(tcp_speeds(robot, q, v), expected)


def test_a_timed_path_starts_and_ends_at_rest_at_its_ends(robot):
    waypoints = _corners(0)
    trajectory = time_path(robot, waypoints)
    assert np.allclose(trajectory.start, waypoints[0])
    assert np.allclose(trajectory.end, waypoints[-1])
    assert not trajectory.v[0].any()
    assert not trajectory.v[-1].any()


def test_a_straight_path_stays_straight(robot):
    waypoints = _corners(1, 2)
    q, _, _ = _motion(time_path(robot, waypoints))
    assert _distance_to_polyline(q, waypoints) < 1e-9


def test_closer_control_points_keep_closer_to_the_corners_and_stops_keep_to_them(robot):
    waypoints = _corners(2)
    wide, close = (_distance_to_polyline(_motion(time_path(robot, waypoints, s))[0], waypoints) for s in (0.3, 0.1))
    stopping = time_path_with_stops(robot, waypoints)
    assert close < wide < 0.1
    assert _distance_to_polyline(_motion(stopping)[0], waypoints) < 1e-9
    assert stopping.duration > time_path(robot, waypoints).duration


def test_a_path_without_length_stands_still(robot):
    assert time_path(robot, np.stack([START, START])).duration == 0.0
    assert time_path_with_stops(robot, np.stack([START, START])).duration == 0.0
    assert time_line(robot, np.stack([START, START]), 0.1).duration == 0.0


def test_the_rates_are_those_that_toppra_finds(robot):
    toppra = pytest.importorskip("toppra")
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    limits = [
        JointVelocityConstraint(np.stack([-robot.v_max, robot.v_max], axis=1)),
        JointAccelerationConstraint(np.stack([-robot.a_max, robot.a_max], axis=1)),
    ]
    for seed in range(5):
        knots = np.concatenate([np.linspace(a, b, 5)[:-1] for a, b in pairwise(_corners(seed))])
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
        spline = CubicSpline(way, knots, bc_type="natural")
        grid = np.linspace(0.0, way[-1], 61)
        path = toppra.SplineInterpolator(way, knots, bc_type="natural")
        _, expected, _ = TOPPRA(limits, path, gridpoints=grid, solver_wrapper="seidel").compute_parameterization(0, 0)
        rates = fastest_rates(grid, spline(grid, 1), spline(grid, 2), robot.v_max, robot.a_max, np.full(61, np.inf))
        assert np.allclose(rates, expected, atol=2e-3)
        ours, theirs = (float(np.sum(2 * np.diff(grid) / (r[1:] + r[:-1]))) for r in (rates, expected))
        assert ours / theirs == pytest.approx(1.0, abs=1e-3)


def test_a_timed_path_is_as_fast_as_toppra_makes_the_same_curve(robot):
    toppra = pytest.importorskip("toppra")
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    v_max, a_max = SPEED * robot.v_max, SPEED * robot.a_max
    limits = [
        JointVelocityConstraint(np.stack([-v_max, v_max], axis=1)),
        JointAccelerationConstraint(np.stack([-a_max, a_max], axis=1)),
    ]
    for seed in range(5):
        ours = time_path(robot, _corners(seed))
        # The motion's own points, closely spaced, are the curve to be timed.
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ours.q, axis=0), axis=1))])
        kept = np.append(np.diff(way, prepend=-1.0)[:-1] > 1e-4, True)
        path = toppra.SplineInterpolator(way[kept], ours.q[kept])
        theirs = TOPPRA(limits, path, gridpoints=np.linspace(0.0, way[-1], 201), solver_wrapper="seidel")
        assert ours.duration < 1.05 * theirs.compute_trajectory(0, 0).duration


@pytest.fixture(scope="module")
def stroke(robot, down) -> np.ndarray:
    from planner.motion.motion_planner import MotionPlanner

    return MotionPlanner(robot).lines([down(0.6, 0.15, 0.1, 90), down(0.6, -0.15, 0.1, 90)])[0]


def test_a_line_is_followed_at_the_asked_speed_of_the_hand(robot, stroke):
    trajectory = time_line(robot, stroke, 0.1, 0.5)
    times = np.linspace(0.0, trajectory.duration, int(trajectory.duration / 0.02))
    positions = np.array([robot.X_WG(trajectory.at(t)[0]).translation for t in times])
    assert np.abs(positions[:, 0] - 0.6).max() < 1e-4
    assert np.abs(positions[:, 2] - 0.1).max() < 1e-4
    step = trajectory.duration / (len(positions) - 1)
    speed = np.linalg.norm(np.diff(positions, axis=0), axis=1) / step
    steady = speed[len(speed) // 4 : -len(speed) // 4]
    assert np.allclose(steady, 0.1, rtol=0.01)
    assert trajectory.duration == pytest.approx(0.3 / 0.1 + 1.875 * 0.1 / 0.5, rel=1e-3)


def test_the_hand_s_speed_rises_without_a_jump_of_acceleration(robot, stroke):
    trajectory = time_line(robot, stroke, 0.1, 0.5)
    accelerations = np.array([trajectory.at(t)[2] for t in np.arange(0.001, trajectory.duration, 0.002)])
    assert np.abs(np.diff(accelerations, axis=0)).max() < 0.2
    assert np.abs(accelerations[0]).max() < 0.05


def test_a_line_asked_for_too_fast_is_slowed_to_the_joints_limits(robot, stroke):
    trajectory = time_line(robot, stroke, 5.0, 50.0)
    _, v, a = _motion(trajectory)
    assert np.all(np.abs(v) <= SPEED * robot.v_max * (1 + 1e-9))
    assert np.all(np.abs(a) <= SPEED * robot.a_max * (1 + 1e-9))


def test_the_hand_stops_where_a_line_has_a_corner_or_turns_back(robot, down):
    from planner.motion.motion_planner import MotionPlanner

    waypoints = [down(0.6, 0.1, 0.2), down(0.6, 0.1, 0.1), down(0.6, 0.1, 0.12), down(0.6, -0.1, 0.12)]
    corners = interpolate(waypoints).corners
    path = MotionPlanner(robot).lines(waypoints)[0]
    trajectory = time_line(robot, path, 0.1)
    for corner in corners[1:-1]:
        k = int(np.argmin(np.linalg.norm(trajectory.q - path[corner], axis=1)))
        assert np.allclose(trajectory.q[k], path[corner], atol=1e-9)
        assert np.allclose(trajectory.v[k], 0.0, atol=1e-9)


def test_joined_motions_follow_one_another(robot):
    first, second = time_path(robot, _corners(3, 2)), time_path(robot, _corners(3, 3)[1:])
    both = joined([first, second])
    assert both.duration == pytest.approx(first.duration + second.duration)
    assert np.allclose(both.at(first.duration)[0], first.end)
    assert np.allclose(both.end, second.end)
