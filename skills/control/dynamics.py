"""The arm's kinematics and dynamics, compiled: one call a tick for all that the controller needs of the model.

Pinocchio is where the model comes from. It computes the same, but in a tick it costs three times as much: half a dozen
calls with an array handed over each, whose code the physics has driven out of the processor's caches in between.

Everything is about W's origin and in W's axes: joint i moves what lies beyond it by the twist S_i = (p_i × z_i, z_i),
linear before angular. Recursive Newton-Euler and composite-rigid-body algorithms: Featherstone, "Rigid body dynamics
algorithms", 2008, tables 5.1 and 6.2.
"""

import math

import numpy as np
import pinocchio as pin
from numba import njit

from sim.robot import GRAVITY, RobotModel
from skills.control.state import ArmState, Target
from skills.control.vectors import cross, dot, turn


class Dynamics:
    """The model of a robot with what it holds, as tables for the compiled functions.

    Raises ValueError for an arm with a joint that doesn't turn about its own z axis.
    """

    def __init__(self, robot: RobotModel) -> None:
        model = robot.model
        joints = zip(list(model.names)[1:], list(model.joints)[1:], strict=True)
        odd = [name for name, joint in joints if joint.shortname() != "JointModelRZ"]
        if odd:
            raise ValueError(f"joints {', '.join(odd)} of {robot.name} don't turn about their own z axes")
        tool = model.frames[robot.tcp_id].placement
        placements = [*list(model.jointPlacements)[1:], tool]
        self._frames = np.array([np.column_stack([X.rotation, X.translation]) for X in placements])
        self._bodies = np.array([_table(inertia) for inertia in list(model.inertias)[1:]])

    def state(self, q: np.ndarray, v: np.ndarray) -> ArmState:
        """The model evaluated at q, v (7,)."""
        M, bias, J, drift = np.empty((7, 7)), np.empty(7), np.empty((6, 7)), np.empty(6)
        p, R, V = np.empty(3), np.empty((3, 3)), np.empty(6)
        _fill_state(self._frames, self._bodies, q, v, M, bias, J, drift, p, R, V)
        return ArmState(q, v, M, bias, J, drift, p, R, V)

    def target(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> Target:
        """The tool's motion when the joints are at q with velocity v and acceleration a (7,)."""
        p, R, V, A = np.empty(3), np.empty((3, 3)), np.empty(6), np.empty(6)
        _fill_target(self._frames, q, v, a, p, R, V, A)
        return Target(p, R, V, A)


def _table(body: pin.Inertia) -> np.ndarray:
    """Lever and mass of a body in the first row, in the others its inertia about its centre."""
    return np.vstack([np.append(body.lever, body.mass), np.column_stack([body.inertia, np.zeros(3)])])


@njit(cache=True)
def _move(frames, q, v, a, R, p, w, dw, dp, ddp):
    """Place and move joint frames 1 to 7 and the tool's, 8, each in what comes before it; 0 is W. Rotations R (9,3,3),
    and of each origin: p, angular velocity w and acceleration dw, linear ones dp and ddp (9,3)."""
    R[0] = 0.0
    for k in range(3):
        R[0, k, k] = 1.0
        p[0, k] = w[0, k] = dw[0, k] = dp[0, k] = ddp[0, k] = 0.0
    arm = np.empty(3)
    for i in range(len(frames)):
        F = frames[i]
        angle = rate = gain = 0.0
        if i < len(q):
            angle, rate, gain = q[i], v[i], a[i]
        c, s = math.cos(angle), math.sin(angle)
        for r in range(3):
            x, y, z = R[i, r, 0], R[i, r, 1], R[i, r, 2]
            along = x * F[0, 0] + y * F[1, 0] + z * F[2, 0]
            across = x * F[0, 1] + y * F[1, 1] + z * F[2, 1]
            R[i + 1, r, 0] = c * along + s * across
            R[i + 1, r, 1] = c * across - s * along
            R[i + 1, r, 2] = x * F[0, 2] + y * F[1, 2] + z * F[2, 2]
            arm[r] = x * F[0, 3] + y * F[1, 3] + z * F[2, 3]
        turned, swung = cross(w[i], arm), cross(dw[i], arm)
        centripetal = cross(w[i], turned)
        axis = R[i + 1, 0, 2], R[i + 1, 1, 2], R[i + 1, 2, 2]
        coriolis = cross(w[i], axis)
        for k in range(3):
            p[i + 1, k] = p[i, k] + arm[k]
            dp[i + 1, k] = dp[i, k] + turned[k]
            ddp[i + 1, k] = ddp[i, k] + swung[k] + centripetal[k]
            w[i + 1, k] = w[i, k] + axis[k] * rate
            dw[i + 1, k] = dw[i, k] + axis[k] * gain + coriolis[k] * rate


@njit(cache=True)
def _fill_target(frames, q, v, a, p_G, R_G, V, A):
    n = len(frames)
    R, p, w, dw, dp, ddp = _room(n)
    _move(frames, q, v, a, R, p, w, dw, dp, ddp)
    R_G[:] = R[n]
    for k in range(3):
        p_G[k], V[k], V[3 + k], A[k], A[3 + k] = p[n, k], dp[n, k], w[n, k], ddp[n, k], dw[n, k]


@njit(cache=True)
def _fill_state(frames, bodies, q, v, M, bias, J, drift, p_G, R_G, V):
    n = len(q)
    R, p, w, dw, dp, ddp = _room(n + 1)
    _move(frames, q, v, np.zeros(n), R, p, w, dw, dp, ddp)
    R_G[:] = R[n + 1]
    for k in range(3):
        p_G[k], V[k], V[3 + k] = p[n + 1, k], dp[n + 1, k], w[n + 1, k]
        drift[k], drift[3 + k] = ddp[n + 1, k], dw[n + 1, k]
    S = np.empty((n, 6))
    for i in range(n):
        axis = R[i + 1, 0, 2], R[i + 1, 1, 2], R[i + 1, 2, 2]
        linear = cross(p[i + 1], axis)
        swept = cross(axis, p_G)
        for k in range(3):
            S[i, k], S[i, 3 + k] = linear[k], axis[k]
            J[k, i], J[3 + k, i] = linear[k] + swept[k], axis[k]
    # Of the bodies beyond a joint: mass, its first moment and the inertia; what moving on without
    # acceleration takes, as force and moment.
    mass, moment, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    force, torque = np.zeros(3), np.zeros(3)
    turning = np.empty((3, 3))
    centre = np.empty(3)
    for j in range(n - 1, -1, -1):
        body, R_j = bodies[j], R[j + 1]
        lever = turn(R_j, body[0])
        for r in range(3):
            centre[r] = p[j + 1, r] + lever[r]
        _turn_inertia(R_j, body, turning)
        swung, spun = cross(dw[j + 1], lever), cross(w[j + 1], cross(w[j + 1], lever))
        gyration = cross(w[j + 1], turn(turning, w[j + 1]))
        rolling = turn(turning, dw[j + 1])
        m = body[0, 3]
        push = (
            m * (ddp[j + 1, 0] + swung[0] + spun[0]),
            m * (ddp[j + 1, 1] + swung[1] + spun[1]),
            m * (ddp[j + 1, 2] + swung[2] + spun[2] + GRAVITY),
        )
        about = cross(centre, push)
        square = dot(centre, centre)
        mass += m
        for r in range(3):
            force[r] += push[r]
            torque[r] += about[r] + rolling[r] + gyration[r]
            moment[r] += m * centre[r]
            for k in range(3):
                inertia[r, k] += turning[r, k] - m * centre[r] * centre[k]
            inertia[r, r] += m * square
        linear, axis = S[j, :3], S[j, 3:]
        bias[j] = dot(linear, force) + dot(axis, torque)
        # The force and moment that one unit of acceleration of joint j takes.
        dragged, shifted, rolled = cross(axis, moment), cross(moment, linear), turn(inertia, axis)
        for i in range(j + 1):
            M[i, j] = 0.0
            for k in range(3):
                M[i, j] += S[i, k] * (mass * linear[k] + dragged[k]) + S[i, 3 + k] * (rolled[k] + shifted[k])
            M[j, i] = M[i, j]


@njit(cache=True)
def _room(n):
    """Where `_move` puts n frames and W."""
    vectors = np.empty((5, n + 1, 3))
    return np.empty((n + 1, 3, 3)), vectors[0], vectors[1], vectors[2], vectors[3], vectors[4]


@njit(cache=True)
def _turn_inertia(R, body, turned):
    """R I Rᵀ of the body's inertia I about its centre."""
    for r in range(3):
        row = (
            R[r, 0] * body[1, 0] + R[r, 1] * body[2, 0] + R[r, 2] * body[3, 0],
            R[r, 0] * body[1, 1] + R[r, 1] * body[2, 1] + R[r, 2] * body[3, 1],
            R[r, 0] * body[1, 2] + R[r, 1] * body[2, 2] + R[r, 2] * body[3, 2],
        )
        for k in range(3):
            turned[r, k] = dot(row, R[k])
