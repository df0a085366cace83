"""Drag aside: slide something along the table to where it is in nobody's way, when it can't be taken up."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from pinocchio import SE3
from py_trees.behaviour import Behaviour

from planner.failure import MotionFailure, RefinementFailure
from planner.refinement import Budget, Hints, Phase, Refinement, pairs
from planner.task.facts import place_of
from planner.task.symbols import GroundAction
from scenarios.names import TABLE
from scenarios.scenario import Body
from scenarios.shapes import bounds
from sim.scene import Held, SceneState
from skills.context import ActionRun, SkillContext
from skills.pressing import Pressing, in_order
from skills.skill import Toolkit, Unfit, beyond_reach, hand_would_hit, laden, refine_by_sampling
from skills.towing import (
    PHASES,
    Tips,
    footprint,
    is_on_top,
    margin_inside,
    press_pose,
    tip_points,
    tow,
    ways_of_pressing,
    ways_to_press,
)
from skills.towing_tree import towing_tree

DIRECTIONS = np.radians(np.arange(0.0, 360.0, 22.5))
DISTANCES = (0.08, 0.12, 0.16, 0.2, 0.25, 0.3)
USUAL = 0.18
"""Metres that are likely to clear the way."""

ROOM = 0.1
"""Metres to everything else beyond which more room is no better."""

RIM = 0.01
"""Metres of the table that stay free beyond the object."""

GAP = 0.01
"""Metres that it stays clear of everything else where it ends."""

MAX_TIPS = 4
"""Ways to press that are tried for one end."""

ARRIVED = 0.03
"""Metres from where it was to end within which it counts as there."""


@dataclass(frozen=True)
class Shift:
    """A drag along the table: the object's centre to (x, y) of W in metres, where the fingertips press, and how."""

    x: float
    y: float
    tips: Tips
    pressing: Pressing

    def end(self, X_WO: SE3) -> SE3:
        """The object's pose in the end."""
        return SE3(X_WO.rotation, np.array([self.x, self.y, X_WO.translation[2]]))


class DragAside:
    """`drag_aside(object, table)`: fingertips press on the object and take it to where there is room."""

    name = "drag_aside"
    arity = 2
    phases: tuple[str, ...] = PHASES

    def __init__(self, toolkit: Toolkit) -> None:
        self._kit = toolkit

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        beyond = beyond_reach(self._kit, action, scene)
        if beyond is not None:
            return beyond
        pressings = ways_of_pressing(self._kit, action, scene)
        if isinstance(pressings, RefinementFailure):
            return pressings

        def attempt(shift: Shift, world: SceneState) -> tuple[Phase, ...] | MotionFailure | Unfit:
            return self._attempt(action, shift, world)

        samples = self._shifts(action.args[0], scene, in_order(pressings, hints)[0], rng)
        nothing = f"{action.args[0]} offers the fingertips no room, or there is none beside it"
        return refine_by_sampling(action, scene, samples, attempt, budget, hints, nothing)

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        name = refinement.action.args[0]
        shift: Shift = refinement.sample
        end = refinement.phases[-1]
        return replace(scene.moved(name, shift.end(scene.poses[name])), q=end.trajectory.end, opening=0.0)

    def subtree(self, run: ActionRun, context: SkillContext) -> Behaviour:
        name = run.action.args[0]

        def is_there(scene: SceneState) -> bool:
            shift: Shift | None = run.refinement.sample if run.refinement else None
            if shift is None or name not in scene.poses or place_of(scene, name) != TABLE:
                return False
            return float(np.hypot(*(scene.poses[name].translation[:2] - [shift.x, shift.y]))) < ARRIVED

        return towing_tree(self._kit.motion, run, context, self.predict, is_there)

    def _shifts(self, name: str, scene: SceneState, pressing: Pressing, rng: np.random.Generator) -> Iterator[Shift]:
        """Ends all over the table, those first that are neither near nor far and where there is room."""
        body, X_WO = scene.scenario.bodies[name], scene.poses[name]
        found = []
        for direction in DIRECTIONS:
            for distance in DISTANCES:
                x, y = X_WO.translation[:2] + distance * np.array([np.cos(direction), np.sin(direction)])
                X_WO_end = SE3(X_WO.rotation, np.array([x, y, X_WO.translation[2]]))
                if min(margin_inside(scene.scenario.table, p) for p in footprint(body, X_WO_end)) < RIM:
                    continue
                room = _room(name, X_WO_end, scene)
                cost = abs(distance - USUAL) + max(ROOM - room, 0.0) + 0.1 * rng.random()
                found.append((float(cost), (round(float(x), 6), round(float(y), 6))))
        for _, (x, y) in sorted(found):
            way = np.array([x, y, X_WO.translation[2]]) - X_WO.translation
            ways = [tips for tips in ways_to_press(rng) if _fits(self._kit, body, X_WO, way, tips)]
            for tips in ways[:MAX_TIPS]:
                yield Shift(x, y, tips, pressing)

    def _attempt(
        self, action: GroundAction, shift: Shift, scene: SceneState
    ) -> tuple[Phase, ...] | MotionFailure | Unfit:
        name, surface = action.args[:2]
        X_WO, robot = scene.poses[name], self._kit.robot
        X_WO_end = shift.end(X_WO)
        X_WG = press_pose(scene.scenario.bodies[name], X_WO_end, X_WO_end.translation - X_WO.translation, shift.tips)
        there = replace(scene, opening=0.0, held=Held(name, X_WG.actInv(X_WO_end)))
        sliding = pairs(robot.finger_links, name) | pairs(name, surface)
        unfit = laden(action, scene) or hand_would_hit(self._kit, there, X_WG, sliding, GAP)
        return unfit or tow(self._kit, action, scene, X_WO_end, shift.tips, shift.pressing)


def _fits(toolkit: Toolkit, body: Body, X_WO: SE3, way: np.ndarray, tips: Tips) -> bool:
    return is_on_top(body, X_WO, tip_points(press_pose(body, X_WO, way, tips), toolkit.robot.gripper))


def _room(name: str, X_WO: SE3, scene: SceneState) -> float:
    """Metres between the circles about the object at X_WO and about the nearest other body; negative: they overlap."""
    bodies = scene.scenario.bodies

    def radius(of: str) -> float:
        lower, upper = bounds(bodies[of].shape)
        return float(np.hypot(*np.sort(np.maximum(-lower, upper))[1:]))

    gaps = [
        float(np.hypot(*(X.translation - X_WO.translation)[:2])) - radius(other) - radius(name)
        for other, X in scene.poses.items()
        if other != name
    ]
    return min(gaps, default=ROOM)
