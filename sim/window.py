"""PyBullet's own window: the scene in its middle, seen as in the pictures, without the panels beside it."""

import numpy as np
import pybullet as p

from scenarios.scenario import Scenario
from sim.render_camera import VIEW_FROM

DISTANCE = 1.6
"""Metres from the table to the eye: the arm and the bins beside the table are in sight."""


def frame_scene(scenario: Scenario, client: int) -> None:
    """Turn the window's camera to the table and hide the panels."""
    p.configureDebugVisualizer(p.COV_ENABLE_GUI, 0, physicsClientId=client)
    x, y, z = (scenario.robot.X_WB.rotation @ VIEW_FROM) / np.linalg.norm(VIEW_FROM)
    yaw, pitch = np.degrees([np.arctan2(x, -y), -np.arcsin(z)])
    middle = (scenario.robot.X_WB.translation + 2 * scenario.table.X_WT.translation) / 3
    p.resetDebugVisualizerCamera(DISTANCE, float(yaw), float(pitch), middle.tolist(), physicsClientId=client)
