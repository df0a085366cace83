"""Whether a run of a scene can begin: the robot stands free, and what is to go wrong can be waited for."""

import numpy as np
from pinocchio import SE3

from planner.motion.clearance import DEEPEST
from planner.motion.exact import ExactChecker
from planner.motion.world import Margins
from scenarios.names import known
from scenarios.scenario import Scenario
from scenarios.shapes import Cylinder
from scenarios.solids import Solid, body_solid, overlapping, region_solid, table_solid
from sim.robot import RobotModel
from sim.scene import SceneState
from skills.catalogue import phases

FOOT_RADIUS = 0.09
FOOT_HEIGHT = 0.1
FOOT_GAP = 0.005
"""Metres: the part of the robot's base that must be free, a little above what it stands on."""


def start_problem(scenario: Scenario) -> tuple[str, str] | None:
    """The key that is at fault, and why the robot can't begin there, as a phrase; or None."""
    robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
    scene = SceneState.initial(scenario, robot.gripper.stroke)
    still = [table_solid(scenario.table), *map(region_solid, scenario.regions.values())]
    still += map(body_solid, scenario.fixtures.values())
    things = [body_solid(scenario.bodies[name], X_WO) for name, X_WO in scene.poses.items()]
    up = SE3(np.eye(3), np.array([0.0, 0.0, FOOT_GAP + FOOT_HEIGHT / 2]))
    foot = Solid("base", ((Cylinder(FOOT_RADIUS, FOOT_HEIGHT), scenario.robot.X_WB * up),))
    hit = overlapping(foot, [*still, *things])
    if hit is not None:
        return "robot.base", f"the robot's base stands in {hit!r}, expected a free place"
    contacts = ExactChecker(robot, scene, Margins(DEEPEST)).contacts(scenario.robot.q0[None])
    if contacts:
        hits = ", ".join(sorted("–".join(sorted(contact.pair)) for contact in contacts))
        return "robot.q0_deg", f"the arm starts in collision ({hits}), expected a free posture"
    return None


def phase_problem(scenario: Scenario) -> tuple[str, str] | None:
    """The key of the first disturbance that waits for a phase or an action that no skill has, and what there is; or
    None."""
    moments = enumerate(one.moment for one in scenario.disturbances)
    waiting = [(number, (moment.phase, moment.action)) for number, moment in moments if moment.at is None]
    by_action = phases()
    for number, (phase, action) in waiting:
        key = f"disturbances[{number}]"
        if action is not None and action not in by_action:
            return f"{key}.action", f"unknown action {action!r}, {known(action, by_action)}"
        names = by_action[action] if action is not None else {name for own in by_action.values() for name in own}
        if phase not in names:
            of = f" of {action}" if action is not None else ""
            return f"{key}.phase", f"unknown phase {phase!r}{of}, {known(phase, names)}"
    return None
