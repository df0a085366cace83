"""Random flat boxes, each alone on a table somewhere around the robot: layouts of `bench drag`."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from scenarios.scenario import Body, Fixture, RobotPlacement, Scenario, Table
from scenarios.shapes import Box
from sim.robot import RobotModel

BOX = "box"
COUNT = 50
SEED = 3

DISTANCE = 0.62
"""Metres from the robot's axis to the table's middle."""

DEPTH, WIDTH, PLATE = 0.44, 0.68, 0.05
TOP = 0.05
LEG = (0.06, 0.06, 0.4)
"""Metres: what the table stands on. Without room under the plate no finger gets under an overhang."""

AZIMUTHS = (0, 90, -90)
"""Degrees from the robot's front to the table, in turn: its near edge and the two beside it are four different ones."""

LENGTHS = (0.14, 0.24)
WIDTHS = (0.115, 0.17)
"""Metres: a side that is shorter would be grasped from above as the box lies."""

THICKNESSES = (0.02, 0.04)
MASSES = (0.2, 1.0)
FRICTIONS = (0.2, 0.5)
"""Friction coefficient between box and table."""

BOX_FRICTION = 0.6
RIM = 0.01
HOME = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])


@dataclass(frozen=True)
class Layout:
    """One box on one table: azimuth of the table in degrees, box size (m), mass (kg), friction with the table, pose in
    the table's plane (m, rad)."""

    azimuth: int
    size: tuple[float, float, float]
    mass: float
    friction: float
    x: float
    y: float
    yaw: float

    def scenario(self) -> Scenario:
        """The scene: nothing but the table and the box, which is to be held in the end."""
        angle = np.radians(self.azimuth)
        middle = DISTANCE * np.array([np.cos(angle), np.sin(angle)])
        plate = (*_plate(self.azimuth), PLATE)
        table = Table(plate, SE3(np.eye(3), np.array([*middle, TOP - PLATE / 2])), self.friction / BOX_FRICTION)
        X_WO = SE3(
            pin.rpy.rpyToMatrix(0.0, 0.0, self.yaw),
            np.array([middle[0] + self.x, middle[1] + self.y, TOP + self.size[2] / 2]),
        )
        box = Body(BOX, Box(self.size), self.mass, BOX_FRICTION, (0.25, 0.64, 0.3, 1.0), X_WO)
        q0 = HOME + np.array([angle, *np.zeros(6)])
        robot = RobotPlacement(RobotModel().name, SE3.Identity(), q0)
        X_WL = SE3(np.eye(3), np.array([*middle, TOP - PLATE - LEG[2] / 2]))
        leg = Fixture("leg", Box(LEG), X_WL, BOX_FRICTION, (0.6, 0.6, 0.6, 1.0))
        return Scenario("drag", 0, robot, table, {}, {leg.name: leg}, {BOX: box}, f"(and (holding {BOX}))")


def _plate(azimuth: int) -> tuple[float, float]:
    return (WIDTH, DEPTH) if azimuth % 180 else (DEPTH, WIDTH)


def layouts(count: int = COUNT, seed: int = SEED) -> Iterator[Layout]:
    """Random layouts, the box wholly on the table; the tables in turn."""
    for index in range(count):
        rng = np.random.default_rng([seed, index])
        azimuth = AZIMUTHS[index % len(AZIMUTHS)]
        length, width, thickness = (float(rng.uniform(*span)) for span in (LENGTHS, WIDTHS, THICKNESSES))
        size = (length, width, thickness)
        yaw = float(rng.uniform(-np.pi, np.pi))
        half = np.abs(pin.rpy.rpyToMatrix(0.0, 0.0, yaw)[:2]) @ np.array(size) / 2
        room = np.array(_plate(azimuth)) / 2 - half - RIM
        x, y = (float(value) for value in rng.uniform(-room, room))
        yield Layout(azimuth, size, float(rng.uniform(*MASSES)), float(rng.uniform(*FRICTIONS)), x, y, yaw)
