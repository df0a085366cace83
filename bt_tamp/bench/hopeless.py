"""Motion queries that nothing solves, made from those that something does: the goal in collision, or walled in."""

from dataclasses import dataclass, replace

import numpy as np
from pinocchio import SE3

from bt_tamp.bench.motion_queries import MotionQuery
from planner.motion.motion_planner import MotionPlanner
from scenarios.scenario import Fixture
from scenarios.shapes import Box, bounding_radius
from sim.robot import RobotModel
from sim.scene import SceneState

DEPTH, DEEPEST = 0.01, 0.15
"""Metres by which the hand is lowered at a time, and at most, until it collides."""

LINK = "link_5"
"""The link that the walls stand around."""

ROOM = 0.01
"""Metres between that link and the walls: too little to be drawn out by chance, though it is no proof."""

LENGTH, THICKNESS = 0.06, 0.03


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
    """The same way with fixed walls close about the forearm at the goal; None if start or goal hits them."""
    scene = _with_walls(query.scene, *_forearm(motion.robot, query.goal))
    if all(motion.free(replace(scene, q=q), q) for q in (scene.q, query.goal)):
        return Hopeless("walled in", replace(query, scene=scene))
    return None


def _forearm(robot: RobotModel, q: np.ndarray) -> tuple[SE3, np.ndarray]:
    """A frame in W amid the link's solids, z from elbow to wrist, and half of their extents along its x and y."""
    poses = robot.link_poses(q, 0.0)
    z = poses["link_6"].translation - poses["link_4"].translation
    z /= np.linalg.norm(z)
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    R_WF = np.column_stack([x, np.cross(z, x), z])
    solids = [solid for solid in robot.geometry if solid.link == LINK]
    centres = np.array([(poses[LINK] * solid.X_LS).translation for solid in solids]) @ R_WF
    reach = np.array([bounding_radius(solid.shape) for solid in solids])[:, None]
    lower, upper = (centres - reach).min(axis=0), (centres + reach).max(axis=0)
    return SE3(R_WF, R_WF @ ((lower + upper) / 2)), (upper - lower)[:2] / 2


def _with_walls(scene: SceneState, X_WF: SE3, half: np.ndarray) -> SceneState:
    """Four walls around the z axis of frame F, ROOM outside half extents (2,) along its x and y."""
    inner = half + ROOM
    fixtures = dict(scene.scenario.fixtures)
    for number in range(4):
        away, across = inner if number % 2 == 0 else inner[::-1]
        wall = SE3(np.eye(3), np.array([away + THICKNESS / 2, 0.0, 0.0]))
        X_WO = X_WF * SE3(_quarter_turns(number), np.zeros(3)) * wall
        shape = Box((THICKNESS, 2 * (float(across) + THICKNESS), LENGTH))
        fixtures[f"wall_{number}"] = Fixture(f"wall_{number}", shape, X_WO, 0.5, (0.5, 0.5, 0.5, 1.0))
    return replace(scene, scenario=replace(scene.scenario, fixtures=fixtures))


def _quarter_turns(number: int) -> np.ndarray:
    c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[number]
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
