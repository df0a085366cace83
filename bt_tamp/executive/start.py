"""Whether the robot can stand and begin where a scene has it."""

import numpy as np
from pinocchio import SE3

from planner.motion.exact import ExactChecker
from planner.motion.motion_planner import DEEPEST
from planner.motion.world import Margins
from scenarios.scenario import Scenario
from scenarios.shapes import Cylinder
from scenarios.solids import Solid, body_solid, overlapping, region_solid, table_solid
from sim.robot import RobotModel
from sim.scene import SceneState

FOOT_RADIUS = 0.09
FOOT_HEIGHT = 0.1
FOOT_GAP = 0.005
"""Metres: the part of the robot's base that must be free, a little above what it stands on."""


def start_problem(scenario: Scenario) -> tuple[str, str] | None:
    """The key in `robot` that is at fault, and why the robot can't begin there, as a phrase; or None."""
    robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
    scene = SceneState.initial(scenario, robot.gripper.stroke)
    still = [table_solid(scenario.table), *map(region_solid, scenario.regions.values())]
    still += map(body_solid, scenario.fixtures.values())
    things = [body_solid(scenario.bodies[name], X_WO) for name, X_WO in scene.poses.items()]
    up = SE3(np.eye(3), np.array([0.0, 0.0, FOOT_GAP + FOOT_HEIGHT / 2]))
    foot = Solid("base", ((Cylinder(FOOT_RADIUS, FOOT_HEIGHT), scenario.robot.X_WB * up),))
    hit = overlapping(foot, [*still, *things])
    if hit is not None:
        return "base", f"the robot's base stands in {hit!r}, expected a free place"
    contacts = ExactChecker(robot, scene, Margins(DEEPEST)).contacts(scenario.robot.q0[None])
    if contacts:
        hits = ", ".join(sorted("–".join(sorted(contact.pair)) for contact in contacts))
        return "q0_deg", f"the arm starts in collision ({hits}), expected a free posture"
    return None
