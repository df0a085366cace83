"""The torque controller's QP: joint accelerations that serve the tasks best within all limits.

    minimise Σ weight ‖A q̈ − b‖² + 1e-6 ‖q̈‖²
    subject to  −τ_max ≤ M q̈ + h + f ≤ τ_max  and the acceleration bounds of position and velocity limits

with h the Coriolis and gravity torques and f a feedforward torque (minus Jᵀ times a contact wrench).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.robot import RobotModel
from skills.control.limits import JointLimits, TorqueLimits
from skills.control.osqp_ import SOLVED, Workspace
from skills.control.state import ArmState
from skills.control.tasks import Task

REGULARISATION = 1e-6
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


class TorqueQP:
    """Solves one tick after the other; counts `fallbacks` and `torque_limit_violations` (of the QP's own output)."""

    def __init__(self, robot: RobotModel, period: float, **settings: float) -> None:
        self._workspace = Workspace(7, 7, **settings)
        self._joint_limits = JointLimits(robot.q_min, robot.q_max, robot.v_max, robot.a_max, period)
        self._torque_limits = TorqueLimits(robot.tau_max)
        self._last = np.zeros(7)
        self._last_feedforward = np.zeros(7)
        self.fallbacks = 0
        self.torque_limit_violations = 0

    def solve(self, state: ArmState, tasks: Sequence[Task], feedforward: np.ndarray) -> Solution:
        """Accelerations and torques for this instant; feedforward f (7,) in Nm.

        Whenever the solver ends with anything but "solved", the last solution fades, tick by tick,
        into braking under gravity compensation, clipped to the torque limits.
        """
        P, g = REGULARISATION * np.eye(7), np.zeros(7)
        for task in tasks:
            rows = task.rows(state)
            weighted = rows.weight * rows.A.T
            P += weighted @ rows.A
            g -= weighted @ rows.b
        bounds = self._joint_limits.bounds(state)
        a, status = self._workspace.solve(P, g, bounds, self._torque_limits.rows(state, feedforward))
        if status != SOLVED:
            return self._fall_back(state, bounds, status)
        tau = state.M @ a + state.bias + feedforward
        if self._torque_limits.broken(tau):
            self.torque_limit_violations += 1
        self._last, self._last_feedforward = a, feedforward
        return Solution(tau, a, status)

    def _fall_back(self, state: ArmState, bounds: tuple[np.ndarray, np.ndarray], status: str) -> Solution:
        self.fallbacks += 1
        braking = -FALLBACK_DAMPING * state.v
        a = np.clip(FALLBACK_DECAY * self._last + (1.0 - FALLBACK_DECAY) * braking, bounds[0], bounds[1])
        self._last, self._last_feedforward = a, FALLBACK_DECAY * self._last_feedforward
        tau = state.M @ a + state.bias + self._last_feedforward
        return Solution(self._torque_limits.clip(tau), a, status)
