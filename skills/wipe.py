"""Wipe: push a crumb with a pressed sponge along a straight stroke into a dustpan.

The stroke runs broadside (the sponge's longest level axis square to the direction), begins behind
the crumb and ends when the sponge's front has pushed it over the pan's open side.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from pinocchio import SE3
from py_trees.behaviour import Behaviour

from planner.failure import MotionFailure, RefinementFailure
from planner.refinement import Budget, Hints, Phase, Press, Refinement, pairs
from planner.task.facts import place_of
from planner.task.symbols import GroundAction
from scenarios.regions import OUTWARD, interior
from scenarios.scenario import Region, Scenario
from scenarios.shapes import Shape, extents
from sim.scene import Held, SceneState
from skills.carrying import carried
from skills.conditions import Achieved, HandHolds
from skills.context import ActionRun, SkillContext
from skills.motions import Follow, Slide, Touch, guarded, sequence
from skills.refine import PathFree, Refine
from skills.skill import Legs, Line, Toolkit, Unfit, Way, find_way, refine_by_sampling
from skills.waypoints import raised, shifted

HEIGHT = 0.08
CLOSE = 0.015
"""Metres above the surface from which contact is sought slowly."""

GAP = 0.02
"""Metres between sponge and crumb where the sponge comes down."""

PROBE = 0.015
"""Metres below the surface down to which touchdown is sought."""

LATERAL_STEP = 0.015
DIRECTION_STEPS = 7
SIDE_MARGIN = 0.01
OVERRUN = 0.005
TOUCH_SPEED = 0.03
NEAR_SPEED = 0.15


@dataclass(frozen=True)
class Stroke:
    """A straight stroke: `direction` in rad about z of W, the sponge's centre `lateral` metres to the left of the
    crumb's, `flipped` if the sponge is turned half round."""

    direction: float
    lateral: float
    flipped: bool = False

    @property
    def along(self) -> np.ndarray:
        """Unit vector (3,) of the stroke in W."""
        return np.array([np.cos(self.direction), np.sin(self.direction), 0.0])

    @property
    def left(self) -> np.ndarray:
        """Unit vector (3,) to the left of the stroke in W."""
        return np.array([-np.sin(self.direction), np.cos(self.direction), 0.0])


@dataclass(frozen=True)
class Opening:
    """A dustpan's open side in W: `middle` (3,), unit vector `inward` (3,), half its inner width in metres."""

    middle: np.ndarray
    inward: np.ndarray
    half_width: float


def opening_of(pan: Region) -> Opening:
    """Where crumbs enter a dustpan. Raises ValueError for a region without an open side."""
    if pan.open_side is None:
        raise ValueError(f"region {pan.name!r} has no open side, expected a dustpan")
    out = OUTWARD[pan.open_side]
    axis = int(np.argmax(np.abs(out)))
    lower, upper = interior(pan)
    middle = (lower + upper) / 2
    middle[axis] = upper[axis] if out[axis] > 0 else lower[axis]
    half_width = float(upper[1 - axis] - lower[1 - axis]) / 2
    return Opening(pan.X_WR.act(middle), -(pan.X_WR.rotation @ out), half_width)


def strokes(crumb: Shape, p_WO: np.ndarray, tool: Shape, pan: Region, rng: np.random.Generator) -> Iterator[Stroke]:
    """Strokes that take a crumb at p_WO (3,) over the pan's open side: straight ones with a centred sponge first."""
    entry = opening_of(pan)
    across = np.cross(np.array([0.0, 0.0, 1.0]), entry.inward)
    size = float(extents(crumb)[:2].max())
    reach = entry.half_width - size / 2 - SIDE_MARGIN
    span = float(np.sort(extents(tool))[-1]) / 2 - size / 2 - SIDE_MARGIN / 2
    if reach < 0.0:
        return
    here = float((p_WO - entry.middle) @ across)
    exits = np.unique(np.append(np.linspace(-reach, reach, DIRECTION_STEPS), np.clip(here, -reach, reach)))
    steps = int(max(span, 0.0) / LATERAL_STEP)
    laterals = np.arange(-steps, steps + 1) * LATERAL_STEP
    found = []
    for exit_ in exits:
        way = entry.middle + across * exit_ - p_WO
        direction = float(np.arctan2(way[1], way[0]))
        slant = abs(float(np.cross(entry.inward, way / np.linalg.norm(way))[2]))
        if way @ entry.inward <= 0.0:
            continue
        for lateral in laterals:
            cost = slant + 8.0 * abs(lateral) + 0.05 * rng.random()
            found.append((cost, len(found), Stroke(direction, float(lateral))))
    found.sort(key=lambda entry: entry[:2])
    for _, _, stroke in found:
        yield stroke


class Wipe:
    """`wipe(crumb, table, dustpan)` with the sponge in the hand."""

    name = "wipe"
    arity = 3

    def __init__(self, toolkit: Toolkit) -> None:
        self._kit = toolkit

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        crumb, _, pan = action.args[:3]
        held = scene.held
        bodies = scene.scenario.bodies
        if held is None or bodies[held.name].tool != "sponge":
            return RefinementFailure(action, "the hand holds no sponge")

        def attempt(stroke: Stroke, world: SceneState) -> tuple[Phase, ...] | MotionFailure | Unfit:
            return self._attempt(action, stroke, world)

        ways = strokes(
            bodies[crumb].shape,
            np.array(scene.poses[crumb].translation),
            bodies[held.name].shape,
            scene.scenario.regions[pan],
            rng,
        )
        R_WO = self._kit.robot.X_WG(scene.q).rotation @ held.X_GO.rotation
        samples = (turned for way in ways for turned in _either_way_round(way, scene.scenario, held, R_WO))
        return refine_by_sampling(action, scene, samples, attempt, budget, hints)

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        crumb, place, pan = refinement.action.args[:3]
        stroke: Stroke = refinement.sample
        assert scene.held is not None
        after = replace(scene, q=refinement.phases[-1].trajectory.end)
        swept = swept_crumbs(scene, scene.held, crumb, stroke, place, self._kit.robot.gripper.min_grasp_extent)
        region = scene.scenario.regions[pan]
        lower, _ = interior(region)
        across = np.cross(np.array([0.0, 0.0, 1.0]), opening_of(region).inward)
        middle = region.X_WR.act(np.array([0.0, 0.0, lower[2]]))
        here = np.array(scene.poses[crumb].translation)
        start = float((here - middle) @ across)
        for index, name in enumerate(swept):
            height = float(extents(scene.scenario.bodies[name].shape)[2]) / 2
            spot = middle + across * start * 0.5 + across * 0.03 * index + np.array([0.0, 0.0, height])
            after = after.moved(name, SE3(np.eye(3), spot))
        return after

    def subtree(self, run: ActionRun, context: SkillContext) -> Behaviour:
        motion = self._kit.motion
        reach = sequence("to the table", Follow("pre-wipe", run, context), Follow("approach", run, context))
        contact = sequence("in contact", Touch("descend", run, context), Slide("stroke", run, context))
        wiping = sequence(
            "stroke with the sponge",
            guarded("reach", Refine(run, context, motion), reach),
            guarded("watched", PathFree(run, context, motion), contact),
            Follow("retract", run, context),
        )
        crumb, _, pan = run.action.args[:3]
        return sequence(
            str(run.action),
            guarded("hold", HandHolds(None, run, context), wiping),
            Achieved(lambda scene: place_of(scene, crumb) == pan, run, context),
        )

    def _attempt(
        self, action: GroundAction, stroke: Stroke, scene: SceneState
    ) -> tuple[Phase, ...] | MotionFailure | Unfit:
        crumb, surface, pan = action.args[:3]
        held = scene.held
        assert held is not None
        robot, contact = self._kit.robot, self._kit.contact
        crumbs = _crumbs(scene, robot.gripper.min_grasp_extent)
        X_WG_start, X_WG_end = stroke_ends(scene, held, crumb, stroke, scene.scenario.regions[pan])
        back, height = contact.pre_wipe or (0.0, HEIGHT)
        X_WG_pre = shifted(X_WG_start, np.array([0.0, 0.0, height]) - back * stroke.along)
        low = raised(X_WG_start, -PROBE)

        pressed = scene.without(crumbs)
        gripping = pairs(robot.finger_links, held.name)
        touching = gripping | pairs(held.name, surface)
        sweeping = touching | pairs(robot.finger_links | {held.name}, crumbs) if crumbs else touching
        waypoints = (
            X_WG_pre,
            raised(X_WG_start, CLOSE),
            X_WG_start,
            low,
            X_WG_start,
            X_WG_end,
            raised(X_WG_end, HEIGHT),
        )

        def lines(legs: Legs) -> tuple[Line, ...]:
            down, near, probe, _, along, up = legs
            return (
                Line(pressed, along, contact.speed, touching),
                Line(pressed, down, NEAR_SPEED, touching),
                Line(pressed, np.vstack([near, probe[1:]]), TOUCH_SPEED, touching, checked=len(near)),
                Line(pressed, up, NEAR_SPEED, touching),
            )

        way = find_way(self._kit, waypoints, scene, lines, gripping)
        if not isinstance(way, Way):
            return way
        along, down, probe, up = way.lines
        press = Press(contact.force, np.array(contact.stiffness))
        return (
            Phase("pre-wipe", "move", carried(robot, way.reach, held), scene.opening, held, gripping),
            Phase("approach", "approach", down, scene.opening, held, sweeping),
            Phase("descend", "touch", probe, scene.opening, held, sweeping, press),
            Phase("stroke", "slide", along, scene.opening, held, sweeping, press),
            Phase("retract", "approach", up, scene.opening, held, sweeping),
        )


def _either_way_round(stroke: Stroke, scenario: Scenario, held: Held, R_WO: np.ndarray) -> list[Stroke]:
    """The stroke and the same with the sponge turned half round, the one nearer to the sponge's present R_WO first:
    a soft thing turns in the hand when it is swung about."""
    ways = [stroke, replace(stroke, flipped=True)]
    return sorted(ways, key=lambda way: -float(np.trace(R_WO.T @ _broadside(scenario, held, way)[0])))


def stroke_ends(scene: SceneState, held: Held, crumb: str, stroke: Stroke, pan: Region) -> tuple[SE3, SE3]:
    """Poses X_WG of the hand where the sponge comes down behind the crumb and where the stroke ends.

    At the end the sponge's front is half a crumb and a hair beyond the pan's open side, measured
    where the crumb passes it.
    """
    scenario = scene.scenario
    R_WO, half_depth = _broadside(scenario, held, stroke)
    p_crumb = np.array(scene.poses[crumb].translation)
    half_crumb = float(extents(scenario.bodies[crumb].shape)[:2].max()) / 2
    entry = opening_of(pan)
    to_entry = float((entry.middle - p_crumb) @ entry.inward / (stroke.along @ entry.inward))
    support = _top(scenario)
    half_height = float(np.abs(R_WO[2]) @ extents(scenario.bodies[held.name].shape)) / 2
    centre = p_crumb + stroke.left * stroke.lateral
    centre[2] = support + half_height
    start = centre - stroke.along * (half_crumb * np.sqrt(2.0) + half_depth + GAP)
    end = centre + stroke.along * (to_entry + half_crumb + OVERRUN - half_depth)
    X_OG = held.X_GO.inverse()
    return SE3(R_WO, start) * X_OG, SE3(R_WO, end) * X_OG


def swept_crumbs(
    scene: SceneState, held: Held, crumb: str, stroke: Stroke, place: str, crumb_extent: float
) -> list[str]:
    """The crumb, and every other crumb on `place` that the sponge takes along, in order of name."""
    scenario = scene.scenario
    half_width = float(np.sort(extents(scenario.bodies[held.name].shape))[-1]) / 2
    origin = np.array(scene.poses[crumb].translation)
    found = [crumb]
    for name in sorted(_crumbs(scene, crumb_extent) - {crumb}):
        offset = np.array(scene.poses[name].translation) - origin
        aside = abs(float(offset @ stroke.left) - stroke.lateral)
        ahead = float(offset @ stroke.along)
        level = abs(float(offset[2])) < crumb_extent
        if level and aside < half_width and ahead > -GAP and place == "table":
            found.append(name)
    return found


def _broadside(scenario: Scenario, held: Held, stroke: Stroke) -> tuple[np.ndarray, float]:
    """Rotation R_WO of the sponge, its longest level axis square to the stroke, and half its depth along the stroke."""
    size = extents(scenario.bodies[held.name].shape)
    approach_O = held.X_GO.rotation.T[:, 2]
    down = int(np.argmax(np.abs(approach_O)))
    level = [axis for axis in range(3) if axis != down]
    longest = max(level, key=lambda axis: size[axis])
    other = next(axis for axis in level if axis != longest)
    z_O = -np.sign(approach_O[down]) * np.eye(3)[down]
    x_O = np.eye(3)[longest] * (-1.0 if stroke.flipped else 1.0)
    y_O = np.cross(z_O, x_O)
    basis_O = np.column_stack([x_O, y_O, z_O])
    basis_W = np.column_stack([stroke.left, np.cross([0.0, 0.0, 1.0], stroke.left), [0.0, 0.0, 1.0]])
    return basis_W @ basis_O.T, float(size[other]) / 2


def _top(scenario: Scenario) -> float:
    return float(scenario.table.X_WT.translation[2]) + scenario.table.size[2] / 2


def _crumbs(scene: SceneState, crumb_extent: float) -> frozenset[str]:
    bodies = scene.scenario.bodies
    return frozenset(name for name in scene.poses if extents(bodies[name].shape).max() < crumb_extent)
