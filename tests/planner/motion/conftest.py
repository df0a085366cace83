from collections.abc import Callable, Sequence

import numpy as np
import pytest
from pinocchio import SE3, rpy

from planner.motion.motion_planner import MotionPlanner
from scenarios.scenario import Body, Region, RobotPlacement, Scenario, Table
from scenarios.shapes import Box, Shape
from sim.robot import RobotModel
from sim.scene import Held, SceneState

HOME = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])
Thing = tuple[str, Shape, SE3]


def _at(x: float, y: float, z: float, yaw_deg: float = 0.0) -> SE3:
    return SE3(rpy.rpyToMatrix(0.0, 0.0, np.radians(yaw_deg)), np.array([x, y, z]))


def _down(x: float, y: float, z: float, yaw_deg: float = 0.0) -> SE3:
    return SE3(rpy.rpyToMatrix(np.pi, 0.0, np.radians(yaw_deg)), np.array([x, y, z]))


def _table(things: Sequence[Thing], X_WB: SE3 | None = None) -> Scenario:
    """A table before the robot, a tray beyond its −y edge, a bin on either side, and things."""
    regions = [
        Region("right_bin", "bin", (0.36, 0.36, 0.13), 0.01, _at(0.05, -0.62, -0.145), 0.4),
        Region("left_bin", "bin", (0.36, 0.36, 0.13), 0.01, _at(0.05, 0.62, -0.145), 0.4),
        Region("dustpan", "dustpan", (0.27, 0.15, 0.055), 0.01, _at(0.675, -0.355, -0.0075), 0.4, open_side="+y"),
    ]
    bodies = [Body(name, shape, 0.2, 0.6, (0.5, 0.5, 0.5, 1.0), X_WO) for name, shape, X_WO in things]
    return Scenario(
        name="table",
        seed=0,
        robot=RobotPlacement("iiwa14_wsg50", SE3.Identity() if X_WB is None else X_WB, HOME),
        table=Table((0.44, 0.70, 0.05), _at(0.62, 0.07, 0.025), 0.3),
        regions={region.name: region for region in regions},
        fixtures={},
        bodies={b.name: b for b in bodies},
        goal="(and)",
    )


@pytest.fixture(scope="session")
def at() -> Callable[..., SE3]:
    """Pose at x, y, z with a yaw in degrees."""
    return _at


@pytest.fixture(scope="session")
def down() -> Callable[..., SE3]:
    """Gripper pose at x, y, z that points straight down."""
    return _down


@pytest.fixture(scope="session")
def table() -> Callable[..., Scenario]:
    """The table with given things on it."""
    return _table


@pytest.fixture(scope="session")
def robot() -> RobotModel:
    return RobotModel()


@pytest.fixture(scope="session")
def scene() -> SceneState:
    """The table with a box, a flat book, two crumbs, and a sponge in the tray."""
    crumb = Box((0.025, 0.025, 0.025))
    things = [
        ("box", Box((0.06, 0.06, 0.15)), _at(0.73, -0.08, 0.125)),
        ("book", Box((0.16, 0.22, 0.03)), _at(0.55, -0.05, 0.065)),
        ("carrot", crumb, _at(0.73, 0.08, 0.0625)),
        ("tomato", crumb, _at(0.60, 0.13, 0.0625)),
        ("sponge", Box((0.10, 0.06, 0.04)), _at(0.675, -0.35, -0.005)),
    ]
    return SceneState.initial(_table(things), opening=0.1)


@pytest.fixture(scope="session")
def sponge_in_hand(scene: SceneState) -> SceneState:
    """The sponge held by its long ends, 2.5 cm of it below the fingertips."""
    turned = SE3(rpy.rpyToMatrix(np.pi, 0.0, np.pi / 2), np.array([0.0, 0.0, 0.005]))
    return SceneState(scene.scenario, scene.poses, scene.q, 0.1, Held("sponge", turned))


@pytest.fixture
def planner(robot: RobotModel) -> MotionPlanner:
    return MotionPlanner(robot, seed=0)
