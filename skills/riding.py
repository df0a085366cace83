"""What stands on the object in the hand rides along with it, and must not be driven into anything."""

from collections.abc import Collection, Iterable

import numpy as np

from planner.motion.trajectory import Trajectory
from scenarios.checks import immovable
from scenarios.solids import body_solid, overlapping
from sim.robot import RobotModel
from sim.scene import SceneState

STEP = 0.05
"""Seconds between the configurations that are looked at."""


def driven_into(
    robot: RobotModel, scene: SceneState, riders: Collection[str], motions: Iterable[Trajectory]
) -> str | None:
    """The name of what one of the riders would hit if it kept its place to the hand during the motions, or None."""
    if not riders or scene.held is None:
        return None
    scenario, own = scene.scenario, {*riders, scene.held.name}
    others = immovable(scenario)
    others += [body_solid(scenario.bodies[name], X_WO) for name, X_WO in scene.poses.items() if name not in own]
    X_GW = robot.X_WG(scene.q).inverse()
    for motion in motions:
        for t in np.arange(STEP, motion.duration, STEP):
            X_WW = robot.X_WG(motion.at(t)[0]) * X_GW
            for name in riders:
                hit = overlapping(body_solid(scenario.bodies[name], X_WW * scene.poses[name]), others)
                if hit is not None:
                    return hit
    return None
