"""What the arm does when it is pushed: it bears the push as soon as that is felt, instead of giving way to it.

A position law gives way by force over gain and mass, centimetres where the hand is light. What is felt can be borne
instead, but it must be a push: to bear what the arm has run into is to press against it ever harder. The two differ in
the work they do on the arm. A thing that is run into gives back at most what it took (it is passive); whoever pushes
does work. So nothing is borne before the work done since it came up is positive, and then only along the line along
which it came up: what the arm is driven against is no part of it.

The hand's part comes from the wrist sensor, without delay; that of the links from the momentum observer.
"""

import math

import numpy as np
from numba import njit

from sim.robot import RobotModel
from skills.control.state import ArmState

FORCE = (15.0, 30.0)
"""Newtons on the hand from which a push counts, and from which it is borne in full."""

TORQUES = (0.5, 1.0)
"""The same of the torques on the joints, as shares of those that are taken for a collision."""

FADED = 0.7
"""Share of the first of them below which nothing acts any more."""

CALM = 0.1
"""Seconds that nothing must act before what comes next is something else."""

WORK = 0.02
"""Joules from which something is taken for active."""

DEBT = -0.2
"""Joules, the most that something is held to have taken from the arm: what rubs along it takes ever more, and whoever
pushes next is no less active."""

UNFELT = 2.0
"""Ticks for which something acts before it is felt: what it took from the arm's motion meanwhile counts."""

RISE = 0.005
"""Seconds within which a push comes up: its line and its size are taken from it then."""

GROWTH = 25.0
"""Rate in 1/s at which what is borne may grow afterwards. Where joint states come late, what the arm bears seems to
come from outside for a moment, and would be borne as well."""

TICKS = 1.0
"""A push is borne in full from the speed on that it gives the arm within so many ticks: less could not be sampled."""

RETURNING = 100.0
"""1/s: a place off the arm's course counts as much as this many times its distance in speed."""

BRAKING = 100.0
"""1/s with which a pushed arm's joints are braked towards the speeds of their course, on top of its law."""

SHARE = 0.9
"""Share of a joint's torque, less what gravity takes, that all of this may need."""

NOTHING, PASSIVE, PUSH, ECHO = range(4)
"""What acts: nothing; something that so far gives back no more than it took; a push; the arm's own torques, which late
joint states show as something from outside: it turns round as they do."""

LINKS, HAND = range(2)
"""Where it acts."""


class Brace:
    """Torques against pushes, tick after tick. collision (7,): Nm on each joint that are taken for a collision."""

    def __init__(self, robot: RobotModel, collision: np.ndarray, period: float) -> None:
        self._limits = (robot.tau_max, collision)
        self._period = period
        self._kinds = np.zeros(2, dtype=np.int64)
        # Of either: seconds of calm, seconds since it came up, joules of its work, and the size that may be borne.
        self._past = np.zeros((2, 4))
        self._lines = np.zeros((2, 7))
        self._v = np.zeros(7)

    @property
    def is_struck(self) -> bool:
        """Does anything strong act on the arm from outside, or has just acted?"""
        return bool(self._kinds.any())

    def bear(
        self, state: ArmState, wrench: np.ndarray, links: np.ndarray, course: tuple[np.ndarray, np.ndarray]
    ) -> np.ndarray:
        """Torques (7,) in Nm for this tick. wrench (6,): on the hand, at G in W axes, as far as none is wanted or borne
        there. links (7,): torques in Nm from outside that the wrist doesn't feel and nothing makes up for. course:
        where the joints should be, in rad, and how fast, in rad/s (7,)."""
        torque = np.zeros(7)
        arm = (state.q, state.v, state.M, state.bias, state.J)
        memory = (self._period, self._kinds, self._past, self._lines)
        _bear(*arm, self._v, wrench, links, *course, *self._limits, *memory, torque)
        self._v = state.v
        return torque


@njit(cache=True)
def _bear(q, v, M, bias, J, v_before, wrench, links, q_d, v_d, tau_max, collision, period, kinds, past, lines, torque):
    n = len(q)
    worst, force = np.max(np.abs(links) / collision), math.sqrt(_dot(wrench[:3], wrench[:3]))
    powers = _dot(links, v_before), _dot(links, v)
    _judge(LINKS, worst / TORQUES[0], powers, links, period, kinds, past, lines)
    powers = _dot(wrench, J @ v_before), _dot(wrench, J @ v)
    _judge(HAND, force / FORCE[0], powers, wrench, period, kinds, past, lines)
    drift = v - v_d + RETURNING * (q - q_d)
    if kinds[LINKS] == PUSH:
        push = lines[LINKS] * max(_dot(lines[LINKS], links) / _dot(lines[LINKS], lines[LINKS]), 0.0)
        share = _share(np.max(np.abs(push) / collision), TORQUES, past[LINKS, 3])
        _bear_along(push, share, M, drift, period, torque)
    if kinds[HAND] == PUSH:
        line = lines[HAND, :6]
        along = max(_dot(line, wrench[:3]) / _dot(line[:3], line[:3]), 0.0)
        share = _share(along * math.sqrt(_dot(line[:3], line[:3])), FORCE, past[HAND, 3])
        _bear_along(along * (J.T @ line), share, M, drift, period, torque)
    if kinds[LINKS] == PUSH or kinds[HAND] == PUSH:
        for i in range(n):
            torque[i] -= BRAKING * _dot(M[i], v - v_d)
    for i in range(n):
        most = max(SHARE * tau_max[i] - abs(bias[i]), 0.0)
        torque[i] = min(max(torque[i], -most), most)


@njit(cache=True)
def _bear_along(push, share, M, drift, period, torque):
    """Take off so much of a push (7,), in Nm, as it drives the arm off."""
    given = TICKS * period * _dot(push, np.linalg.solve(M, push))
    share *= min(max(_dot(push, drift) / max(given, 1e-9), 0.0), 1.0)
    for i in range(len(push)):
        torque[i] -= share * push[i]


@njit(cache=True)
def _judge(where, size, powers, now, period, kinds, past, lines):
    """Take in one tick of what acts: its size (1: it counts), the power in W with which it drives the arm as that moved
    before and moves now, and its components now."""
    mine, line = past[where], lines[where]
    mine[0] = mine[0] + period if size < FADED else 0.0
    if mine[0] > CALM:
        kinds[where] = NOTHING
    if kinds[where] == NOTHING:
        if size < 1.0:
            return
        kinds[where] = PASSIVE
        mine[1:] = 0.0
        mine[2] = UNFELT * period * min(powers[0], 0.0)
    mine[1] += period
    mine[2] = max(mine[2] + powers[1] * period, DEBT)
    if mine[1] < RISE and size > mine[3]:
        mine[3] = size
        line[: len(now)] = now
    elif mine[1] >= RISE:
        mine[3] = min(max(mine[3], size), mine[3] * (1.0 + GROWTH * period))
    if kinds[where] == PASSIVE and mine[2] > WORK:
        kinds[where] = PUSH
    if size >= 1.0 and _dot(line, now) < 0.0:
        kinds[where] = ECHO


@njit(cache=True)
def _share(value, bounds, most):
    """Share to be borne: nothing at the first bound, all at the second, and no more than `most` times the first."""
    rising = (value - bounds[0]) / (bounds[1] - bounds[0])
    return min(max(rising, 0.0), 1.0) * min(most * bounds[0] / max(value, bounds[0]), 1.0)


@njit(cache=True)
def _dot(a, b):
    total = 0.0
    for i in range(len(b)):
        total += a[i] * b[i]
    return total
