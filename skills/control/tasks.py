"""Tasks: what the joint accelerations q̈ should achieve, as weighted rows ‖A q̈ − b‖².

One class per task; each knows its law only. Limits are elsewhere (`limits`), and so is the QP
that weighs tasks against each other (`torque_qp`).

The impedance law and its damping follow Albu-Schäffer et al., "Cartesian impedance control of
redundant robots", 2003 (double diagonalisation); the null-space row follows the dynamically
consistent projection of Khatib, 1987.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pinocchio as pin

from skills.control.state import ArmState, Target

STIFF = 1600.0
"""Position gain in 1/s² of a task that must be followed rather than give way."""

DAMPED = 80.0
"""Velocity gain in 1/s that damps `STIFF` critically."""

SINK_DAMPING = 20.0
"""Velocity gain in 1/s along a force-controlled direction."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Cost weight · ‖A q̈ − b‖² with A (k,7) and b (k,)."""

    A: np.ndarray
    b: np.ndarray
    weight: float = 1.0


class Task(Protocol):
    """Something that wants certain joint accelerations."""

    def rows(self, state: ArmState) -> Rows: ...


@dataclass(frozen=True, slots=True)
class JointTask:
    """Follow q_d, v_d, a_d (7,) in joint space: q̈* = a_d + 80 (v_d − q̇) + 1600 (q_d − q).

    Stiff, because the last joint carries little inertia: there, what the grip on a held thing
    does to the hand (about 0.1 Nm) is answered by this gain times 0.004 kg m².
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    damping: float = DAMPED
    stiffness: float = STIFF

    def rows(self, state: ArmState) -> Rows:
        return Rows(_EYE, self.a + self.damping * (self.v - state.v) + self.stiffness * (self.q - state.q))


@dataclass(frozen=True, slots=True)
class PostureTask:
    """Follow q, v, a (7,) with the one freedom that six task-space rows leave.

    The row is nᵀ M q̈ with J n = 0: orthogonal, in the metric of M, to whatever moves the tool, so
    it adds no stiffness there.
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray

    def rows(self, state: ArmState) -> Rows:
        row = null_direction(state.J) @ state.M
        row /= math.sqrt(row @ row) + 1e-9
        wanted = self.a + DAMPED * (self.v - state.v) + STIFF * (self.q - state.q)
        return Rows(row[None], np.array([row @ wanted]))


class PoseTask:
    """Impedance of the tool towards a target: Λ (ẍ − ẍ_d) + D ė + K e = F_ext, each mode critically damped.

    stiffness (6,): N/m and Nm/rad along and about W's axes, all positive. External force is not
    compensated, so a static force F displaces the tool by F/K. period: of the control ticks, in s.
    """

    def __init__(self, target: Target, stiffness: np.ndarray, period: float) -> None:
        self._target = target
        self._root = np.sqrt(stiffness)
        self._period = period

    def rows(self, state: ArmState) -> Rows:
        """Λ⁻¹K and Λ⁻¹D = 2 (Λ⁻¹K)^½ come from the eigenvalues ω² of the symmetric K^½ Λ⁻¹ K^½.

        Torques are held for a period T, which acts as damping: a mode sampled so is critically
        damped (both its discrete poles are equal) with 2 ω − ω² T/2 in place of 2 ω.
        """
        root, target = self._root, self._target
        squares, modes = np.linalg.eigh(root[:, None] * state.mobility * root)
        frequencies = np.sqrt(np.maximum(squares, 0.0))
        spring = modes.T @ (root * pose_error(target, state))
        damper = modes.T @ (root * (target.V - state.V))
        damping = frequencies * np.maximum(2.0 - frequencies * self._period / 2, 1.0)
        pull = modes @ (squares * spring + damping * damper)
        return Rows(state.J, target.A + pull / root - state.drift)


@dataclass(frozen=True, slots=True)
class HybridTask:
    """Follow the target stiffly, except along the z axis of the contact frame C: there velocity is
    only damped, and a force (added by the caller as a feedforward torque) decides.

    R_WC (3,3): axes of C in W.
    """

    target: Target
    R_WC: np.ndarray

    def rows(self, state: ArmState) -> Rows:
        wanted = self.target.A + DAMPED * (self.target.V - state.V) + STIFF * pose_error(self.target, state)
        normal = self.R_WC[:, 2]
        along = wanted[:3] @ normal
        wanted[:3] += normal * (-SINK_DAMPING * (state.V[:3] @ normal) - along)
        return Rows(state.J, wanted - state.drift)


def pose_error(target: Target, state: ArmState) -> np.ndarray:
    """(6,) displacement and rotation vector, in W axes, that would bring the tool to the target.

    The rotation comes from the unit quaternion of R_d Rᵀ, on the hemisphere of the shorter turn.
    """
    turn = pin.Quaternion(target.R @ state.R.T)
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if sine < 1e-9 else 2.0 * math.atan2(sine, w) / sine
    error = np.empty(6)
    error[:3] = target.p - state.p
    error[3:] = scale * x, scale * y, scale * z
    return error


def null_direction(J: np.ndarray) -> np.ndarray:
    """The joint velocity (7,) that doesn't move the tool: the generalised cross product of J's (6,7)
    rows. It varies smoothly with J and vanishes where the tool loses a freedom."""
    return _SIGNS * np.linalg.det(J[:, _WITHOUT].transpose(1, 0, 2))


_EYE = np.eye(7)
_SIGNS = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
_WITHOUT = np.array([[j for j in range(7) if j != i] for i in range(7)])
