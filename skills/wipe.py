"""Wipe: push a crumb, and whatever crumbs lie on the way, into a dustpan with a pressed sponge.

A sample is a stroke and how it presses. Each wipe is one stroke; `skills.gathering` chooses it so that as few
as possible take all the crumbs that are seen on the surface.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from pinocchio import SE3
from py_trees.behaviour import Behaviour

from planner.failure import Blocked, MotionFailure, RefinementFailure
from planner.motion.world import movables
from planner.refinement import Budget, Hints, Pair, Phase, Refinement, pairs
from planner.support import borne
from planner.task.facts import place_of
from planner.task.symbols import GroundAction
from scenarios.regions import interior
from scenarios.shapes import Box, Compound, Hull, Shape, bounding_radius, extents, middle, reach
from sim.scene import Held, SceneState
from skills.conditions import Achieved, HandHolds
from skills.context import ActionRun, SkillContext
from skills.gathering import Place, strokes_for
from skills.motions import Follow, Slide, Touch, guarded, sequence
from skills.pick import grip_force
from skills.pressing import Pressing, in_order
from skills.refine import PathFree, Refine
from skills.skill import ContactSettings, Toolkit, Unfit, refine_by_sampling
from skills.strokes import Crumbs, Opening, Stroke, Tool, along, left, opening_of, top_of
from skills.taken_out import CrumbInStroke
from skills.way_search import find_way
from skills.waypoints import raised, shifted
from skills.ways import Legs, Line, Way

HEIGHT = 0.08
CLOSE = 0.015
"""Metres above the surface from which contact is sought slowly."""

PROBE = 0.015
"""Metres below the surface down to which touchdown is sought."""

HOLD_SHARE = 0.6
"""Share of what the grip on the sponge bears that is used when it is to be pressed harder."""

LOOK = 0.02
"""Metres between the poses of the hand at which a stroke is looked at before a way for the arm is sought."""

MAX_SINK = 0.008
"""Metres by which a sponge may go deeper into the hand: its fingertips would soon meet what it is pressed on."""

TOUCH_SPEED = 0.03
NEAR_SPEED = 0.15


@dataclass(frozen=True)
class Wiping:
    """A stroke, and how it presses."""

    stroke: Stroke
    pressing: Pressing


def pressings(contact: ContactSettings, hold: float) -> list[Pressing]:
    """How a stroke may press: as set; lighter and slower, for what it sticks to; harder and slower, for what a soft
    sponge passes over; slower, for what rolls away; and stiffer, for what holds it up.

    `hold`: N along the pads that the grip on the sponge bears. Pressed nearly as hard, it creeps up in the hand.
    """
    usual = Pressing(contact.force, contact.speed, tuple(contact.stiffness))
    harder = float(np.clip(HOLD_SHARE * hold / contact.force, 1.0, 2.0))
    return [
        usual,
        usual.varied(force=0.5, speed=0.5),
        usual.varied(force=harder, speed=0.5),
        usual.varied(speed=0.3),
        usual.varied(stiffness=2.0, damping=1.5, speed=0.5),
    ]


class Wipe:
    """`wipe(crumb, table, dustpan)` with the sponge in the hand."""

    name = "wipe"
    arity = 3
    phases: tuple[str, ...] = ("pre-wipe", "approach", "descend", "stroke", "retract")

    def __init__(self, toolkit: Toolkit) -> None:
        self._kit = toolkit

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        held = scene.held
        if held is None or scene.scenario.bodies[held.name].tool != "sponge":
            return RefinementFailure(action, "the hand holds no sponge")
        place = self._place(scene, held, action)
        if place is None:
            reason = f"a rim of {action.args[2]} stands above the surface"
            return RefinementFailure(action, reason, (Blocked(None, reason),), proof="anywhere")

        refused: set[Stroke] = set()

        def attempt(wiping: Wiping, world: SceneState) -> tuple[Phase, ...] | MotionFailure | Unfit:
            outcome = self._attempt(action, wiping, place, world)
            if not isinstance(outcome, tuple):
                refused.add(wiping.stroke)
            return outcome

        sponge = scene.scenario.bodies[held.name]
        gripper = self._kit.robot.gripper
        hold = 2 * gripper.pad_friction * sponge.friction * grip_force(sponge, gripper)
        strokes = list(strokes_for(place, action.args[0]))
        samples = (
            Wiping(stroke, pressing)
            for pressing in in_order(pressings(self._kit.contact, hold), hints)
            for stroke in strokes
            if stroke not in refused
        )
        return refine_by_sampling(action, scene, samples, attempt, budget, hints)

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        crumb, _, pan = refinement.action.args[:3]
        after = replace(scene, q=refinement.phases[-1].trajectory.end)
        place = self._place(scene, scene.held, refinement.action)
        assert place is not None
        mask = place.taken(refinement.sample.stroke, surely=False)
        swept = {crumb, *(name for name, is_taken in zip(place.crumbs.names, mask, strict=True) if is_taken)}
        lower, upper = interior(scene.scenario.regions[pan])
        for name, spot in zip(sorted(swept), _spots(lower, upper, len(swept)), strict=True):
            spot[2] = lower[2] + reach(scene.scenario.bodies[name].shape, np.array([0.0, 0.0, -1.0]))
            after = after.moved(name, SE3(np.eye(3), scene.scenario.regions[pan].X_WR.act(spot)))
        return after

    def subtree(self, run: ActionRun, context: SkillContext) -> Behaviour:
        motion = self._kit.motion
        reach = sequence("to the table", Follow("pre-wipe", run, context), Follow("approach", run, context))
        in_stroke = CrumbInStroke(run, context, lambda scene: self._place(scene, scene.held, run.action))
        contact = sequence("in contact", Touch("descend", run, context), Slide("stroke", run, context))
        wiping = sequence(
            "stroke with the sponge",
            guarded("reach", Refine(run, context, motion), reach),
            guarded("watched", PathFree(run, context, motion), guarded("pushed", in_stroke, contact)),
            Follow("retract", run, context),
        )
        crumb, _, pan = run.action.args[:3]
        return sequence(
            str(run.action),
            guarded("hold", HandHolds(None, run, context, sink=MAX_SINK), wiping),
            Achieved(lambda scene: place_of(scene, crumb) == pan, run, context),
        )

    def _place(self, scene: SceneState, held: Held | None, action: GroundAction) -> Place | None:
        """What is seen to be swept in a scene; None if nothing can enter the dustpan, or nothing is held."""
        if held is None:
            return None
        crumb, surface, pan = action.args[:3]
        scenario = scene.scenario
        opening = opening_of(scenario.regions[pan], scenario.table)
        if opening is None:
            return None
        gripper = self._kit.robot.gripper
        there = [name for name in sorted(_crumbs(scene, gripper.min_grasp_extent)) if place_of(scene, name) == surface]
        names = tuple(sorted({crumb, *there}))
        positions = np.array([scene.poses[name].translation[:2] for name in names])
        radii = np.array([_radius(scenario.bodies[name].shape) for name in names])
        grip = _Broadside.of(scenario.bodies[held.name].shape, held)
        tool = Tool(grip.width, grip.depth, grip.width + 2 * gripper.pad[1])
        return Place(scenario.table, tool, opening, Crumbs(names, positions, radii))

    def _attempt(
        self, action: GroundAction, wiping: Wiping, place: Place, scene: SceneState
    ) -> tuple[Phase, ...] | MotionFailure | Unfit:
        held = scene.held
        assert held is not None
        stroke = wiping.stroke
        on_it = borne(scene) - _crumbs(scene, self._kit.robot.gripper.min_grasp_extent)
        if on_it:
            return Unfit(f"{', '.join(sorted(on_it))} would come along on {held.name}", on_it)
        if not place.taken(stroke, surely=False)[place.crumbs.names.index(action.args[0])]:
            return Unfit("the crumb does not lie before the stroke")
        if place.comes_down_on(stroke):
            return Unfit("the sponge would come down on a crumb")
        # A soft thing turns in the hand when it is swung about: the way round that is nearer comes first.
        R_WO = self._kit.robot.X_WG(scene.q).rotation @ held.X_GO.rotation
        grip = _Broadside.of(scene.scenario.bodies[held.name].shape, held)
        ways = sorted((False, True), key=lambda flip: -float(np.trace(R_WO.T @ grip.turned(stroke.heading, flip))))
        outcome = self._pushed(action, wiping, place.opening, scene, ways[0])
        if isinstance(outcome, Unfit):
            outcome = self._pushed(action, wiping, place.opening, scene, ways[1])
        if isinstance(outcome, Unfit) and outcome.culprits:
            # Not all of them have to go: the first way round may need less.
            return MotionFailure(outcome.reason, outcome.culprits)
        return outcome

    def _pushed(
        self, action: GroundAction, wiping: Wiping, opening: Opening, scene: SceneState, flipped: bool
    ) -> tuple[Phase, ...] | MotionFailure | Unfit:
        """The stroke as motion, the sponge as it is or turned half round."""
        _, surface, pan = action.args[:3]
        held = scene.held
        assert held is not None
        stroke, pressing = wiping.stroke, wiping.pressing
        robot, contact = self._kit.robot, self._kit.contact
        crumbs = _crumbs(scene, robot.gripper.min_grasp_extent)
        X_WG_start, *X_WG_course = _hand_poses(scene, held, stroke, flipped)
        back, height = contact.pre_wipe or (0.0, HEIGHT)
        ahead = np.array([*along(stroke.heading), 0.0])
        X_WG_pre = shifted(X_WG_start, np.array([0.0, 0.0, height]) - back * ahead)
        low = raised(X_WG_start, -PROBE)

        pressed = scene.without(crumbs)
        gripping = pairs(robot.finger_links, held.name)
        touching = gripping | pairs(held.name, surface)
        if not opening.is_edge:
            touching |= pairs(held.name, pan)
        sweeping = touching | pairs(robot.finger_links | {held.name}, crumbs) if crumbs else touching
        blocked = self._hits(pressed, [X_WG_start, *X_WG_course], touching)
        if blocked is not None:
            return blocked
        near, up = raised(X_WG_start, CLOSE), raised(X_WG_course[-1], HEIGHT)
        waypoints = (X_WG_pre, near, X_WG_start, low, X_WG_start, *X_WG_course, up)

        def lines(legs: Legs) -> tuple[Line, ...]:
            down, near, probe, _, first, *rest, up = legs
            course = np.vstack([first, *(leg[1:] for leg in rest)])
            return (
                Line(pressed, course, pressing.speed, touching),
                Line(pressed, down, NEAR_SPEED, touching, is_entry=True),
                Line(pressed, np.vstack([near, probe[1:]]), TOUCH_SPEED, touching, checked=len(near)),
                Line(pressed, up, NEAR_SPEED, touching),
            )

        way = find_way(self._kit, waypoints, scene, lines, gripping)
        if not isinstance(way, Way):
            return way
        course, down, probe, up = way.timed
        press = pressing.press
        return (
            Phase("pre-wipe", "move", way.reach, scene.opening, held, gripping),
            Phase("approach", "approach", down, scene.opening, held, sweeping),
            Phase("descend", "touch", probe, scene.opening, held, sweeping, press),
            Phase("stroke", "slide", course, scene.opening, held, sweeping, press),
            Phase("retract", "approach", up, scene.opening, held, sweeping),
        )

    def _hits(self, scene: SceneState, poses: Sequence[SE3], allowed: frozenset[Pair]) -> Unfit | None:
        """What hand and sponge would hit on the way through poses X_WG, whatever the arm does."""
        hits = frozenset[str]()
        for X_WG in _between(poses):
            hits |= self._kit.motion.hand_hits(scene, X_WG, allowed)
        if not hits:
            return None
        movable = hits & movables(scene)
        reason = "the stroke leads through " + ", ".join(sorted(hits - movable or hits))
        return Unfit(reason, movable if movable == hits else frozenset())


@dataclass(frozen=True)
class _Broadside:
    """How a held tool lies to its course: unit columns in O of the course, its front (between the fingers, which stand
    at its ends) and up; its width and depth in metres, and how far it reaches below its origin. p_OM (3,): where the
    middle of its bounding box lies from the origin."""

    basis_O: np.ndarray
    width: float
    depth: float
    below: float
    p_OM: np.ndarray

    @staticmethod
    def of(shape: Shape, held: Held) -> "_Broadside":
        """The tool as it points down in the hand."""
        size = extents(shape)
        approach_O = held.X_GO.rotation.T[:, 2]
        down = int(np.argmax(np.abs(approach_O)))
        closing_O = np.abs(held.X_GO.rotation.T[:, 1])
        front, other = sorted((axis for axis in range(3) if axis != down), key=lambda axis: -closing_O[axis])
        z_O = -np.sign(approach_O[down]) * np.eye(3)[down]
        y_O = np.eye(3)[front]
        basis_O = np.column_stack([np.cross(y_O, z_O), y_O, z_O])
        return _Broadside(basis_O, float(size[front]), float(size[other]), reach(shape, -z_O), middle(shape))

    def turned(self, heading: float, flipped: bool) -> np.ndarray:
        """Rotation R_WO of the tool broadside to a heading."""
        sign = -1.0 if flipped else 1.0
        x, y = sign * along(heading), sign * left(heading)
        return np.column_stack([[*x, 0.0], [*y, 0.0], [0.0, 0.0, 1.0]]) @ self.basis_O.T


def _hand_poses(scene: SceneState, held: Held, stroke: Stroke, flipped: bool) -> list[SE3]:
    """Poses X_WG of the hand along the stroke, the sponge standing on the table."""
    grip = _Broadside.of(scene.scenario.bodies[held.name].shape, held)
    height = top_of(scene.scenario.table) + grip.below
    X_OG = held.X_GO.inverse()
    poses = []
    for front, heading in stroke.course():
        centre = front - along(heading) * grip.depth / 2
        R_WO = grip.turned(heading, flipped)
        poses.append(SE3(R_WO, np.array([*(centre - (R_WO @ grip.p_OM)[:2]), height])) * X_OG)
    return poses


def _between(poses: Sequence[SE3]) -> Iterator[SE3]:
    """Poses at most LOOK metres apart along a polyline, its ends included."""
    yield poses[0]
    for X_WA, X_WB in pairwise(poses):
        steps = int(np.ceil(float(np.linalg.norm(X_WB.translation - X_WA.translation)) / LOOK))
        for k in range(1, steps + 1):
            share = k / steps
            p = X_WA.translation + share * (X_WB.translation - X_WA.translation)
            yield SE3(X_WB.rotation, p)


def _spots(lower: np.ndarray, upper: np.ndarray, count: int) -> list[np.ndarray]:
    """So many points (3,) in rows within a region's inside, in R: where crumbs end nobody knows exactly."""
    size = (upper - lower)[:2]
    columns = max(1, int(np.ceil(np.sqrt(count * size[0] / size[1]))))
    rows = int(np.ceil(count / columns))
    cells = [((i % columns + 0.5) / columns, (i // columns + 0.5) / rows) for i in range(count)]
    return [np.array([*(lower[:2] + size * cell), lower[2]]) for cell in cells]


def _radius(shape: Shape) -> float:
    """Metres of the circle about a crumb's footprint, whichever side it lies on."""
    if isinstance(shape, Box):
        return float(np.linalg.norm(np.sort(shape.size)[1:])) / 2
    if isinstance(shape, Hull | Compound):
        return bounding_radius(shape)
    return float(extents(shape).max()) / 2


def _crumbs(scene: SceneState, crumb_extent: float) -> frozenset[str]:
    bodies = scene.scenario.bodies
    return frozenset(name for name in scene.poses if extents(bodies[name].shape).max() < crumb_extent)
