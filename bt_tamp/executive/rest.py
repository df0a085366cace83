"""What moves: planning and judging a run wait until things have come to rest."""

import math

import numpy as np

from sim.plant import Observation

REST_SPEED = 0.01
REST_TURN = 0.2
"""m/s and rad/s below which a body is at rest."""


def moving(observation: Observation) -> list[str]:
    """Names of the bodies that are not at rest."""
    return [name for name, V_WO in observation.velocities.items() if not at_rest(V_WO)]


def at_rest(V_WO: np.ndarray) -> bool:
    """Is something with this velocity (6,) at rest?"""
    x, y, z, a, b, c = V_WO.tolist()
    return math.hypot(x, y, z) <= REST_SPEED and math.hypot(a, b, c) <= REST_TURN
