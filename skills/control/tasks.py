"""Tasks: what the joint accelerations q̈ should achieve, as weighted rows ‖A q̈ − b‖².

One class per task; each knows its law only. Limits are elsewhere (`limits`), and so is the QP
that weighs tasks against each other (`torque_qp`).

The impedance law and its damping follow Albu-Schäffer et al., "Cartesian impedance control of
redundant robots", 2003 (double diagonalisation); the null-space row follows the dynamically
consistent projection of Khatib, 1987.
"""

import math
from typing import NamedTuple, Protocol

import numpy as np
from numba import njit

from skills.control.state import ArmState, Target

STIFF = 1600.0
"""Position gain in 1/s² of a task that must be followed rather than give way."""

DAMPED = 80.0
"""Velocity gain in 1/s that damps `STIFF` critically."""

SINK_DAMPING = 20.0
"""Velocity gain in 1/s along a force-controlled direction."""

LANDING_DAMPING = 50.0
"""The same at touchdown, against bouncing: later it would hold back the force."""


class Rows(NamedTuple):
    """Cost weight · ‖A q̈ − b‖² with A (k,7) and b (k,)."""

    A: np.ndarray
    b: np.ndarray
    weight: float = 1.0


class Task(Protocol):
    """Something that wants certain joint accelerations."""

    def rows(self, state: ArmState) -> Rows: ...


class JointTask(NamedTuple):
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
        wanted = np.empty(7)
        _joint_accelerations(self.q, self.v, self.a, self.damping, self.stiffness, state.q, state.v, wanted)
        return Rows(_EYE, wanted)


class PostureTask(NamedTuple):
    """Follow q, v, a (7,) with the one freedom that six task-space rows leave.

    The row is nᵀ M q̈ with J n = 0: orthogonal, in the metric of M, to whatever moves the tool, so
    it adds no stiffness there.
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray

    def rows(self, state: ArmState) -> Rows:
        row, wanted = np.empty((1, 7)), np.empty(1)
        _posture_row(state.J, state.M, self.q, self.v, self.a, state.q, state.v, row, wanted)
        return Rows(row, wanted)


class PoseTask:
    """Impedance of the tool towards a target: Λ (ẍ − ẍ_d) + D ė + K e = F_ext, each mode critically damped,
    or with `ratio` times as much.

    stiffness (6,): N/m and Nm/rad along and about W's axes, all positive. External force is not
    compensated, so a static force F displaces the tool by F/K. period: of the control ticks, in s.
    """

    def __init__(self, target: Target, stiffness: np.ndarray, period: float, ratio: float = 1.0) -> None:
        self._target = target
        self._ratio = ratio
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
        damping = self._ratio * frequencies * np.maximum(2.0 - frequencies * self._period / 2, 1.0)
        pull = modes @ (squares * spring + damping * damper)
        return Rows(state.J, target.A + pull / root - state.drift)


class HybridTask(NamedTuple):
    """Follow the target stiffly, except along the z axis of the contact frame C: there velocity is
    only damped, and a force (added by the caller as a feedforward torque) decides.

    R_WC (3,3): axes of C in W. sink_damping: 1/s along z of C.
    """

    target: Target
    R_WC: np.ndarray
    sink_damping: float = SINK_DAMPING

    def rows(self, state: ArmState) -> Rows:
        wanted, now = np.empty(6), (state.p, state.R, state.V, state.drift)
        _hybrid_acceleration(*self.target, *now, self.R_WC, self.sink_damping, wanted)
        return Rows(state.J, wanted)


def pose_error(target: Target, state: ArmState) -> np.ndarray:
    """(6,) displacement and rotation vector, in W axes, that would bring the tool to the target.

    The rotation comes from the unit quaternion of R_d Rᵀ, on the hemisphere of the shorter turn.
    """
    error = np.empty(6)
    _fill_pose_error(target.p, target.R, state.p, state.R, error)
    return error


_EYE = np.eye(7)


@njit(cache=True)
def _fill_pose_error(p_d: np.ndarray, R_d: np.ndarray, p: np.ndarray, R: np.ndarray, error: np.ndarray) -> None:
    Q = np.empty((3, 3))
    for i in range(3):
        error[i] = p_d[i] - p[i]
        for j in range(3):
            Q[i, j] = R_d[i, 0] * R[j, 0] + R_d[i, 1] * R[j, 1] + R_d[i, 2] * R[j, 2]
    # Unit quaternion (u, w) of Q, from whichever of its components is large (Shepperd, 1978).
    trace = Q[0, 0] + Q[1, 1] + Q[2, 2]
    u = error[3:]
    if trace > 0.0:
        root = math.sqrt(1.0 + trace)
        w = root / 2
        u[0], u[1], u[2] = Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]
        for i in range(3):
            u[i] /= 2 * root
    else:
        i = 0
        if Q[1, 1] > Q[0, 0]:
            i = 1
        if Q[2, 2] > Q[i, i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        root = math.sqrt(max(1.0 + Q[i, i] - Q[j, j] - Q[k, k], 0.0))
        u[i] = root / 2
        u[j], u[k] = (Q[i, j] + Q[j, i]) / (2 * root), (Q[i, k] + Q[k, i]) / (2 * root)
        w = (Q[k, j] - Q[j, k]) / (2 * root)
    sine = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    scale = 2.0 if sine < 1e-9 else 2.0 * math.atan2(sine, abs(w)) / sine
    for i in range(3):
        u[i] *= math.copysign(scale, w)


@njit(cache=True)
def _joint_accelerations(q_d, v_d, a_d, damping, stiffness, q, v, wanted):
    for i in range(len(q)):
        wanted[i] = a_d[i] + damping * (v_d[i] - v[i]) + stiffness * (q_d[i] - q[i])


@njit(cache=True)
def _hybrid_acceleration(p_d, R_d, V_d, A_d, p, R, V, drift, R_WC, sink_damping, wanted):
    _fill_pose_error(p_d, R_d, p, R, wanted)
    along = sinking = 0.0
    for i in range(6):
        wanted[i] = A_d[i] + DAMPED * (V_d[i] - V[i]) + STIFF * wanted[i]
    for i in range(3):
        along += wanted[i] * R_WC[i, 2]
        sinking += V[i] * R_WC[i, 2]
    for i in range(3):
        wanted[i] -= R_WC[i, 2] * (sink_damping * sinking + along)
    for i in range(6):
        wanted[i] -= drift[i]


@njit(cache=True)
def _posture_row(
    J: np.ndarray,
    M: np.ndarray,
    q_d: np.ndarray,
    v_d: np.ndarray,
    a_d: np.ndarray,
    q: np.ndarray,
    v: np.ndarray,
    row: np.ndarray,
    wanted: np.ndarray,
) -> None:
    n = np.empty(7)
    _fill_null_direction(J, n)
    square = 0.0
    for i in range(7):
        row[0, i] = 0.0
        for j in range(7):
            row[0, i] += n[j] * M[j, i]
        square += row[0, i] ** 2
    wanted[0] = 0.0
    for i in range(7):
        row[0, i] /= math.sqrt(square) + 1e-9
        wanted[0] += row[0, i] * (a_d[i] + DAMPED * (v_d[i] - v[i]) + STIFF * (q_d[i] - q[i]))


@njit(cache=True)
def _fill_null_direction(J: np.ndarray, n: np.ndarray) -> None:
    """The joint velocity n (7,) that doesn't move the tool, the generalised cross product of J's (6,7) rows. It varies
    smoothly with J and vanishes where the tool loses a freedom."""
    block = np.empty((6, 6))
    for left_out in range(7):
        for i in range(6):
            for j in range(6):
                block[i, j] = J[i, j if j < left_out else j + 1]
        sign = 1.0 if left_out % 2 == 0 else -1.0
        n[left_out] = sign * _determinant(block)


@njit(cache=True)
def _determinant(A: np.ndarray) -> float:
    """By elimination with row pivoting; A is overwritten."""
    size, found = len(A), 1.0
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(A[i, k]) > abs(A[best, k]):
                best = i
        if A[best, k] == 0.0:
            return 0.0
        if best != k:
            for j in range(k, size):
                A[k, j], A[best, j] = A[best, j], A[k, j]
            found = -found
        found *= A[k, k]
        for i in range(k + 1, size):
            factor = A[i, k] / A[k, k]
            for j in range(k + 1, size):
                A[i, j] -= factor * A[k, j]
    return found
