"""The torque controller's QP: joint accelerations that serve the tasks best within all limits.

    minimise Σ weight ‖A q̈ − b‖² + 1e-6 ‖q̈‖²
    subject to  −τ_max ≤ M q̈ + h + f ≤ τ_max,  the joints' bounds, and further rows

with h the Coriolis and gravity torques and f a feedforward torque (minus Jᵀ times a contact wrench).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from sim.robot import RobotModel
from skills.control.limits import FREE, AccelerationLimit, Block, Bound, PositionLimit, Row, TorqueLimits, VelocityLimit
from skills.control.osqp_ import SOLVED, Problem, Solver, Workspace
from skills.control.state import ArmState
from skills.control.tasks import Task

REGULARISATION = 1e-6
HARDEST = 15.0
"""Times a robot's a_max that a joint may be accelerated with: what contact and tracking ask for is less."""

SPARE_ROWS = 2
"""Rows besides the torques'."""

FALLBACK_DAMPING = 20.0
"""1/s with which a fallback brakes the joints."""

FALLBACK_DECAY = 0.8
"""Share of the last solution that is kept from one failed tick to the next."""


class Solution(NamedTuple):
    """Torques tau (7,) Nm, the accelerations a (7,) rad/s² they are meant to give, and the solver's status."""

    tau: np.ndarray
    a: np.ndarray
    status: str


def nobody(part: str) -> None:
    """Takes no times."""


class TorqueQP:
    """Solves one tick after the other; counts `fallbacks` and `torque_limit_violations` (of the QP's own output).

    `solver` takes the place of OSQP with `settings`.
    """

    def __init__(
        self,
        robot: RobotModel,
        period: float,
        lap: Callable[[str], None] = nobody,
        solver: Solver | None = None,
        **settings: float,
    ):
        self._workspace = solver or Workspace(7, 7 + SPARE_ROWS, **settings)
        self._bounds: tuple[Bound, ...] = (
            AccelerationLimit(HARDEST * robot.a_max),
            VelocityLimit(robot.v_max, robot.a_max, period),
            PositionLimit(robot.q_min, robot.q_max, robot.a_max, period),
        )
        self._torque_limits = TorqueLimits(robot.tau_max)
        rows = 7 + SPARE_ROWS
        self._problem = Problem(
            np.empty((7, 7)), np.empty(7), np.empty((rows, 7)), np.empty(7 + rows), np.empty(7 + rows)
        )
        lower, upper = self._problem.lower, self._problem.upper
        self._joint_bounds = lower[:7], upper[:7]
        self._rows = Block(self._problem.R, lower[7:], upper[7:])
        self._last = np.zeros(7)
        self._last_feedforward = np.zeros(7)
        self._lap = lap
        self.fallbacks = 0
        self.torque_limit_violations = 0

    def solve(
        self, state: ArmState, tasks: Sequence[Task], feedforward: np.ndarray, limits: Sequence[Row] = ()
    ) -> Solution:
        """Accelerations and torques for this instant; feedforward f (7,) in Nm.

        Whenever the solver ends with anything but "solved", the last solution fades, tick by tick,
        into braking under gravity compensation, clipped to the torque limits.

        Raises ValueError for more than SPARE_ROWS `limits`.
        """
        if len(limits) > SPARE_ROWS:
            raise ValueError(f"{len(limits)} limits besides the torques', expected {SPARE_ROWS} at most")
        problem = self._problem
        _clear(*problem)
        for task in tasks:
            A, b, weight = task.rows(state)
            _add(A, b, weight, problem.P, problem.g)
        for bound in self._bounds:
            bound.narrow(state, *self._joint_bounds)
        self._torque_limits.fill(state, feedforward, self._rows)
        for row, limit in enumerate(limits, start=7):
            limit.fill(state, self._rows, row)
        self._lap("QP build")
        a, status = self._workspace.solve(problem)
        self._lap("solve")
        if status != SOLVED:
            return self._fall_back(state, status)
        tau = _torques(state, a, feedforward)
        if self._torque_limits.broken(tau):
            self.torque_limit_violations += 1
        self._last, self._last_feedforward = a, feedforward
        return Solution(tau, a, status)

    def _fall_back(self, state: ArmState, status: str) -> Solution:
        self.fallbacks += 1
        braking = -FALLBACK_DAMPING * state.v
        a = np.clip(FALLBACK_DECAY * self._last + (1.0 - FALLBACK_DECAY) * braking, *self._joint_bounds)
        self._last, self._last_feedforward = a, FALLBACK_DECAY * self._last_feedforward
        tau = _torques(state, a, self._last_feedforward)
        return Solution(self._torque_limits.clip(tau), a, status)


def _torques(state: ArmState, a: np.ndarray, feedforward: np.ndarray) -> np.ndarray:
    """M a + h + f (7,)."""
    tau = np.empty(7)
    _fill_torques(state.M, a, state.bias, feedforward, tau)
    return tau


@njit(cache=True)
def _fill_torques(M: np.ndarray, a: np.ndarray, bias: np.ndarray, feedforward: np.ndarray, tau: np.ndarray) -> None:
    for i in range(len(tau)):
        tau[i] = bias[i] + feedforward[i]
        for j in range(len(tau)):
            tau[i] += M[i, j] * a[j]


@njit(cache=True)
def _clear(P: np.ndarray, g: np.ndarray, R: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
    """No tasks and no limits."""
    P[:] = 0.0
    for i in range(len(g)):
        P[i, i] = REGULARISATION
    g[:] = 0.0
    R[:] = 0.0
    lower[:] = -FREE
    upper[:] = FREE


@njit(cache=True)
def _add(A: np.ndarray, b: np.ndarray, weight: float, P: np.ndarray, g: np.ndarray) -> None:
    """Add weight · ‖A x − b‖² to ½ xᵀ P x + gᵀ x, up to a factor of 2."""
    for k in range(len(b)):
        for i in range(len(g)):
            share = weight * A[k, i]
            g[i] -= share * b[k]
            for j in range(len(g)):
                P[i, j] += share * A[k, j]
