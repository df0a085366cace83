"""Inverse kinematics by quadratic programs, for arms without a closed form, and to check the closed form.

Each step solves min ‖J Δq − e‖² + λ‖e‖²‖Δq‖² within the joint limits and a largest step, e being the
pose error as a twist in G. The damping that shrinks with the error is that of Sugihara
(Solvability-unconcerned inverse kinematics by the Levenberg–Marquardt method, 2011).
"""

import warnings
from collections.abc import Iterable

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from planner.motion.lines import MAX_JOINT_STEP, CartesianPath
from sim.robot import RobotModel

TOLERANCE = 1e-6
"""Largest pose error that counts as reached, metres and rad."""

_DAMPING = 1e-2
_FLOOR = 1e-6
_MAX_STEP = 0.3
_ITERATIONS = 60


def solve_numerically(robot: RobotModel, X_WG: SE3, starts: Iterable[np.ndarray]) -> np.ndarray | None:
    """A configuration (7,) within the limits with the gripper at X_WG; None if no start (7,) gets there in 60 steps.

    The first start that gets there counts.
    """
    data = robot.data()
    for start in starts:
        q = np.clip(start, robot.q_min, robot.q_max)
        for _ in range(_ITERATIONS):
            pin.framesForwardKinematics(robot.model, data, q)
            error = pin.log6(data.oMf[robot.tcp_id].actInv(X_WG)).vector
            if np.abs(error).max() < TOLERANCE:
                return q
            jacobian = pin.computeFrameJacobian(robot.model, data, q, robot.tcp_id, pin.LOCAL)
            step = _step(robot, q, jacobian, error)
            if step is None:
                break
            q = np.clip(q + step, robot.q_min, robot.q_max)
    return None


def track_numerically(robot: RobotModel, path: CartesianPath, start: np.ndarray) -> np.ndarray | None:
    """A joint path (n,7) through all poses going on from `start` (7,), or None if the arm gets stuck or must jump."""
    found = [np.array(start, dtype=float)]
    for R_WG, p_WG in zip(path.R_WG, path.p_WG, strict=True):
        q = solve_numerically(robot, SE3(R_WG, p_WG), [found[-1]])
        if q is None or np.abs(q - found[-1]).max() > MAX_JOINT_STEP:
            return None
        found.append(q)
    return np.array(found[1:])


def _step(robot: RobotModel, q: np.ndarray, jacobian: np.ndarray, error: np.ndarray) -> np.ndarray | None:
    # Half a second of imports, and few programs come here.
    import qpsolvers
    from scipy.sparse import csc_matrix

    damping = _DAMPING * float(error @ error) + _FLOOR
    with warnings.catch_warnings():
        # A step that the solver calls inaccurate comes back as None; the next start is tried.
        warnings.simplefilter("ignore")
        return qpsolvers.solve_qp(
            P=csc_matrix(jacobian.T @ jacobian + damping * np.eye(7)),
            q=-jacobian.T @ error,
            lb=np.maximum(robot.q_min - q, -_MAX_STEP),
            ub=np.minimum(robot.q_max - q, _MAX_STEP),
            solver="osqp",
            raise_error=False,
            eps_abs=1e-8,
            eps_rel=1e-8,
            max_iter=4000,
        )
