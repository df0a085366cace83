"""From observations to the believed scene: where things are, and what the hand holds."""

import numpy as np
from pinocchio import SE3

from scenarios.scenario import Scenario
from scenarios.shapes import Box, Compound, Cylinder, Hull, Shape, Sphere, outline
from sim.plant import Observation
from sim.robot import RobotModel
from sim.scene import Held, SceneState

GRIP_FORCE = 5.0
"""Newtons below which the fingers hold nothing."""

GRASP_REACH = 0.008
KEEP_REACH = 0.025
"""Metres from the pads' middle within which a body counts as grasped, and as still held (hysteresis)."""

PAD_DEPTH = 0.01
FINGERS_AT_REST = 0.01


class Belief:
    """Keeps the believed scene; only `holding` needs memory, for its hysteresis."""

    def __init__(self, scenario: Scenario, robot: RobotModel) -> None:
        self._scenario = scenario
        self._robot = robot
        self._held: str | None = None

    def update(self, observation: Observation, is_closing: bool) -> SceneState:
        """The scene as believed after an observation; `is_closing`: the fingers are told to press."""
        X_WG = self._robot.X_WG(observation.q)
        self._held = self._held_name(observation, X_WG, is_closing)
        held = None
        if self._held is not None:
            held = Held(self._held, X_WG.inverse() * observation.poses[self._held])
        return SceneState(self._scenario, observation.poses, observation.q, observation.opening, held)

    def _held_name(self, observation: Observation, X_WG: SE3, is_closing: bool) -> str | None:
        if not is_closing or observation.grip_force < GRIP_FORCE:
            return None
        if abs(observation.opening_velocity) > FINGERS_AT_REST and self._held is None:
            return None
        pads = X_WG.act(np.array([0.0, 0.0, -PAD_DEPTH]))
        gaps = {
            name: distance_to(self._scenario.bodies[name].shape, X_WO.actInv(pads))
            for name, X_WO in observation.poses.items()
        }
        if not gaps:
            return None
        if self._held is not None and gaps.get(self._held, np.inf) < KEEP_REACH:
            return self._held
        nearest = min(gaps, key=lambda name: gaps[name])
        return nearest if gaps[nearest] < GRASP_REACH else None


def distance_to(shape: Shape, p_O: np.ndarray) -> float:
    """Distance in metres from a point p_O (3,), in the shape's frame, to the shape; 0 inside.

    What lies in a compound's hollow is inside: fingers that hold a mug from without have nothing between their middles.
    Beyond an edge of a hull it is the distance to the nearer face's plane, which is less.
    """
    match shape:
        case Box(size):
            return float(np.linalg.norm(np.maximum(np.abs(p_O) - np.array(size) / 2, 0.0)))
        case Cylinder(radius, height):
            radial = max(float(np.hypot(p_O[0], p_O[1])) - radius, 0.0)
            return float(np.hypot(radial, max(abs(float(p_O[2])) - height / 2, 0.0)))
        case Sphere(radius):
            return max(float(np.linalg.norm(p_O)) - radius, 0.0)
        case Hull() | Compound():
            return max(outline(shape).outside(p_O), 0.0)
