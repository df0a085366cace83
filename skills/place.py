"""Place: bring what the hand holds into a container or onto the table, and let go."""

from dataclasses import replace
from itertools import zip_longest

import numpy as np
import pinocchio as pin
from pinocchio import SE3
from py_trees.behaviour import Behaviour

from planner.failure import Blocked, MotionFailure, RefinementFailure
from planner.grasps import hangs_by_the_tips, open_width
from planner.packing import clear_first, standing_about
from planner.placements import Placement, Surface, placements, surface_of, top_of
from planner.refinement import Budget, Hints, Phase, Refinement, pairs
from planner.support import borne
from planner.task.facts import place_of
from planner.task.situation import DISPLACED, TURNED
from planner.task.symbols import GroundAction
from scenarios.names import TABLE
from scenarios.scenario import Region, Scenario, Table
from scenarios.shapes import Shape, inscribed_radius
from sim.scene import SceneState
from skills.conditions import Achieved, HandHolds
from skills.context import ActionRun, SkillContext
from skills.motions import Follow, Open, guarded, sequence
from skills.refine import Refine
from skills.riding import driven_into
from skills.skill import Toolkit, Unfit, hand_would_hit, refine_by_sampling
from skills.way_search import find_way
from skills.waypoints import back_off, raised
from skills.ways import Legs, Line, Way

STANDOFF = 0.12
RETREAT = 0.12
NEAR_SPEED = 0.15

TIGHT = 0.014
"""Metres by which the fingers open, at least, to let go, where there is no room for more."""


def place_named(scenario: Scenario, name: str) -> Region | Table:
    """The region of that name, or the table. Raises KeyError naming the known places."""
    if name == TABLE:
        return scenario.table
    if name not in scenario.regions:
        raise KeyError(f"unknown place {name!r}, known: {', '.join([TABLE, *sorted(scenario.regions)])}")
    return scenario.regions[name]


def surfaces(scene: SceneState, place: str) -> list[Surface]:
    """What something can be put on there: a container's floor or the table's top, and what lies level inside."""
    where = place_named(scene.scenario, place)
    found = [surface_of(where)]
    if isinstance(where, Region):
        bodies = [scene.scenario.bodies[name] for name in sorted(scene.poses) if place_of(scene, name) == place]
        tops = [top_of(body.shape, scene.poses[body.name]) for body in bodies]
        rim = float(found[0].X_WS.translation[2]) + found[0].wall
        # What lies in a container has its centre below the rim.
        found += [top for top in tops if top is not None and float(top.X_WS.translation[2]) < rim]
    return found


def wider_than(place: Region | Table, shape: Shape) -> str | None:
    """In what way a shape can't lie in a container however it is turned: its inscribed ball about the centre, which is
    to come to lie below the rim, doesn't fit between the walls. None if that is no obstacle."""
    if not isinstance(place, Region) or place.open_side is not None:
        return None
    inner, ball = 2 * float(surface_of(place).half.min()), 2 * inscribed_radius(shape)
    return (
        None if ball <= inner else f"is {100 * ball:.1f} cm thick, which is more than the {100 * inner:.1f} cm inside"
    )


CARRIED_TURN = np.radians(30.0)
"""How far an object may have turned in the hand on its way. PyBullet lets a soft one turn by a twelfth of how far the
hand is swung round, and it may be swung right round."""


_STEPS = DISPLACED * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
_TURNS = tuple(pin.rpy.rpyToMatrix(0.0, 0.0, yaw) for yaw in (-TURNED, TURNED))


class Place:
    """`place(object, place)`: a release pose found by sampling; straight down to it, open, straight back. What stands
    on the object comes along."""

    name = "place"
    arity = 2
    phases: tuple[str, ...] = ("pre-place", "descend", "open", "retreat")

    def __init__(self, toolkit: Toolkit) -> None:
        self._kit = toolkit

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        name, goal = action.args[:2]
        if scene.held is None or scene.held.name != name:
            return RefinementFailure(action, f"the hand does not hold {name}")
        body = scene.scenario.bodies[name]
        if goal != TABLE and not budget.is_widened and hangs_by_the_tips(body.shape, scene.held.X_GO):
            loose = f"{name} hangs by the fingertips' ends, too loosely to be carried off the table"
            return RefinementFailure(action, loose, (Blocked(None, loose),))

        along = borne(scene)
        coming_along = pairs(self._kit.robot.hand_links | {name}, along) if along else frozenset()

        def attempt(placement: Placement, world: SceneState) -> tuple[Phase, ...] | MotionFailure | Unfit:
            outcome = self._attempt(action, placement, world.without(along))
            if not isinstance(outcome, tuple):
                return outcome
            there = along & world.poses.keys()
            hit = driven_into(self._kit.robot, world, there, [phase.trajectory for phase in outcome[:2]])
            if hit is not None:
                culprits = frozenset({hit}) & world.poses.keys()
                return Unfit(f"{', '.join(sorted(there))} on {name} would be driven into {hit}", culprits)
            return tuple(replace(phase, allowed=phase.allowed | coming_along) for phase in outcome)

        too_large = wider_than(place_named(scene.scenario, goal), body.shape)
        if too_large is not None:
            return RefinementFailure(action, f"{name} {too_large} {goal}", proof="anywhere")
        holding = (self._kit.robot.X_WG(scene.q), scene.held.X_GO)
        bare = scene.without(along)
        ways = [placements(body.shape, holding, surface, rng) for surface in surfaces(bare, goal)]
        drawn = (sample for turn in zip_longest(*ways) for sample in turn if sample is not None)

        def has_room(placement: Placement) -> bool:
            if body.tool and not self._leaves_in_reach(name, placement, bare):
                return False
            return isinstance(self._release(name, placement, bare), float)

        samples = clear_first(drawn, body, standing_about(bare), has_room)
        nothing = f"{name}, as it is held, fits nowhere in {goal}"
        return refine_by_sampling(action, scene, samples, attempt, budget, hints, nothing)

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        end = refinement.phases[-1]
        name, X_WO_rest = refinement.action.args[0], refinement.sample.X_WO_rest
        placed = scene.moved(name, X_WO_rest)
        carry = X_WO_rest * scene.poses[name].inverse()
        for other in borne(scene):
            placed = placed.moved(other, carry * scene.poses[other])
        return replace(placed, q=end.trajectory.end, held=None, opening=end.opening)

    def subtree(self, run: ActionRun, context: SkillContext) -> Behaviour:
        name, goal = run.action.args[:2]
        lower = sequence("to the place", Follow("pre-place", run, context), Follow("descend", run, context))
        carry = guarded("carry", Refine(run, context, self._kit.motion), lower)
        return sequence(
            str(run.action),
            guarded("hold", HandHolds(name, run, context, CARRIED_TURN), carry),
            Open("open", run, context),
            Follow("retreat", run, context),
            Achieved(lambda scene: scene.held is None and place_of(scene, name) == goal, run, context),
        )

    def _release(self, name: str, placement: Placement, scene: SceneState) -> float | Unfit:
        """Opening in metres with which the fingers let go without meeting anything, as wide as there is room for."""
        gripper, held = self._kit.robot.gripper, scene.held
        assert held is not None
        X_WG = placement.X_WO * held.X_GO.inverse()
        let_go = replace(scene.moved(name, placement.X_WO), held=None)
        unfit = hand_would_hit(self._kit, scene, X_WG, pairs(self._kit.robot.finger_links, name))
        if unfit:
            return unfit

        def opened(width: float) -> Unfit | None:
            open_hand = replace(let_go, opening=width)
            return hand_would_hit(self._kit, open_hand, X_WG, pairs(self._kit.robot.hand_links, name))

        wide, tight = open_width(gripper, scene.opening), min(gripper.stroke, scene.opening + TIGHT)
        return wide if opened(wide) is None else opened(tight) or tight

    def _leaves_in_reach(self, name: str, placement: Placement, scene: SceneState) -> bool:
        """Has the hand room to take the object up again as it is held, wherever close to the placement it lies then?"""
        gripper, held = self._kit.robot.gripper, scene.held
        assert held is not None
        X_WO = placement.X_WO_rest
        ready = replace(scene.moved(name, X_WO), held=None, opening=open_width(gripper, scene.opening))
        touching = pairs(self._kit.robot.hand_links, name)
        astray = (SE3(turn @ X_WO.rotation, X_WO.translation + step) for turn in _TURNS for step in _STEPS)
        return not any(hand_would_hit(self._kit, ready, X * held.X_GO.inverse(), touching) for X in astray)

    def _attempt(
        self, action: GroundAction, placement: Placement, scene: SceneState
    ) -> tuple[Phase, ...] | MotionFailure | Unfit:
        name, goal = action.args[:2]
        held = scene.held
        assert held is not None
        if place_of(replace(scene.moved(name, placement.X_WO_rest), held=None), name) != goal:
            return Unfit(f"it would not come to lie in {goal}")
        robot = self._kit.robot
        touching = pairs(robot.finger_links, name)
        lowering = touching | pairs(name, goal)
        X_WG = placement.X_WO * held.X_GO.inverse()
        opening = self._release(name, placement, scene)
        if isinstance(opening, Unfit):
            return opening

        released = replace(scene.moved(name, placement.X_WO), held=None, opening=opening)
        leaving = lowering | pairs(robot.hand_links, name)

        def lines(legs: Legs) -> tuple[Line, ...]:
            into, out = legs
            return Line(scene, into, NEAR_SPEED, lowering, is_entry=True), Line(released, out, NEAR_SPEED, leaving)

        way = find_way(self._kit, (raised(X_WG, STANDOFF), X_WG, back_off(X_WG, RETREAT)), scene, lines, touching)
        if not isinstance(way, Way):
            return way
        descend, retreat = way.timed
        still = descend.standstill(descend.end)
        return (
            Phase("pre-place", "move", way.reach, scene.opening, held, touching),
            Phase("descend", "approach", descend, scene.opening, held, lowering),
            Phase("open", "open", still, opening, None, leaving),
            Phase("retreat", "approach", retreat, opening, None, leaving),
        )
