"""Towing: closed fingertips press on an object from above and take it along by friction.

The object is meant to keep its orientation. Fingertips that turn can't turn it: their patch is small beside the
face it lies on, and of two fingertips apart one always bears less and slips.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from planner.failure import Blocked, MotionFailure, RefinementFailure
from planner.motion.trajectory import Trajectory
from planner.refinement import Phase, pairs
from planner.stability import room_about, tops
from planner.support import supports
from planner.task.symbols import GroundAction
from scenarios.scenario import Body, Scenario, Table
from scenarios.shapes import Compound, Cylinder, Hull, Sphere, extents, middle
from scenarios.solids import body_solid, overlap, region_solid
from sim.robot import GRAVITY, Gripper
from sim.scene import Held, SceneState, height_above
from skills.pressing import Pressing
from skills.skill import Toolkit, Unfit
from skills.way_search import find_way
from skills.waypoints import raised, shifted
from skills.ways import Legs, Line, Way

HEIGHT = 0.08
CLOSE = 0.015
"""Metres above the object from which contact is sought slowly."""

PROBE = 0.012
TOUCH_SPEED = 0.008
"""m/s: something rigid stops the hand within a millisecond, at 0.01 m/s with 45 to 61 N, at 0.015 m/s with 94 N."""

NEAR_SPEED = 0.15
SPEED = 0.08

FORCE_FACTOR = 2.0
"""How many times as hard as friction asks for is pressed at first."""

LEAST_FORCE = 8.0
GREATEST_FORCE = 40.0
"""Newtons: with friction's pull across it, and some overshoot, the limit on contact forces is not passed."""

HARDER = 2.0
RESERVE = 0.03
"""Metres by which the hand can go farther than it should have to, for an object that lags behind it."""

AHEADS = (0.0, -0.03, 0.03)
ASIDES = (0.0, 0.025, -0.025)
YAWS = np.radians([0.0, 90.0, 45.0, -45.0, 180.0, -90.0])

EDGE_MARGIN = 0.02
"""Metres by which the centre of mass, and the fingertips, stay inside the table's edges."""

TIP_MARGIN = 0.004
"""Metres that the fingertips stay inside the rim of the object's top."""

LOOK = 0.02
"""Metres between the poses at which an object's way is looked at before a motion is sought."""

DEPTH = 0.002
"""Metres by which what is believed of poses may have things overlap that don't."""

LEVEL = 0.99
"""Cosine of the angle off level up to which an object's top can be pressed on."""


@dataclass(frozen=True)
class Tips:
    """Where the closed fingertips press: `ahead` metres before the object's centre along its way and `aside` metres to
    the left of it, the hand turned by `yaw` rad about z."""

    ahead: float
    aside: float
    yaw: float


def ways_to_press(rng: np.random.Generator) -> list[Tips]:
    """Where the fingertips may press, near the centre first."""
    found = []
    for ahead in AHEADS:
        for aside in ASIDES:
            for rank, yaw in enumerate(YAWS):
                cost = 3.0 * (abs(ahead) + abs(aside)) + 0.02 * rank + 0.02 * rng.random()
                found.append((cost, Tips(ahead, aside, float(yaw))))
    return [tips for _, tips in sorted(found, key=lambda entry: entry[0])]


def needed_force(body: Body, table: Table, pad_friction: float) -> float | None:
    """Newtons from which on friction takes the object along; None if no force suffices.

    Sliding with the hand needs f (µ_pad − µ_table) > µ_table m g, each µ the product of a pair.
    """
    grip = pad_friction * body.friction
    drag = table.friction * body.friction
    return drag * body.mass * GRAVITY / (grip - drag) if grip > drag else None


def pressings(needed: float, stiffness: tuple[float, ...]) -> list[Pressing]:
    """Ways to press when friction asks for `needed` N: first the force believed to be enough, then ever harder ones,
    then slowly and more stiffly led."""
    found: list[Pressing] = []
    force = min(max(LEAST_FORCE, FORCE_FACTOR * needed), GREATEST_FORCE)
    following: Pressing | None = Pressing(force, SPEED, stiffness)
    while following is not None:
        found.append(following)
        following = harder(following)
    return [*found, found[0].varied(speed=0.5), found[-1].varied(speed=0.5, stiffness=2.0, damping=1.5)]


def harder(pressing: Pressing) -> Pressing | None:
    """The next harder way to press; None at the limit."""
    if pressing.force >= GREATEST_FORCE:
        return None
    return replace(pressing, force=min(pressing.force * HARDER, GREATEST_FORCE))


def ways_of_pressing(toolkit: Toolkit, action: GroundAction, scene: SceneState) -> list[Pressing] | RefinementFailure:
    """How the action's object can be pressed on so that it comes along, or why it can't."""
    name = action.args[0]
    body = scene.scenario.bodies[name]
    if not has_level_top(body, scene.poses[name]):
        reason = f"{name} has no level top to press on"
        return RefinementFailure(action, reason, (Blocked(None, reason),))
    beneath = supports(scene, name)
    if beneath:
        # What it lies on would come along, or it would fall off.
        reason = f"{name} lies on {', '.join(sorted(beneath))}, not on the table"
        return RefinementFailure(action, reason, (Blocked(None, reason),))
    needed = needed_force(body, scene.scenario.table, toolkit.robot.gripper.pad_friction)
    if needed is None:
        reason = "the fingertips have less friction on it than the table"
        return RefinementFailure(action, reason, (Blocked(None, reason),))
    if needed > GREATEST_FORCE:
        reason = f"{name} would have to be pressed with {needed:.0f} N, the limit is {GREATEST_FORCE:.0f} N"
        return RefinementFailure(action, reason, (Blocked(None, reason),))
    return pressings(needed, toolkit.contact.stiffness)


def press_pose(body: Body, X_WO: SE3, way: np.ndarray, tips: Tips) -> SE3:
    """Pose X_WG of the hand with the fingertips on the object at X_WO that shall go along `way` (3,)."""
    along = way / max(float(np.linalg.norm(way)), 1e-9)
    left = np.array([-along[1], along[0], 0.0])
    top = np.array([0.0, 0.0, height_above(body.shape, X_WO.rotation)])
    p_WG = X_WO.translation + top + along * tips.ahead + left * tips.aside
    return SE3(pin.rpy.rpyToMatrix(np.pi, 0.0, tips.yaw), p_WG)


def tip_points(X_WG: SE3, gripper: Gripper) -> np.ndarray:
    """The corners (4,3) of the patch that the closed fingertips cover, in W."""
    x, y = gripper.pad[0] / 2, gripper.pad[1]
    corners = np.array([[-x, -y, 0.0], [-x, y, 0.0], [x, -y, 0.0], [x, y, 0.0]])
    return corners @ X_WG.rotation.T + X_WG.translation


def has_level_top(body: Body, X_WO: SE3) -> bool:
    """Is there a level face to press on?"""
    match body.shape:
        case Sphere():
            return False
        case Cylinder():
            return abs(X_WO.rotation[2, 2]) > LEVEL
        case Hull() | Compound():
            return bool(tops(body.shape, X_WO.rotation[2], LEVEL))
        case _:
            return float(np.abs(X_WO.rotation[2]).max()) > LEVEL


def is_on_top(body: Body, X_WO: SE3, points: np.ndarray) -> bool:
    """Do points (n,3) of W lie over the object's top, inside its rim?"""
    points_O = (points - X_WO.translation) @ X_WO.rotation
    if isinstance(body.shape, Hull | Compound):
        faces = tops(body.shape, X_WO.rotation[2], LEVEL)
        return any(min(room_about(*face, point) for point in points_O) >= TIP_MARGIN for face in faces)
    up = int(np.argmax(np.abs(X_WO.rotation[2])))
    level = [axis for axis in range(3) if axis != up]
    half = extents(body.shape)[level] / 2 - TIP_MARGIN
    offsets = points_O[:, level]
    if isinstance(body.shape, Cylinder):
        return bool(np.hypot(*offsets.T).max() <= half.min())
    return bool(np.all(np.abs(offsets) <= half))


def margin_inside(table: Table, p_W: np.ndarray) -> float:
    """Metres that a point (3,) of W lies inside the nearest edge of the table; negative beyond it."""
    p_T = np.abs(table.X_WT.actInv(p_W))[:2]
    return float((np.array(table.size[:2]) / 2 - p_T).min())


def fixed_in_way(scenario: Scenario, body: Body, X_WO: SE3, X_WO_end: SE3) -> str | None:
    """The name of a fixture or region that the object would run into on its straight way, or None."""
    fixed = [body_solid(fixture) for fixture in scenario.fixtures.values()]
    fixed += [region_solid(region) for region in scenario.regions.values()]
    way = X_WO_end.translation - X_WO.translation
    steps = max(1, int(np.ceil(float(np.linalg.norm(way)) / LOOK)))
    # Beginning with the end, which is where most ways are blocked.
    for step in range(steps, 0, -1):
        there = body_solid(body, shifted(X_WO, way * step / steps))
        hit = next((other.name for other in fixed if overlap(there, other, DEPTH)), None)
        if hit is not None:
            return hit
    return None


def footprint(body: Body, X_WO: SE3) -> list[np.ndarray]:
    """The corners (3,) of the object's bounding box in W."""
    half, centre = extents(body.shape) / 2, middle(body.shape)
    return [X_WO.act(centre + half * (2.0 * np.array(signs) - 1.0)) for signs in np.ndindex(2, 2, 2)]


PHASES = ("draw back", "close", "pre-drag", "approach", "descend", "drag", "retract")
"""Names of the phases of whatever tows. The hand is drawn back only if its fingers stand about something."""

WIDTHS = (0.75, 0.5, 0.25, 0.0)
"""Shares of their opening at which closing fingers are looked at."""


def tow(
    toolkit: Toolkit, action: GroundAction, scene: SceneState, X_WO_end: SE3, tips: Tips, pressing: Pressing
) -> tuple[Phase, ...] | MotionFailure | Unfit:
    """The motion that takes the action's object along to X_WO_end, and the hand up from it.

    The hand's path goes on beyond that by RESERVE, as far as the fingertips stay above the table.
    """
    name, surface = action.args[:2]
    robot = toolkit.robot
    body = scene.scenario.bodies[name]
    X_WO = scene.poses[name]
    way = X_WO_end.translation - X_WO.translation
    X_WG = press_pose(body, X_WO, way, tips)
    X_WG_end = shifted(X_WG, way)
    X_WG_last = shifted(X_WG_end, way / max(float(np.linalg.norm(way)), 1e-9) * _reserve(toolkit, scene, X_WG_end))

    back = _drawn_back(toolkit, scene)
    if isinstance(back, MotionFailure):
        return back
    ready = replace(scene, opening=0.0, q=scene.q if back is None else back.end)
    along_with = Held(name, X_WG.actInv(X_WO))
    dragging = replace(ready, held=along_with)
    touching = pairs(robot.finger_links, name)
    sliding = touching | pairs(name, surface)
    moved = ready.moved(name, X_WO_end)
    waypoints = (
        raised(X_WG, HEIGHT),
        raised(X_WG, CLOSE),
        X_WG,
        raised(X_WG, -PROBE),
        X_WG,
        X_WG_last,
        X_WG_end,
        raised(X_WG_end, HEIGHT),
    )

    def lines(legs: Legs) -> tuple[Line, ...]:
        down, near, probe, _, along, _, up = legs
        return (
            Line(dragging, along, pressing.speed, sliding),
            Line(ready, down, NEAR_SPEED, touching, is_entry=True),
            Line(ready, np.vstack([near, probe[1:]]), TOUCH_SPEED, touching, checked=len(near)),
            Line(moved, up, NEAR_SPEED, touching),
        )

    way = find_way(toolkit, waypoints, ready, lines)
    if not isinstance(way, Way):
        return way
    along, down, probe, up = way.timed
    press = pressing.press
    first = () if back is None else (Phase("draw back", "approach", back, scene.opening),)
    return (
        *first,
        Phase("close", "open", way.reach.standstill(ready.q), 0.0),
        Phase("pre-drag", "move", way.reach, 0.0),
        Phase("approach", "approach", down, 0.0, None, touching),
        Phase("descend", "touch", probe, 0.0, None, sliding, press),
        Phase("drag", "slide", along, 0.0, along_with, sliding, press),
        Phase("retract", "approach", up, 0.0, None, sliding),
    )


def _drawn_back(toolkit: Toolkit, scene: SceneState) -> Trajectory | MotionFailure | None:
    """The line along which the hand is drawn back before its fingers close; None if these meet nothing where it is."""
    X_WG = toolkit.robot.X_WG(scene.q)
    narrower = (replace(scene, opening=share * scene.opening) for share in WIDTHS)
    if not any(toolkit.motion.hand_hits(narrow, X_WG, margin=0.0) for narrow in narrower):
        return None
    line = toolkit.motion.drawn_back(scene, NEAR_SPEED)
    return MotionFailure("the fingers stand about something and can't be drawn back") if line is None else line


def _reserve(toolkit: Toolkit, scene: SceneState, X_WG_end: SE3) -> float:
    """Metres that the hand may go on in any direction with its fingertips EDGE_MARGIN inside the table's edges."""
    table = scene.scenario.table
    inside = min(margin_inside(table, point) for point in tip_points(X_WG_end, toolkit.robot.gripper))
    return float(np.clip(inside - EDGE_MARGIN, 0.0, RESERVE))
