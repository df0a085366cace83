"""Poses of the hand that follow from another."""

import numpy as np
from pinocchio import SE3


def back_off(X_WG: SE3, distance: float) -> SE3:
    """The hand's pose `distance` metres back along its own approach direction."""
    return X_WG * SE3(np.eye(3), np.array([0.0, 0.0, -distance]))


def raised(X_WG: SE3, height: float) -> SE3:
    """The hand's pose `height` metres further up in W."""
    return shifted(X_WG, np.array([0.0, 0.0, height]))


def shifted(X_WG: SE3, offset: np.ndarray) -> SE3:
    """The hand's pose moved by `offset` (3,) metres in W."""
    return SE3(X_WG.rotation, X_WG.translation + offset)
