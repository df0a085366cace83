"""The scene as believed: the declared scenario, and where its movable bodies and the arm are.

The planner predicts with it and the executive observes into it; both see the same type.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from pinocchio import SE3

from scenarios.scenario import Scenario
from scenarios.shapes import Box, Shape, reach

PEDESTAL_SIZE = 0.24
"""Side in metres of the square block under a robot whose base is above the floor."""


@dataclass(frozen=True)
class Held:
    """What the hand holds: the body's name and its pose X_GO in the gripper frame G."""

    name: str
    X_GO: SE3


@dataclass(frozen=True)
class SceneState:
    """Poses X_WO of all movable bodies, the arm's configuration q (7,) in rad, the hand's opening in metres.

    `held` is None for an empty hand. A held body's entry in `poses` is where it was observed or
    predicted to be; `held.X_GO` says how it moves along with the hand.
    """

    scenario: Scenario
    poses: Mapping[str, SE3]
    q: np.ndarray
    opening: float
    held: Held | None = None

    def __post_init__(self) -> None:
        q = np.array(self.q, dtype=float)
        q.setflags(write=False)
        object.__setattr__(self, "q", q)
        object.__setattr__(self, "poses", MappingProxyType(dict(self.poses)))

    @staticmethod
    def initial(scenario: Scenario, opening: float) -> "SceneState":
        """The scenario's start: every body that is there at its declared pose, the arm at q0, the hand empty."""
        poses = {name: body.X_WO for name, body in scenario.bodies.items() if name not in scenario.late}
        return SceneState(scenario, poses, scenario.robot.q0, opening)

    def moved(self, name: str, X_WO: SE3) -> "SceneState":
        """The same scene with one body elsewhere."""
        return replace(self, poses={**self.poses, name: X_WO})

    def without(self, names: frozenset[str]) -> "SceneState":
        """The same scene with the named bodies taken out of the world (they obstruct nothing)."""
        if names.isdisjoint(self.poses):
            return self
        return replace(self, poses={n: X for n, X in self.poses.items() if n not in names})


ON_FLOOR = 0.01
"""Metres above the floor up to which something is on it."""


def pose_distance(X_WA: SE3, X_WB: SE3) -> tuple[float, float]:
    """Distance in metres and angle in rad between two poses."""
    if X_WA is X_WB:  # A body that lies still is observed as the same object again.
        return 0.0, 0.0
    cosine = (float(np.vdot(X_WA.rotation, X_WB.rotation)) - 1.0) / 2.0  # vdot(A, B) is the trace of Aᵀ B
    distance = math.dist(X_WA.translation.tolist(), X_WB.translation.tolist())
    return distance, math.acos(min(max(cosine, -1.0), 1.0))


def floor_height(scenario: Scenario) -> float:
    """Height in metres of the floor: level with the lowest of robot base, table, regions and fixtures."""
    bottoms = [float(scenario.robot.X_WB.translation[2]), _bottom(scenario.table.shape, scenario.table.X_WT)]
    bottoms += [_bottom(Box(region.size), region.X_WR) for region in scenario.regions.values()]
    bottoms += [_bottom(fixture.shape, fixture.X_WO) for fixture in scenario.fixtures.values()]
    return min(bottoms)


def is_on_floor(scene: SceneState, name: str) -> bool:
    """Does a body touch the floor?"""
    X_WO = scene.poses[name]
    lowest = float(X_WO.translation[2]) - depth_below(scene.scenario.bodies[name].shape, X_WO.rotation)
    return lowest < floor_height(scene.scenario) + ON_FLOOR


def pedestal(scenario: Scenario) -> tuple[Box, SE3] | None:
    """The block between the floor and the robot's base with its pose in W; None if the base stands on the floor."""
    base = scenario.robot.X_WB.translation
    floor = floor_height(scenario)
    height = float(base[2]) - floor
    if height <= 0.0:
        return None
    centre = np.array([base[0], base[1], floor + height / 2])
    return Box((PEDESTAL_SIZE, PEDESTAL_SIZE, height)), SE3(np.eye(3), centre)


def height_above(shape: Shape, R_WO: np.ndarray) -> float:
    """How far in metres a shape turned by R_WO reaches above its origin."""
    return reach(shape, R_WO[2])


def depth_below(shape: Shape, R_WO: np.ndarray) -> float:
    """How far in metres a shape turned by R_WO reaches below its origin."""
    return reach(shape, -R_WO[2])


def _bottom(shape: Shape, X_WO: SE3) -> float:
    return float(X_WO.translation[2]) - depth_below(shape, X_WO.rotation)
