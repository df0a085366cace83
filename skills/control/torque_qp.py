"""The torque controller's QP: joint accelerations that serve the tasks best within all limits.

    minimise Σ weight ‖A q̈ − b‖² + 1e-6 ‖q̈‖²
    subject to  −τ_max ≤ M q̈ + h + f ≤ τ_max,  the joints' bounds, and further rows

with h the Coriolis and gravity torques and f a feedforward torque (minus Jᵀ times a contact wrench).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from sim.robot import RobotModel
from skills.control.limits import FREE, AccelerationLimit, Bound, PositionLimit, Row, TorqueLimits, VelocityLimit
from skills.control.osqp_ import SOLVED, Solver, Workspace
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


@dataclass(frozen=True, slots=True)
class Solution:
    """Torques tau (7,) Nm, the accelerations a (7,) rad/s² they are meant to give, and the solver's status."""

    tau: np.ndarray
    a: np.ndarray
    status: str

    @property
    def is_fallback(self) -> bool:
        return self.status != SOLVED


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
        self._rows = np.zeros((7 + SPARE_ROWS, 7)), np.empty(7 + SPARE_ROWS), np.empty(7 + SPARE_ROWS)
        self._last = np.zeros(7)
        self._last_feedforward = np.zeros(7)
        self._lap = lap
        self.fallbacks = 0
        self.torque_limit_violations = 0

    def solve(
        self, state: ArmState, tasks: Sequence[Task], feedforward: np.ndarray, limits: Sequence[Row] = ()
    ) -> Solution:
        """Accelerations and torques for this instant; feedforward f (7,) in Nm, `limits` of SPARE_ROWS rows at most.

        Whenever the solver ends with anything but "solved", the last solution fades, tick by tick,
        into braking under gravity compensation, clipped to the torque limits.
        """
        P, g = REGULARISATION * _EYE, np.zeros(7)
        for task in tasks:
            rows = task.rows(state)
            _add(rows.A, rows.b, rows.weight, P, g)
        bounds = self.joint_bounds(state)
        rows = self._all_rows(state, feedforward, limits)
        self._lap("QP build")
        a, status = self._workspace.solve(P, g, bounds, rows)
        self._lap("solve")
        if status != SOLVED:
            return self._fall_back(state, bounds, status)
        tau = state.M @ a + state.bias + feedforward
        if self._torque_limits.broken(tau):
            self.torque_limit_violations += 1
        self._last, self._last_feedforward = a, feedforward
        return Solution(tau, a, status)

    def joint_bounds(self, state: ArmState) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (7,) on q̈; lower never exceeds upper."""
        lower, upper = _LOWEST.copy(), _HIGHEST.copy()
        for bound in self._bounds:
            bound.narrow(state, lower, upper)
        return lower, upper

    def _all_rows(
        self, state: ArmState, feedforward: np.ndarray, limits: Sequence[Row]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        R, lower, upper = self._rows
        lower[7:], upper[7:] = -FREE, FREE
        filled = 0
        for limit in (self._torque_limits, *limits):
            rows, low, high = limit.rows(state, feedforward)
            end = filled + len(rows)
            R[filled:end], lower[filled:end], upper[filled:end] = rows, low, high
            filled = end
        R[filled:] = 0.0
        return R, lower, upper

    def _fall_back(self, state: ArmState, bounds: tuple[np.ndarray, np.ndarray], status: str) -> Solution:
        self.fallbacks += 1
        braking = -FALLBACK_DAMPING * state.v
        a = np.clip(FALLBACK_DECAY * self._last + (1.0 - FALLBACK_DECAY) * braking, bounds[0], bounds[1])
        self._last, self._last_feedforward = a, FALLBACK_DECAY * self._last_feedforward
        tau = state.M @ a + state.bias + self._last_feedforward
        return Solution(self._torque_limits.clip(tau), a, status)


@njit(cache=True)
def _add(A: np.ndarray, b: np.ndarray, weight: float, P: np.ndarray, g: np.ndarray) -> None:
    """Add weight · ‖A x − b‖² to ½ xᵀ P x + gᵀ x, up to a factor of 2."""
    for k in range(len(b)):
        for i in range(len(g)):
            share = weight * A[k, i]
            g[i] -= share * b[k]
            for j in range(len(g)):
                P[i, j] += share * A[k, j]


_EYE = np.eye(7)
_LOWEST, _HIGHEST = np.full(7, -FREE), np.full(7, FREE)
