"""Queries of `bench motion`: what fig1's plan asks of the motion planner, and ways between poses of random tables."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import cycle

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from bt_tamp.executive.build import build_planner
from bt_tamp.executive.seams import Seams
from bt_tamp.options import RunOptions
from planner.failure import MotionFailure
from planner.motion.clearance import NOTHING
from planner.motion.motion_planner import MotionPlanner
from planner.motion.trajectory import Trajectory
from planner.refinement import Pair
from scenarios.document import parse_document
from scenarios.generate import generate
from scenarios.load import build_scenario, load_scenario
from scenarios.regions import interior
from sim.robot import RobotModel
from sim.scene import SceneState, height_above

SCENE = "fig1"
OBJECTS = (4, 6, 8, 10, 12)
"""Numbers of things on the random tables, in turn."""

POSES = 200
ABOVE = (0.005, 0.06)
"""Metres from the top of a thing, or from a bin's floor, to the fingertips."""

TILT = np.radians(30.0)
"""Largest angle of the hand from straight down."""


@dataclass(frozen=True)
class MotionQuery:
    """From scene.q to the goal (7,), what is held going along; `allowed` pairs may touch."""

    name: str
    scene: SceneState
    goal: np.ndarray
    allowed: frozenset[Pair] = NOTHING


class _Listening(MotionPlanner):
    """Keeps what it is asked."""

    asked: list[MotionQuery]

    def move(
        self,
        scene: SceneState,
        q_goals: Sequence[np.ndarray],
        allowed: frozenset[Pair] = NOTHING,
        max_checks: int = 4000,
    ) -> Trajectory | MotionFailure:
        for goal in q_goals:
            self.asked.append(MotionQuery(f"{scene.scenario.name} {len(self.asked) + 1}", scene, goal, allowed))
        return super().move(scene, q_goals, allowed, max_checks)


def plan_queries(name: str = SCENE) -> list[MotionQuery]:
    """Every free motion sought while the shipped scene `name` is planned, but for those that lead nowhere."""

    class Listening(_Listening):
        asked: list[MotionQuery] = []  # noqa: RUF012

    scenario = load_scenario(name)
    robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
    thinker = build_planner(scenario, RunOptions(), robot, lambda kind, **data: None, Seams(motion=Listening))
    scene = SceneState.initial(scenario, robot.gripper.stroke)
    thinker.planner.search.plan(scene, thinker.goal, np.random.default_rng([0, 7]), thinker.planner.thinking.work)
    return [query for query in Listening.asked if not np.allclose(query.goal, query.scene.q, atol=1e-6)]


def table_query(seed: int) -> MotionQuery | None:
    """On a random table, from one place where the hand may have work to another; None if it gets to neither."""
    scenario = build_scenario(parse_document(generate(seed, OBJECTS[seed % len(OBJECTS)]), f"table {seed}"))
    robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
    scene, rng = SceneState.initial(scenario, robot.gripper.stroke), np.random.default_rng([seed, 11])
    motion, places = MotionPlanner(robot), _places(scene)
    chosen = rng.choice(len(places), 2, replace=False)
    start, goal = (_at_work(motion, scene, places[k], rng) for k in chosen)
    if start is None or goal is None:
        return None
    return MotionQuery(f"table {seed}", replace(scene, q=start), goal)


def _places(scene: SceneState) -> list[np.ndarray]:
    """Where the hand may have work (3,): on top of every movable thing, and as often on the floor of a bin."""
    places = []
    for name, X_WO in scene.poses.items():
        top = height_above(scene.scenario.bodies[name].shape, X_WO.rotation)
        places.append(X_WO.translation + np.array([0.0, 0.0, top]))
    bins = [region for region in scene.scenario.regions.values() if region.kind == "bin"]
    floors = [region.X_WR.act(np.array([0.0, 0.0, interior(region)[0][2]])) for region in bins]
    return places + [floor for _, floor in zip(places, cycle(floors), strict=False)]


def _at_work(
    motion: MotionPlanner, scene: SceneState, place: np.ndarray, rng: np.random.Generator
) -> np.ndarray | None:
    """A free configuration (7,) with the fingertips just above the place; None if there is none among POSES poses."""
    for _ in range(POSES):
        tilt, towards, yaw = rng.uniform(0.0, TILT), rng.uniform(-np.pi, np.pi), rng.uniform(-np.pi, np.pi)
        lean = pin.exp3(tilt * np.array([np.cos(towards), np.sin(towards), 0.0]))
        X_WG = SE3(lean @ pin.rpy.rpyToMatrix(np.pi, 0.0, yaw), place + np.array([0.0, 0.0, rng.uniform(*ABOVE)]))
        found = next((q for q in motion.ik(X_WG) if motion.free(scene, q)), None)
        if found is not None:
            return found
    return None
