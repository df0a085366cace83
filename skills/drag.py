"""Drag: press on a flat object from above and slide it over the table's edge, so that it can be grasped there."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from pinocchio import SE3
from py_trees.behaviour import Behaviour

from planner.failure import Blocked, MotionFailure, RefinementFailure
from planner.refinement import Budget, Hints, Phase, Press, Refinement, pairs
from planner.task.symbols import GroundAction
from scenarios.scenario import Body, Table
from scenarios.shapes import extents
from sim.robot import GRAVITY
from sim.scene import Held, SceneState, height_above
from skills.conditions import Achieved
from skills.context import ActionRun, SkillContext
from skills.motions import Follow, Open, Slide, Touch, guarded, sequence
from skills.refine import PathFree, Refine
from skills.skill import Legs, Line, Toolkit, Unfit, Way, find_way, refine_by_sampling
from skills.waypoints import raised, shifted

HEIGHT = 0.08
CLOSE = 0.015
"""Metres above the surface from which contact is sought slowly."""

PROBE = 0.012
OVERHANGS = (0.055, 0.065, 0.045, 0.075)
"""Metres by which the object is to stand out beyond the edge: enough for the fingers' pads."""

EDGE_MARGIN = 0.02
"""Metres by which the centre of mass stays inside the edge."""

PRESS_OFFSETS = (0.0, -0.03, 0.03)
YAWS = np.radians([0.0, 90.0, 45.0, -45.0, 180.0, -90.0])
LEFT_OVER = 0.3
"""Fraction of the overhang that may be missing after a drag."""

FORCE_FACTOR = 2.5
LEAST_FORCE = 6.0
SPEED = 0.08
TOUCH_SPEED = 0.015
"""m/s: on something rigid, touchdown at 0.03 m/s peaks above 50 N."""

NEAR_SPEED = 0.15


@dataclass(frozen=True)
class Pull:
    """A drag: over the table's edge `edge` (0…3: +x, −x, +y, −y of the table), so far that `overhang` metres stand
    out, pressing `press` metres before the object's centre, the hand turned by `yaw` rad about z."""

    edge: int
    overhang: float
    press: float
    yaw: float


def edge_normal(table: Table, edge: int) -> np.ndarray:
    """Outward unit vector (3,) in W of one of the table's edges."""
    local = np.zeros(3)
    local[edge // 2] = 1.0 if edge % 2 == 0 else -1.0
    return table.X_WT.rotation @ local


def travel(body: Body, X_WO: SE3, table: Table, pull: Pull) -> float:
    """Metres along the edge's normal until `pull.overhang` of the object stands out."""
    normal = edge_normal(table, pull.edge)
    half = float(np.abs(normal @ X_WO.rotation) @ extents(body.shape)) / 2
    inside = table.size[pull.edge // 2] / 2 - float((X_WO.translation - table.X_WT.translation) @ normal)
    return inside + pull.overhang - half


def needed_force(body: Body, table: Table, pad_friction: float) -> float | None:
    """Newtons with which to press so that friction takes the object along; None if no force suffices.

    Sliding with the hand needs f (µ_pad − µ_table) > µ_table m g, each µ the product of a pair.
    """
    grip = pad_friction * body.friction
    drag = table.friction * body.friction
    if grip <= drag:
        return None
    return max(LEAST_FORCE, FORCE_FACTOR * drag * body.mass * GRAVITY / (grip - drag))


def pulls(body: Body, X_WO: SE3, table: Table, rng: np.random.Generator) -> Iterator[Pull]:
    """Drags to every edge, the shortest way first; the centre of mass always stays above the table."""
    found = []
    for edge in range(4):
        normal = edge_normal(table, edge)
        half = float(np.abs(normal @ X_WO.rotation) @ extents(body.shape)) / 2
        for rank, overhang in enumerate(OVERHANGS):
            if overhang > half - EDGE_MARGIN:
                continue
            for offset in PRESS_OFFSETS:
                for turn, yaw in enumerate(YAWS):
                    pull = Pull(edge, overhang, offset, float(yaw))
                    way = travel(body, X_WO, table, pull)
                    if way <= 0.01 or half - overhang - offset < EDGE_MARGIN:
                        continue
                    cost = way + 0.05 * rank + 3.0 * abs(offset) + 0.02 * turn + 0.005 * rng.random()
                    found.append((cost, len(found), pull))
    found.sort(key=lambda entry: entry[:2])
    for _, _, pull in found:
        yield pull


class Drag:
    """`drag(object, table)`: closed fingertips press on the object and take it along by friction."""

    name = "drag"
    arity = 2

    def __init__(self, toolkit: Toolkit) -> None:
        self._kit = toolkit

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        body = scene.scenario.bodies[action.args[0]]
        table = scene.scenario.table
        force = needed_force(body, table, self._kit.robot.gripper.pad_friction)
        if force is None:
            reason = "the fingertips have less friction on it than the table"
            return RefinementFailure(action, reason, (Blocked(None, reason),))

        def attempt(pull: Pull, world: SceneState) -> tuple[Phase, ...] | MotionFailure | Unfit:
            return self._attempt(action, pull, world, force)

        samples = pulls(body, scene.poses[body.name], table, rng)
        return refine_by_sampling(action, scene, samples, attempt, budget, hints)

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        name = refinement.action.args[0]
        body, table = scene.scenario.bodies[name], scene.scenario.table
        pull: Pull = refinement.sample
        way = travel(body, scene.poses[name], table, pull) * edge_normal(table, pull.edge)
        end = refinement.phases[-1]
        return replace(scene.moved(name, shifted(scene.poses[name], way)), q=end.trajectory.end, opening=0.0)

    def subtree(self, run: ActionRun, context: SkillContext) -> Behaviour:
        name = run.action.args[0]

        def stands_out(scene: SceneState) -> bool:
            pull = run.refinement.sample if run.refinement else None
            body, table = scene.scenario.bodies[name], scene.scenario.table
            return pull is not None and travel(body, scene.poses[name], table, pull) < LEFT_OVER * pull.overhang

        motion = self._kit.motion
        reach = sequence(
            "to the object",
            Open("close", run, context),
            Follow("pre-drag", run, context),
            Follow("approach", run, context),
        )
        contact = sequence("in contact", Touch("descend", run, context), Slide("drag", run, context))
        return sequence(
            str(run.action),
            guarded("reach", Refine(run, context, motion), reach),
            guarded("watched", PathFree(run, context, motion), contact),
            Follow("retract", run, context),
            Achieved(stands_out, run, context),
        )

    def _attempt(
        self, action: GroundAction, pull: Pull, scene: SceneState, force: float
    ) -> tuple[Phase, ...] | MotionFailure | Unfit:
        name, surface = action.args[:2]
        robot = self._kit.robot
        body, table = scene.scenario.bodies[name], scene.scenario.table
        X_WO = scene.poses[name]
        normal = edge_normal(table, pull.edge)
        top = np.array([0.0, 0.0, height_above(body.shape, X_WO.rotation)])
        R_WG = pin.rpy.rpyToMatrix(np.pi, 0.0, pull.yaw)
        X_WG_press = SE3(R_WG, X_WO.translation + top + normal * pull.press)
        X_WG_end = shifted(X_WG_press, normal * travel(body, X_WO, table, pull))
        low = raised(X_WG_press, -PROBE)

        closed = replace(scene, opening=0.0)
        along_with = Held(name, X_WG_press.inverse() * X_WO)
        dragging = replace(closed, held=along_with)
        touching = pairs(robot.finger_links, name)
        sliding = touching | pairs(name, surface)
        moved = closed.moved(name, shifted(X_WO, X_WG_end.translation - X_WG_press.translation))
        waypoints = (
            raised(X_WG_press, HEIGHT),
            raised(X_WG_press, CLOSE),
            X_WG_press,
            low,
            X_WG_press,
            X_WG_end,
            raised(X_WG_end, HEIGHT),
        )

        def lines(legs: Legs) -> tuple[Line, ...]:
            down, near, probe, _, along, up = legs
            return (
                Line(dragging, along, SPEED, sliding),
                Line(closed, down, NEAR_SPEED, touching),
                Line(closed, np.vstack([near, probe[1:]]), TOUCH_SPEED, touching, checked=len(near)),
                Line(moved, up, NEAR_SPEED, touching),
            )

        way = find_way(self._kit, waypoints, closed, lines)
        if not isinstance(way, Way):
            return way
        along, down, probe, up = way.lines
        press = Press(force, np.array(self._kit.contact.stiffness))
        return (
            Phase("close", "open", way.reach.standstill(scene.q), 0.0),
            Phase("pre-drag", "move", way.reach, 0.0),
            Phase("approach", "approach", down, 0.0, None, touching),
            Phase("descend", "touch", probe, 0.0, None, sliding, press),
            Phase("drag", "slide", along, 0.0, along_with, sliding, press),
            Phase("retract", "approach", up, 0.0, None, sliding),
        )
