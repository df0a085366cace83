"""What moves: planning and judging a run wait until things have come to rest."""

import math

import numpy as np

from sim.plant import Observation

REST_SPEED = 0.01
REST_TURN = 0.2
"""m/s and rad/s below which a body is at rest."""

FINGERS_AT_REST = 0.01
"""m/s at which the fingers open or close below which they are."""


def moving(observation: Observation) -> list[str]:
    """Names of the bodies that are not at rest."""
    return [name for name, V_WO in observation.velocities.items() if not at_rest(V_WO)]


def is_unsettled(observation: Observation) -> bool:
    """Do bodies move, or the fingers? What these close on may be held in a moment."""
    return abs(observation.opening_velocity) > FINGERS_AT_REST or bool(moving(observation))


def at_rest(V_WO: np.ndarray) -> bool:
    """Is something with this velocity (6,) at rest?"""
    x, y, z, a, b, c = V_WO.tolist()
    return math.hypot(x, y, z) <= REST_SPEED and math.hypot(a, b, c) <= REST_TURN
