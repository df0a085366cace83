"""The benchmarks' own small scene: a sponge on a bare table, and how the true one differs from it."""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from scenarios.scenario import Body, RobotPlacement, Scenario, Table
from scenarios.shapes import Box
from sim.robot import RobotModel

TABLE_TOP = 0.05
STROKE_X = 0.58
STROKE = 0.35
"""Metres from y = −STROKE/2 to +STROKE/2 at x = STROKE_X."""

SPONGE = "sponge"
HEIGHT = 0.05
HOME = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])


@dataclass(frozen=True)
class Truth:
    """How the true world differs from the one believed in.

    table_height: metres added to the table's. tilt: the table's plane is turned by as many rad about the diagonal
    through the stroke's middle, so that the stroke climbs and leans. friction, stiffness, masses: factors on
    all friction coefficients, on the sponge's stiffness, and on the masses of the sponge, the hand and all
    moving links of the arm.
    """

    table_height: float = 0.0
    tilt: float = 0.0
    friction: float = 1.0
    stiffness: float = 1.0
    masses: float = 1.0


AS_BELIEVED = Truth()


def believed() -> Scenario:
    """The scene as declared: the sponge lies behind the stroke's start, its long side along x."""
    robot = RobotModel()
    plate = 0.05
    table = Table((0.8, 1.2, plate), SE3(np.eye(3), np.array([0.62, 0.0, TABLE_TOP - plate / 2])), 0.4)
    sponge = Body(
        name=SPONGE,
        shape=Box((0.09, 0.06, HEIGHT)),
        mass=0.06,
        friction=0.5,
        color=(0.95, 0.76, 0.2, 1.0),
        X_WO=SE3(np.eye(3), np.array([STROKE_X, -STROKE / 2, TABLE_TOP + HEIGHT / 2])),
        tool="sponge",
        contact_stiffness=2000.0,
        contact_damping=20.0,
    )
    placement = RobotPlacement(robot.name, SE3.Identity(), HOME)
    return Scenario("slide", 0, placement, table, {}, {}, {SPONGE: sponge}, "")


def true_scene(scene: Scenario, truth: Truth) -> Scenario:
    """The scene as it is: the sponge lies on the table that there is."""
    middle = np.array([STROKE_X, 0.0, TABLE_TOP + truth.table_height])
    turn = pin.exp3(truth.tilt * np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0))
    X_WM, X_MW_before = SE3(turn, middle), SE3(np.eye(3), -middle + [0.0, 0.0, truth.table_height])
    move = X_WM * X_MW_before
    table = replace(scene.table, X_WT=move * scene.table.X_WT, friction=scene.table.friction * truth.friction)
    bodies = {name: _true_body(body, move, truth) for name, body in scene.bodies.items()}
    return replace(scene, table=table, bodies=bodies)


def _true_body(body: Body, move: SE3, truth: Truth) -> Body:
    stiffness = body.contact_stiffness
    return replace(
        body,
        X_WO=move * body.X_WO,
        mass=body.mass * truth.masses,
        friction=body.friction * truth.friction,
        contact_stiffness=None if stiffness is None else stiffness * truth.stiffness,
    )


def sponge_height(truth: Truth) -> float:
    """Metres by which the sponge lies higher than believed."""
    scene = believed()
    lies = (true.bodies[SPONGE].X_WO.translation[2] for true in (true_scene(scene, truth), scene))
    return float(next(lies) - next(lies))
