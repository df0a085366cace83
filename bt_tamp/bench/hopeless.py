"""Motion queries that nothing solves, made from those that something does: the goal in collision, or walled in."""

from dataclasses import dataclass, replace

import numpy as np
from pinocchio import SE3

from bt_tamp.bench.motion_queries import MotionQuery
from planner.motion.motion_planner import MotionPlanner
from scenarios.scenario import Fixture
from scenarios.shapes import Box
from sim.robot import RobotModel
from sim.scene import SceneState

DEPTH, DEEPEST = 0.01, 0.15
"""Metres by which the hand is lowered at a time, and at most, until it collides."""

ROOM = 0.03
"""Metres between the forearm and the walls around it: the hand, 15 cm wide, does not pass."""

LENGTH, THICKNESS = 0.12, 0.03
WRIST_RADIUS = 0.09


@dataclass(frozen=True)
class Hopeless:
    """A query without a way, and why: "goal in collision" or "walled in"."""

    kind: str
    query: MotionQuery


def lowered(motion: MotionPlanner, query: MotionQuery) -> Hopeless | None:
    """The same way to where the hand, held as at the goal, is so low that something collides."""
    X_WG = motion.robot.X_WG(query.goal)
    for depth in np.arange(DEPTH, DEEPEST, DEPTH):
        found = motion.ik(SE3(X_WG.rotation, X_WG.translation - [0.0, 0.0, depth]))
        near = min(found, key=lambda q: float(np.abs(q - query.goal).max()), default=None)
        if near is not None and not motion.free(query.scene, near):
            return Hopeless("goal in collision", replace(query, goal=near))
    return None


def walled(motion: MotionPlanner, query: MotionQuery) -> Hopeless | None:
    """The same way with fixed walls around the forearm at the goal; None if start or goal collides with them."""
    scene = _with_walls(query.scene, _forearm(motion.robot, query.goal))
    if all(motion.free(replace(scene, q=q), q) for q in (scene.q, query.goal)):
        return Hopeless("walled in", replace(query, scene=scene))
    return None


def _forearm(robot: RobotModel, q: np.ndarray) -> SE3:
    """A frame half way from elbow to wrist, z along the forearm, in W."""
    poses = robot.link_poses(q, 0.0)
    elbow, wrist = poses["link_4"].translation, poses["link_6"].translation
    z = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return SE3(np.column_stack([x, np.cross(z, x), z]), (elbow + wrist) / 2)


def _with_walls(scene: SceneState, X_WF: SE3) -> SceneState:
    """Four walls around the z axis of frame F."""
    inner = WRIST_RADIUS + ROOM
    fixtures = dict(scene.scenario.fixtures)
    for number in range(4):
        turn = SE3(_quarter_turns(number), np.zeros(3))
        X_WO = X_WF * turn * SE3(np.eye(3), np.array([inner + THICKNESS / 2, 0.0, 0.0]))
        shape = Box((THICKNESS, 2 * (inner + THICKNESS), LENGTH))
        fixtures[f"wall_{number}"] = Fixture(f"wall_{number}", shape, X_WO, 0.5, (0.5, 0.5, 0.5, 1.0))
    return replace(scene, scenario=replace(scene.scenario, fixtures=fixtures))


def _quarter_turns(number: int) -> np.ndarray:
    c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[number]
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
