"""What is in the hand, from static readings of the wrist sensor: one small QP."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from qpsolvers import solve_qp
from scipy import sparse

from sim.plant import Observation
from sim.robot import GRAVITY, RobotModel
from sim.wrench import Wrench
from skills.control.contact import hand_inertia

REACH = 0.15
"""Largest distance in metres, along each axis of G, of a load's centre of mass from the tool centre."""


def estimate_payload(robot: RobotModel, samples: Sequence[Observation]) -> tuple[float, np.ndarray]:
    """Mass in kg (≥ 0) and centre of mass com_G (3,) in metres of a load held still in the air.

    `robot` is the model without the load. One sample gives the mass and where the line of action
    runs; two hand orientations or more give the whole centre of mass. Along a direction that the
    samples say nothing about, the centre is taken at the tool centre.

    Raises ValueError without samples and when no solution is found.
    """
    if not samples:
        raise ValueError("payload estimation needs at least one wrist reading, got none")
    regressor, residual = [], []
    for sample in samples:
        g, beyond_hand = _felt(robot, sample)
        # In the unknowns (m, m c): force m g, torque (m c) × g.
        block = np.zeros((6, 4))
        block[:3, 0] = g
        block[3:, 1:] = -pin.skew(g)
        regressor.append(block)
        residual.append(beyond_hand.vector)
    A, b = np.vstack(regressor), np.concatenate(residual)
    # Torques are small numbers: in units of 0.1 m they weigh as much as the forces.
    scale = np.tile([1.0, 1.0, 1.0, 10.0, 10.0, 10.0], len(samples))
    moments_within_reach = np.array([[-REACH, *row] for sign in (1, -1) for row in sign * np.eye(3)])
    A, b = A * scale[:, None], b * scale
    solution = solve_qp(
        sparse.csc_matrix(A.T @ A + 1e-6 * np.eye(4)),
        -A.T @ b,
        G=sparse.csc_matrix(moments_within_reach),
        h=np.zeros(6),
        lb=np.array([0.0, -np.inf, -np.inf, -np.inf]),
        solver="osqp",
        eps_abs=1e-9,
        eps_rel=1e-9,
        max_iter=20000,
    )
    if solution is None:
        raise ValueError(f"no load explains the {len(samples)} wrist readings")
    mass = max(float(solution[0]), 0.0)
    com = solution[1:] / mass if mass > 1e-3 else np.zeros(3)
    return mass, com


def wrist_error(robot: RobotModel, samples: Sequence[Observation]) -> Wrench:
    """What the wrist sensor reads, on average, beyond the weight of the empty hand held still: its error, in its own
    frame. Raises ValueError without samples."""
    if not samples:
        raise ValueError("the wrist's error needs at least one reading, got none")
    beyond_hand = [robot.X_EG.act(_felt(robot, sample)[1]).vector for sample in samples]
    mean = np.mean(beyond_hand, axis=0)
    return Wrench(mean[:3], mean[3:])


def _felt(robot: RobotModel, sample: Observation) -> tuple[np.ndarray, pin.Force]:
    """Gravity (3,) in G, and what the wrist feels beyond the weight of the empty hand, in G."""
    data = robot.data()
    pin.forwardKinematics(robot.model, data, sample.q)
    rotation = pin.updateFramePlacement(robot.model, data, robot.tcp_id).rotation
    g = rotation.T @ np.array([0.0, 0.0, -GRAVITY])
    felt = robot.X_EG.actInv(pin.Force(sample.wrist.vector))
    return g, felt - hand_inertia(robot) * pin.Motion(g, np.zeros(3))
