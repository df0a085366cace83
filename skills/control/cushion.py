"""What keeps an arm that is pushed from being flung about: what pushes it is not in the model, and whatever the QP
allows for the joints' limits, a push on the hand would drive them beyond their speeds and onto their stops."""

import numpy as np
from numba import njit

from sim.robot import RobotModel
from skills.control.state import ArmState

FREELY = 0.5
"""Share of a joint's speed limit up to which the arm's law alone says how it moves."""

BRAKING = 80.0
"""1/s with which what is beyond that is braked: stable at 500 Hz, and with joint states that come 10 ms late."""

WIDTH = 0.35
"""Rad before a stop at which a joint begins to be held back."""

FULL = 0.15
"""Rad before a stop at which it is held back with all that its motor may give."""

CREEPING = 0.2
"""Rad/s towards a stop from which it is held back fully; one that is on its way back is let go."""

SHARE = 0.97
"""Share of a joint's torque limit that all of this may take."""


def cushion(state: ArmState, robot: RobotModel) -> np.ndarray:
    """Torques (7,) in Nm against joints that are driven too fast, or come near to their stops."""
    most = SHARE * robot.tau_max
    return _cushion(state.q, state.v, state.M, robot.q_min, robot.q_max, FREELY * robot.v_max, most)


@njit(cache=True)
def _cushion(q, v, M, q_min, q_max, v_free, most):
    n = len(q)
    excess = np.zeros(n)
    for i in range(n):
        excess[i] = max(abs(v[i]) - v_free[i], 0.0) * np.sign(v[i])
    torque = -BRAKING * (M @ excess)
    for i in range(n):
        above, below = q[i] - (q_max[i] - WIDTH), (q_min[i] + WIDTH) - q[i]
        depth, way = (above, 1.0) if above > below else (below, -1.0)
        if depth > 0.0 and way * v[i] > 0.0:
            share = min(depth / (WIDTH - FULL), 1.0) * min(way * v[i] / CREEPING, 1.0)
            torque[i] -= way * most[i] * share
        torque[i] = min(max(torque[i], -most[i]), most[i])
    return torque
