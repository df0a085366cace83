"""Pick: grasp an object where it lies and lift it clear."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from py_trees.behaviour import Behaviour

from planner.failure import Blocked, MotionFailure, RefinementFailure
from planner.grasps import Grasp, grasps, open_width, tool_grasps
from planner.refinement import Budget, Hints, Phase, Refinement, pairs
from planner.support import supports
from planner.task.symbols import GroundAction
from scenarios.scenario import Body
from sim.robot import GRAVITY, Gripper
from sim.scene import Held, SceneState, pose_distance
from skills.carrying import MAX_ACCELERATION
from skills.conditions import Achieved, HandHolds, Unladen
from skills.context import ActionRun, SkillContext
from skills.motions import Close, Follow, guarded, sequence
from skills.refine import Refine
from skills.skill import Toolkit, Unfit, beyond_reach, hand_would_hit, laden, refine_by_sampling
from skills.way_search import find_way
from skills.waypoints import back_off, raised
from skills.ways import Legs, Line, Way
from skills.weigh import Weigh

STANDOFF = 0.08
LIFT = 0.10
NEAR_SPEED = 0.12

SAFETY = 1.5
"""How much more weight than there is the fingers' friction has to bear for an object to be carried."""

GRIP_FORCE = (15.0, 70.0)
"""Newtons with which each finger holds something hard, at least and at most."""

GRIP_SAFETY = 40.0
"""How much more than an object asks for while it is carried each finger presses, between those bounds: it must not turn
in the hand either. Pressed much harder than that, something light creeps from between the pads."""

GIVEN_UP = 2
"""How often a grasp may fail in execution before all others are tried first."""

NEAR = 0.01, float(np.radians(10.0))
"""Metres and rad within which two grasps are alike."""

SQUEEZE = 0.002
"""Metres by which the fingers may sink into something soft."""

PAD_CONTACTS = 4
"""Contact points of a pad on a flat face, each with the body's own contact stiffness."""


class Pick:
    """`pick(object, place)`: an antipodal grasp, found by sampling; then straight in, close, straight up."""

    name = "pick"
    arity = 2
    phases: tuple[str, ...] = ("pre-grasp", "approach", "close", "lift")

    def __init__(self, toolkit: Toolkit) -> None:
        self._kit = toolkit

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        impossible = self._impossible(action, scene)
        if impossible is not None:
            return impossible

        def attempt(grasp: Grasp, world: SceneState) -> tuple[Phase, ...] | MotionFailure | Unfit:
            return self._attempt(action, grasp, world)

        samples = _unproven_last(self._grasps(action.args[0], scene, rng), hints)
        nothing = f"no two sides of {action.args[0]} fit between the fingers"
        return refine_by_sampling(action, scene, samples, attempt, budget, hints, nothing)

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        name = refinement.action.args[0]
        end = refinement.phases[-1]
        held = Held(name, refinement.sample.X_OG.inverse())
        X_WG = self._kit.robot.X_WG(end.trajectory.end)
        moved = scene.moved(name, X_WG * held.X_GO)
        return replace(moved, q=end.trajectory.end, held=held, opening=refinement.sample.width)

    def subtree(self, run: ActionRun, context: SkillContext) -> Behaviour:
        name = run.action.args[0]
        reach = sequence("to the grasp", Follow("pre-grasp", run, context), Follow("approach", run, context))
        close = Close("close", run, context)
        return sequence(
            str(run.action),
            guarded("reach", Refine(run, context, self._kit.motion), reach),
            guarded("grasp", Unladen(name, run, context), close),
            guarded("hold", HandHolds(name, run, context), Follow("lift", run, context)),
            Weigh(run, context, close),
            Achieved(lambda scene: scene.held is not None and scene.held.name == name, run, context),
        )

    def _impossible(self, action: GroundAction, scene: SceneState) -> RefinementFailure | None:
        """What no sample can help: an object beyond the stretched arm, or heavier than the fingers can hold."""
        beyond = beyond_reach(self._kit, action, scene)
        if beyond is not None:
            return beyond
        name, gripper = action.args[0], self._kit.robot.gripper
        body = scene.scenario.bodies[name]
        held = 2 * gripper.pad_friction * body.friction * gripper.max_force
        if body.mass * GRAVITY > held:
            reason = f"{name} weighs {body.mass:.2f} kg, the fingers' friction holds {held / GRAVITY:.2f} kg"
            return RefinementFailure(action, reason, proof="anywhere")
        carried = held / (GRAVITY + MAX_ACCELERATION) / SAFETY
        if body.mass > carried:
            reason = f"{name} weighs {body.mass:.2f} kg, the fingers hold {carried:.2f} kg for sure while they carry"
            return RefinementFailure(action, reason, (Blocked(None, reason),))
        return None

    def _grasps(self, name: str, scene: SceneState, rng: np.random.Generator) -> Iterator[Grasp]:
        body = scene.scenario.bodies[name]
        base = np.array(self._kit.robot.X_WB.translation)
        sampler = tool_grasps if body.tool else grasps
        return sampler(body.shape, scene.poses[name], self._kit.robot.gripper, base, rng)

    def _attempt(
        self, action: GroundAction, grasp: Grasp, scene: SceneState
    ) -> tuple[Phase, ...] | MotionFailure | Unfit:
        name, place = action.args[:2]
        robot = self._kit.robot
        opening = open_width(robot.gripper, grasp.width)
        ready = replace(scene, opening=opening)
        X_WG = scene.poses[name] * grasp.X_OG
        touching = pairs(robot.finger_links, name)
        unfit = laden(action, scene) or hand_would_hit(self._kit, ready, X_WG, touching)
        if unfit:
            return unfit

        grasped = replace(scene, opening=grasp.width, held=Held(name, grasp.X_OG.inverse()))
        resting = touching | pairs(name, supports(scene, name) | {place})

        def lines(legs: Legs) -> tuple[Line, ...]:
            into, out = legs
            return Line(ready, into, NEAR_SPEED, touching, is_entry=True), Line(grasped, out, NEAR_SPEED, resting)

        way = find_way(self._kit, (back_off(X_WG, STANDOFF), X_WG, raised(X_WG, LIFT)), ready, lines)
        if not isinstance(way, Way):
            return way
        approach, lift = way.timed
        still = approach.standstill(approach.end)
        return (
            Phase("pre-grasp", "move", way.reach, opening),
            Phase("approach", "approach", approach, opening, allowed=touching),
            Phase(
                "close",
                "close",
                still,
                opening,
                allowed=resting,
                grip=grip_force(scene.scenario.bodies[name], robot.gripper),
            ),
            Phase("lift", "approach", lift, grasp.width, grasped.held, resting),
        )


def _unproven_last(found: Iterator[Grasp], hints: Hints) -> Iterator[Grasp]:
    """Grasps, those last that lost the object or missed it time and again where it lay before, and never held it."""

    def has_failed(grasp: Grasp) -> bool:
        fails = sum(_is_near(grasp, other) for other in hints.failed)
        return fails >= GIVEN_UP and not any(_is_near(grasp, other) for other in hints.done)

    if not hints.failed:
        yield from found
        return
    failed = []
    for grasp in found:
        if has_failed(grasp):
            failed.append(grasp)
        else:
            yield grasp
    yield from failed


def _is_near(grasp: Grasp, other: Any) -> bool:
    if not isinstance(other, Grasp):
        return False
    distance, turn = pose_distance(grasp.X_OG, other.X_OG)
    return distance < NEAR[0] and turn < NEAR[1]


def grip_force(body: Body, gripper: Gripper) -> float:
    """Newtons with which each finger holds a body: less where that would crush something soft."""
    least, most = GRIP_FORCE
    borne_by_one = body.mass * (GRAVITY + MAX_ACCELERATION) / (2 * gripper.pad_friction * body.friction)
    force = float(np.clip(GRIP_SAFETY * borne_by_one, least, most))
    return force if body.contact_stiffness is None else min(force, PAD_CONTACTS * body.contact_stiffness * SQUEEZE)
