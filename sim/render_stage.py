"""What stands before the camera: visual shapes in a PyBullet client of their own, no physics."""

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import TracebackType
from typing import Literal

import numpy as np
import pinocchio as pin
import pybullet as p
from pinocchio import SE3

from scenarios.regions import parts
from scenarios.scenario import Scenario
from scenarios.shapes import Box, Shape
from sim.bullet_bodies import resolved_urdf
from sim.bullet_shapes import add_visual_shape
from sim.render_camera import Camera, Window, distances
from sim.render_egl import load_egl
from sim.robot import RobotModel
from sim.scene import floor_height, pedestal

Color = tuple[float, float, float, float]
FLOOR: Color = (0.90, 0.905, 0.915, 1.0)
PEDESTAL: Color = (0.45, 0.47, 0.50, 1.0)
TABLE: Color = (0.88, 0.77, 0.62, 1.0)
LEGS: Color = (0.58, 0.46, 0.34, 1.0)
CONTAINERS: Mapping[str, Color] = {"bin": (0.53, 0.63, 0.73, 1.0), "dustpan": (0.66, 0.42, 0.60, 1.0)}
LEG = 0.05
FLOOR_SIZE = 14.0
LINK_REACH = 0.26
"""Metres from a link's origin to its farthest point, with some to spare."""

LIGHT_FROM = np.array([-0.45, -0.75, 2.0])
"""Direction from the scene to the light, in W."""

Engine = Literal["egl", "tiny"]


class Stage:
    """Visual shapes and a way to look at them. A context manager; `close` frees the engine."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        with _quiet():
            self.client = p.connect(p.DIRECT)
            if engine == "egl" and not load_egl(self.client):
                raise RuntimeError("the EGL renderer could not be loaded; use engine 'tiny'")

    def __enter__(self) -> "Stage":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the engine."""
        with _quiet():
            p.disconnect(self.client)

    def add(self, shape: Shape, X_WO: SE3, color: Color) -> int:
        """Put a shape at X_WO; its number for `put`."""
        visual = add_visual_shape(shape, self.client, rgbaColor=color, specularColor=(0.0, 0.0, 0.0))
        pose = pin.SE3ToXYZQUAT(X_WO)
        return p.createMultiBody(0.0, -1, visual, list(pose[:3]), list(pose[3:]), physicsClientId=self.client)

    def put(self, number: int, pose: np.ndarray) -> None:
        """Move a shape to a pose (7,): position and quaternion xyzw in W."""
        p.resetBasePositionAndOrientation(number, pose[:3].tolist(), pose[3:].tolist(), physicsClientId=self.client)

    def look(self, camera: Camera, window: Window | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Colours (height, width, 3) uint8 and distances (height, width) in metres ahead of the camera.

        window: the part of the picture that is wanted.
        """
        _, _, width, height = window = window or (0, 0, camera.width, camera.height)
        seen = p.getCameraImage(
            width,
            height,
            camera.view.T.ravel().tolist(),
            camera.projection_of(window).T.ravel().tolist(),
            lightDirection=LIGHT_FROM.tolist(),
            lightColor=[1.0, 1.0, 1.0],
            lightAmbientCoeff=0.62,
            lightDiffuseCoeff=0.42,
            lightSpecularCoeff=0.0,
            shadow=0,
            flags=p.ER_NO_SEGMENTATION_MASK,
            renderer=p.ER_BULLET_HARDWARE_OPENGL if self.engine == "egl" else p.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        colours = np.asarray(seen[2], dtype=np.uint8).reshape(height, width, 4)[:, :, :3]
        depth = np.asarray(seen[3], dtype=np.float32).reshape(height, width)
        return colours, distances(depth)


class ArmOnStage:
    """The robot, to be put into any configuration."""

    def __init__(self, stage: Stage, scenario: Scenario) -> None:
        self._model = robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
        pose = pin.SE3ToXYZQUAT(scenario.robot.X_WB)
        self._client = stage.client
        with resolved_urdf(robot) as path:
            self._robot = p.loadURDF(
                path, list(pose[:3]), list(pose[3:]), useFixedBase=True, physicsClientId=self._client
            )
        joints = range(p.getNumJoints(self._robot, physicsClientId=self._client))
        kinds = {joint: p.getJointInfo(self._robot, joint, physicsClientId=self._client)[2] for joint in joints}
        self._arm = [joint for joint, kind in kinds.items() if kind == p.JOINT_REVOLUTE]
        self._fingers = [joint for joint, kind in kinds.items() if kind == p.JOINT_PRISMATIC]

    def places(self, q: np.ndarray, opening: float) -> np.ndarray:
        """Origins (n,3) in W of the links at q (7,); each link lies within LINK_REACH of its own."""
        return np.array([X_WL.translation for X_WL in self._model.link_poses(q, opening).values()])

    def put(self, q: np.ndarray, opening: float) -> None:
        """Set the arm to q (7,) in rad, the fingers `opening` metres apart."""
        for joint, angle in zip(self._arm, q, strict=True):
            p.resetJointState(self._robot, joint, float(angle), physicsClientId=self._client)
        for joint in self._fingers:
            p.resetJointState(self._robot, joint, opening / 2, physicsClientId=self._client)


def add_room(stage: Stage, scenario: Scenario) -> None:
    """Everything that never moves: floor, pedestal, table, containers, fixtures, and what holds them up."""
    floor = floor_height(scenario)
    stage.add(Box((FLOOR_SIZE, FLOOR_SIZE, 0.02)), SE3(np.eye(3), np.array([0.0, 0.0, floor - 0.01])), FLOOR)
    block = pedestal(scenario)
    if block is not None:
        stage.add(*block, PEDESTAL)
    table = scenario.table
    stage.add(table.shape, table.X_WT, TABLE)
    half = np.array(table.size) / 2
    for x in (LEG - half[0], half[0] - LEG):
        for y in (LEG - half[1], half[1] - LEG):
            _add_post(stage, table.X_WT.act(np.array([x, y, -half[2]])), floor, LEG)
    for region in scenario.regions.values():
        for shape, X_RP in parts(region):
            stage.add(shape, region.X_WR * X_RP, CONTAINERS[region.kind])
        _add_post(stage, region.X_WR.act(np.array([0.0, 0.0, -region.size[2] / 2])), floor, LEG / 2)
    for fixture in scenario.fixtures.values():
        stage.add(fixture.shape, fixture.X_WO, fixture.color)


def _add_post(stage: Stage, top: np.ndarray, floor: float, thickness: float) -> None:
    """An upright from the floor to a point: what stands on nothing looks wrong."""
    height = float(top[2]) - floor
    if height > 0.005:
        centre = np.array([top[0], top[1], floor + height / 2])
        stage.add(Box((thickness, thickness, height)), SE3(np.eye(3), centre), LEGS)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the engine's chatter, written past Python, out of the terminal."""
    sys.stdout.flush()
    kept = os.dup(1)
    sink = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(sink)
