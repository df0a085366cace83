import numpy as np
import pytest
from pinocchio import SE3, rpy

from scenarios.scenario import Body, Region, RobotPlacement, Scenario, Table
from scenarios.shapes import Box, Shape
from sim.robot import RobotModel
from sim.scene import Held, SceneState

GREY = (0.5, 0.5, 0.5, 1.0)
HOME = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])


def at(x: float, y: float, z: float, yaw_deg: float = 0.0) -> SE3:
    return SE3(rpy.rpyToMatrix(0.0, 0.0, np.radians(yaw_deg)), np.array([x, y, z]))


def body(name: str, shape: Shape, X_WO: SE3, tool: str | None = None) -> Body:
    return Body(name, shape, mass=0.2, friction=0.6, color=GREY, X_WO=X_WO, tool=tool)


def cleared_table(bodies: list[Body]) -> Scenario:
    """A table before the robot, a tray beyond its −y edge, a bin on either side."""
    bins = {
        name: Region(name, "bin", (0.36, 0.36, 0.13), 0.01, at(0.05, y, -0.145), 0.4)
        for name, y in (("right_bin", -0.62), ("left_bin", 0.62))
    }
    tray = Region("dustpan", "dustpan", (0.25, 0.14, 0.055), 0.01, at(0.675, -0.35, -0.0075), 0.4, open_side="+y")
    return Scenario(
        name="table",
        seed=0,
        robot=RobotPlacement("iiwa14_wsg50", SE3.Identity(), HOME),
        table=Table((0.44, 0.70, 0.05), at(0.62, 0.07, 0.025), 0.3),
        regions={**bins, "dustpan": tray},
        fixtures={},
        bodies={b.name: b for b in bodies},
        goal="(and)",
    )


@pytest.fixture(scope="session")
def robot() -> RobotModel:
    return RobotModel()


@pytest.fixture(scope="session")
def scenario() -> Scenario:
    cube = Box((0.025, 0.025, 0.025))
    return cleared_table(
        [
            body("box", Box((0.06, 0.06, 0.15)), at(0.73, -0.08, 0.125)),
            body("book", Box((0.16, 0.22, 0.03)), at(0.55, -0.05, 0.065)),
            body("carrot", cube, at(0.73, 0.08, 0.0625)),
            body("tomato", cube, at(0.60, 0.13, 0.0625)),
            body("sponge", Box((0.10, 0.06, 0.04)), at(0.675, -0.35, -0.005), tool="sponge"),
        ]
    )


@pytest.fixture
def scene(scenario: Scenario) -> SceneState:
    return SceneState.initial(scenario, opening=0.1)


@pytest.fixture
def scene_with_sponge(scene: SceneState) -> SceneState:
    """The sponge in the hand by its long ends, 1.5 cm of it below the fingertips, its long side along y of G."""
    turned = SE3(rpy.rpyToMatrix(np.pi, 0.0, np.pi / 2), np.array([0.0, 0.0, -0.005]))
    return SceneState(scene.scenario, scene.poses, scene.q, 0.1, Held("sponge", turned))
