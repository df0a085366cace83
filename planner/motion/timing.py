"""Timing of joint paths: as fast as the joints allow, or at a given speed of the hand."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from scipy.interpolate import BSpline, CubicSpline

from planner.motion.chain import tcp_path, tcp_speeds
from planner.motion.topp import fastest_rates
from planner.motion.trajectory import Trajectory
from sim.robot import RobotModel

CONTROL_SPACING = 0.3
"""Largest distance in rad between the control points of the curve that rounds a polyline's corners."""

SPEED = 0.9
"""Part of the joints' velocity and acceleration limits that is used."""

TCP_SPEED = 0.8
"""Part of the hand's limit of speed that free motions use: near it, the arm stops."""

TCP_ACCELERATION = 0.5
"""Default acceleration of the hand along lines, m/s²."""

_SAMPLE = 0.02
_SLOW = 1e-6
_GRID_STEP = 0.05
_GRID_SIZE = (20, 80)
_RADIUS = 0.25
"""Metres of way that a turn of the hand by one rad counts for."""

_CORNER = np.radians(10.0)
_PEAK = 1.875
"""Peak of the derivative of the smooth step 10u³ − 15u⁴ + 6u⁵."""


def time_path(robot: RobotModel, waypoints: np.ndarray, spacing: float = CONTROL_SPACING) -> Trajectory:
    """The fastest motion along a smooth curve close to the polyline (n,7), from rest to rest, at SPEED of the joints'
    limits, the hand at no more than TCP_SPEED of its own.

    The curve is a cubic B-spline with its control points on the polyline, at most `spacing` rad apart: it
    stays on straight stretches and cuts corners on the inside, by less than a third of the spacing.
    """
    curve, length = _rounded(waypoints, spacing)
    if length == 0.0:
        return Trajectory.standstill(waypoints[0])
    end = float(curve.t[-1])
    grid = np.linspace(0.0, end, int(np.clip(length / _GRID_STEP, *_GRID_SIZE)) + 1)
    d1 = curve(grid, 1)
    fastest = TCP_SPEED * robot.tcp_speed_max / np.maximum(tcp_speeds(robot, curve(grid), d1), _SLOW)
    rate = fastest_rates(grid, d1, curve(grid, 2), SPEED * robot.v_max, SPEED * robot.a_max, fastest)
    # The path's acceleration is constant between grid points and jumps there, so each gets a knot.
    durations = 2 * np.diff(grid) / (rate[1:] + rate[:-1])
    pieces = np.ceil(durations / _SAMPLE).astype(int)
    k = np.repeat(np.arange(len(pieces)), pieces)
    part = (np.arange(len(k)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) / pieces[k]
    since = part * durations[k]
    gain = (np.diff(rate) / durations)[k]
    s = np.append(grid[k] + since * (rate[k] + gain * since / 2), end)
    v = curve(s, 1) * np.append(rate[k] + gain * since, 0.0)[:, None]
    times = np.append((np.cumsum(durations) - durations)[k] + since, durations.sum())
    return slowed(Trajectory(times, curve(s), v), robot)


def time_path_with_stops(robot: RobotModel, waypoints: np.ndarray) -> Trajectory:
    """The fastest motion exactly along the polyline (n,7), coming to rest at every waypoint."""
    edges = [time_path(robot, np.stack(edge)) for edge in pairwise(waypoints)]
    return joined(edges) if edges else Trajectory.standstill(waypoints[0])


def time_line(
    robot: RobotModel, path: np.ndarray, tcp_speed: float, tcp_acceleration: float = TCP_ACCELERATION
) -> Trajectory:
    """Follow a joint path (n,7) of closely spaced configurations at a constant speed of the hand (m/s).

    Speed rises and falls along smooth steps, from rest to rest; where the hand changes direction by
    more than 10° it stops for a moment. Stretches in which a joint would pass SPEED of its limits go slower
    as a whole.
    """
    R, p = tcp_path(robot, path)
    pieces = [
        _timed_piece(robot, path[a : b + 1], _way(R[a : b + 1], p[a : b + 1]), tcp_speed, tcp_acceleration)
        for a, b in _straight_pieces(R, p)
    ]
    return joined(pieces) if pieces else Trajectory.standstill(path[0])


def joined(pieces: Sequence[Trajectory]) -> Trajectory:
    """Motions one after the other, each beginning where, and with the velocity with which, the one before ended."""
    times, start = [np.zeros(1)], 0.0
    for piece in pieces:
        times.append(piece.times[1:] - piece.times[0] + start)
        start += piece.duration
    q = np.concatenate([pieces[0].q[:1], *(piece.q[1:] for piece in pieces)])
    v = np.concatenate([pieces[0].v[:1], *(piece.v[1:] for piece in pieces)])
    return Trajectory(np.concatenate(times), q, v)


def slowed(trajectory: Trajectory, robot: RobotModel, part: float = 1.0) -> Trajectory:
    """The same motion, stretched in time as a whole if it passes `part` of the robot's limits anywhere."""
    rate = max(haste(trajectory, robot, part), 1.0)
    return Trajectory(trajectory.times * rate, trajectory.q.copy(), trajectory.v / rate)


def haste(trajectory: Trajectory, robot: RobotModel, part: float = 1.0) -> float:
    """How many times longer the motion would have to take to just keep within `part` of the robot's velocity and
    acceleration limits; 1 or less if it does."""
    velocity, acceleration = _peaks(trajectory)
    return max(float(np.max(velocity / robot.v_max)) / part, float(np.sqrt(np.max(acceleration / robot.a_max) / part)))


def _peaks(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Largest velocity and acceleration (7,) of the cubic pieces, in magnitude."""
    if len(trajectory.times) < 2:
        return np.zeros(7), np.zeros(7)
    h = np.diff(trajectory.times)[:, None]
    v0, v1 = trajectory.v[:-1], trajectory.v[1:]
    slope = np.diff(trajectory.q, axis=0) / h
    a0, a1 = (6 * slope - 4 * v0 - 2 * v1) / h, (2 * v0 + 4 * v1 - 6 * slope) / h
    # Inside a piece the velocity peaks where the acceleration, linear in time, crosses zero.
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.where(a0 * a1 < 0, a0 / (a0 - a1), 0.0)
    inner = v0 + h * u * (a0 + (a1 - a0) * u / 2)
    velocity = np.maximum(np.abs(trajectory.v).max(axis=0), np.abs(inner).max(axis=0))
    return velocity, np.maximum(np.abs(a0), np.abs(a1)).max(axis=0)


def _rounded(waypoints: np.ndarray, spacing: float) -> tuple[BSpline, float]:
    """Clamped cubic B-spline with control points along the polyline (n,7), and the polyline's length in rad."""
    points, length = [waypoints[0]], 0.0
    for start, end in pairwise(waypoints):
        edge = float(np.linalg.norm(end - start))
        if edge > 1e-6:
            # Three edges at least on every stretch, for a curve that is cubic all along.
            count = max(3, int(np.ceil(edge / spacing)))
            points += [start + (end - start) * k / count for k in range(1, count + 1)]
            length += edge
    inner = max(len(points) - 3, 1)
    knots = np.concatenate([np.zeros(3), np.arange(inner + 1), np.full(3, inner)]).astype(float)
    return BSpline(knots, np.array(points if length else points * 4), 3), length


def _twists(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Way of the hand from each pose to the next (n−1, 6): metres, and metres for its turn."""
    turn = R[1:] @ np.swapaxes(R[:-1], 1, 2)
    axis = np.stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], axis=1
    )
    return np.concatenate([np.diff(p, axis=0), _RADIUS / 2 * axis], axis=1)


def _way(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(_twists(R, p), axis=1))])


def _straight_pieces(R: np.ndarray, p: np.ndarray) -> Iterator[tuple[int, int]]:
    """First and last index of each stretch without corners; steps of no length belong to none."""
    twists = _twists(R, p)
    lengths = np.linalg.norm(twists, axis=1)
    start: int | None = None
    for k, length in enumerate(lengths):
        if length < 1e-7:
            if start is not None:
                yield start, k
            start = None
            continue
        if start is not None:
            before = twists[k - 1] / lengths[k - 1]
            if float(before @ twists[k]) < np.cos(_CORNER) * length:
                yield start, k
                start = k
        else:
            start = k
    if start is not None:
        yield start, len(lengths)


def _timed_piece(robot: RobotModel, path: np.ndarray, way: np.ndarray, speed: float, acceleration: float) -> Trajectory:
    spline = CubicSpline(way, path, bc_type="natural")
    length = float(way[-1])
    speed = min(speed, float(np.sqrt(length * acceleration / _PEAK)))
    ramp = _PEAK * speed / acceleration
    duration = length / speed + ramp
    times = np.linspace(0.0, duration, max(9, int(np.ceil(duration / _SAMPLE)) + 1))
    s, rate = _progress(times, length, speed, ramp, duration)
    trajectory = Trajectory(times, spline(s), spline(s, 1) * rate[:, None])
    return slowed(trajectory, robot, SPEED)


def _progress(
    times: np.ndarray, length: float, speed: float, ramp: float, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Way and its rate at each time: up a smooth step of speed, along, and down again."""

    def rise(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u = np.clip(t / ramp, 0.0, 1.0)
        rate = u**3 * (10 - 15 * u + 6 * u**2)
        way = ramp * u**4 * (2.5 - 3 * u + u**2) + np.maximum(t - ramp, 0.0)
        return speed * way, speed * rate

    up, rate_up = rise(times)
    down, rate_down = rise(duration - times)
    early = times < duration / 2
    return np.where(early, up, length - down), np.where(early, rate_up, rate_down)
