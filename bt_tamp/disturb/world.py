"""What is done to the world: each function draws one instance of its class for an occasion."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from bt_tamp.disturb.deed import BEHIND, DRAWS, Deed, Later, Occasion
from planner.task.symbols import Fact
from scenarios.scenario import Body, Region
from scenarios.shapes import Cylinder, Sphere, extents
from scenarios.solids import body_solid, region_hull, table_solid
from scenarios.standing import overlap_problem
from sim.robot_faults import SlipperyPads
from sim.scene import depth_below, height_above
from sim.world_faults import BinShifted, Brought, Moved, TakenAway
from skills.strokes import Opening, opening_of

T = TypeVar("T")

NEAR = (0.04, 0.15)
"""Metres by which something is moved."""

STRAY = 0.05
"""Metres by which a shifted bin may come nearer to the robot or go further away."""

UPRIGHT = 0.99
"""Cosine of the angle with the vertical within which a cylinder stands."""

SLIPPERY = 1.0
"""Seconds for which something slips."""

DROPPING = 1.0
"""Seconds after which, at most, what has slipped in the hand falls from it."""

TALL = 1.3
"""Times its smallest extent: what is higher stands."""

SOON = 0.4
AHEAD = 15
"""Seconds ahead, at least, and at how many spots, at which a motion is blocked: a hand in a slow stroke takes up much
of what lies before it."""

STOPPING = np.linspace(0.05, 0.3, 6)
"""Seconds ahead at which the arm is kept clear: nothing sees and stops at once."""

AWAY = (2.0, 5.0)
"""Seconds for which something is gone."""

BACK = 0.10
"""Metres within which it comes back, if there is room."""

WAITS = 1.0
SPREADS = 0.2
"""Seconds for which room is sought so near, and m/s by which it is sought further off from then on."""


def moved(now: Occasion) -> Deed | None:
    """An object of this or a later action is put elsewhere on the table."""
    for name in _shuffled(now, _on_table(now)):
        X_WO = now.truth.poses[name]
        spot = now.spot(now.scenario.bodies[name], X_WO.rotation, X_WO.translation[:2], NEAR)
        if spot is not None:
            return _put(now, name, spot, f"{name} was moved by {100 * _between(X_WO, spot):.0f} cm")
    return None


def rotated(now: Occasion) -> Deed | None:
    """An object that isn't the same again afterwards is turned on the spot."""
    bodies, poses = now.scenario.bodies, now.truth.poses
    cornered = [name for name in _on_table(now) if has_corners(bodies[name], poses[name].rotation)]
    for name in _shuffled(now, [name for name in cornered if not now.is_crumb(name)]):
        X_WO = poses[name]
        for _ in range(10):
            angle = now.rng.uniform(np.radians(30.0), np.radians(90.0)) * now.rng.choice([-1.0, 1.0])
            turned = SE3(_about_z(angle) @ X_WO.rotation, X_WO.translation + np.array([0.0, 0.0, 5e-4]))
            if now.stands_free(bodies[name], turned):
                return _put(now, name, turned, f"{name} was turned by {np.degrees(angle):.0f}°")
    return None


def toppled(now: Occasion) -> Deed | None:
    """An object that stands is laid on its side."""
    bodies, poses = now.scenario.bodies, now.truth.poses
    standing = [name for name in _on_table(now) if can_topple(bodies[name], poses[name].rotation)]
    for name in _shuffled(now, standing):
        X_WO = now.truth.poses[name]
        for _ in range(10):
            axis = _about_z(now.rng.uniform(0.0, 2.0 * np.pi)) @ np.array([1.0, 0.0, 0.0])
            rotation = _upright(pin.exp3(np.pi / 2 * axis) @ X_WO.rotation)
            spot = now.spot(now.scenario.bodies[name], rotation, X_WO.translation[:2], (0.0, 0.08))
            if spot is not None:
                return _put(now, name, spot, f"{name} was toppled")
    return None


def has_corners(body: Body, rotation: np.ndarray) -> bool:
    """Does a body that is turned so lie otherwise once it is turned about the vertical? A can that stands does not, nor
    does a ball."""
    shape = body.shape
    return not (isinstance(shape, Sphere) or (isinstance(shape, Cylinder) and abs(rotation[2, 2]) > UPRIGHT))


def can_topple(body: Body, rotation: np.ndarray) -> bool:
    """Could a body that is turned so lie flatter than it stands? A tool is not asked to."""
    height = height_above(body.shape, rotation) + depth_below(body.shape, rotation)
    return body.tool is None and height > TALL * float(min(extents(body.shape)))


def taken_and_returned(now: Occasion) -> Deed | None:
    """An object is taken away and brought back elsewhere some seconds later."""
    names = _shuffled(now, _on_table(now))
    if not names:
        return None
    name, t_back = names[0], now.t + now.rng.uniform(*AWAY)
    later = Later(t_back, partial(brought_back, name=name, X_WO=now.truth.poses[name], since=t_back))
    return Deed(f"{name} was taken away", (TakenAway(start=now.t, name=name),), later=later, names=(name,))


def brought_back(now: Occasion, name: str, X_WO: SE3, since: float) -> Deed | None:
    """What was taken comes back, near X_WO; the longer after `since` (s) there is no room, the further off, in the end
    anywhere on the table."""
    if name in now.truth.poses:
        return None
    across = float(np.linalg.norm(now.scenario.table.size[:2]))
    within = min(BACK + SPREADS * max(0.0, now.t - since - WAITS), across)
    spot = now.spot(now.scenario.bodies[name], X_WO.rotation, X_WO.translation[:2], (0.0, within))
    if spot is None:
        return None
    return Deed(f"{name} was brought back", (Brought(start=now.t, name=name, X_WO=spot),), names=(name,))


def taken_for_good(now: Occasion) -> Deed | None:
    """An object that the goal is about is taken away and does not come back."""
    in_hand = [now.held] if now.held is not None and now.held in _goal_bodies(now) else []
    for name in [*_shuffled(now, now.lacking()), *in_hand]:
        return Deed(f"{name} was taken away for good", (TakenAway(start=now.t, name=name),), names=(name,))
    return None


def new_one(now: Occasion, name: str) -> Deed | None:
    """The late body `name`, if the scene has a place for it, appears on the table: the goal is about it as well."""
    body, centre = now.scenario.bodies.get(name), now.scenario.table.X_WT.translation[:2]
    if body is None or name in now.truth.poses:
        return None
    spot = now.spot(body, np.eye(3), centre, (0.0, 0.35))
    if spot is None:
        return None
    return Deed(f"{name} appeared on the table", (Brought(start=now.t, name=name, X_WO=spot),), names=(name,))


def path_blocked(now: Occasion, name: str) -> Deed | None:
    """The late body `name` is put where the running motion is going to come."""
    phase, controller = now.phase, now.machine.context.controller
    if name in now.truth.poses or phase is None or phase.kind not in ("move", "approach", "slide"):
        return None
    body, passed = now.scenario.bodies[name], controller.time_in_reference
    z = now.table_height() + depth_below(body.shape, np.eye(3)) + 5e-4
    robot = now.machine.robot
    soon = [phase.trajectory.at(float(t))[0] for t in passed + STOPPING]
    for t in now.rng.permutation(np.linspace(passed + SOON, phase.trajectory.duration, AHEAD)).tolist():
        if t < passed + SOON:
            continue
        p = robot.X_WG(phase.trajectory.at(t)[0]).translation
        X_WO = SE3(np.eye(3), np.array([p[0], p[1], z]))
        on_table = (
            np.abs(now.scenario.table.X_WT.actInv(X_WO.translation)[:2]) < np.array(now.scenario.table.size[:2]) / 2
        )
        if not on_table.all() or not now.stands_free(body, X_WO, soon):
            continue
        scene = now.scene.moved(name, X_WO)
        hit = now.motion.audit(scene, phase.trajectory, phase.allowed, since=passed, only=frozenset({name}))
        if hit is not None:
            fault = Brought(start=now.t, name=name, X_WO=X_WO)
            return Deed(f"{name} was put in the way", (fault,), names=(name,), is_certain=True, is_in_the_way=True)
    return None


def knocked_from_hand(now: Occasion) -> Deed | None:
    """What is held is knocked from the hand, onto the table."""
    name = now.held
    if name is None:
        return None
    X_WO = now.truth.poses[name]
    for around, far in ((X_WO.translation[:2], 0.25), (now.scenario.table.X_WT.translation[:2], 0.35)):
        rotation = now.scenario.bodies[name].X_WO.rotation
        spot = now.spot(now.scenario.bodies[name], rotation, around, (0.05, far))
        if spot is not None:
            return replace(_put(now, name, spot, f"{name} was knocked from the hand"), is_certain=True)
    return None


def slipping(now: Occasion) -> Deed | None:
    """The fingers' pads turn slippery for a while, over something that catches what is held."""
    name = now.held
    if name is None or not now.falls_within_reach(SLIPPERY + DROPPING):
        return None
    fault = SlipperyPads(start=now.t, end=now.t + SLIPPERY, friction=0.002)
    return Deed(
        f"the fingers' pads turned slippery for 1 s with {name} in the hand", (fault,), names=(name,), loosens=True
    )


def closes_on_nothing(now: Occasion) -> Deed | None:
    """What the fingers are about to close on is pulled away from between them."""
    action = now.left[0] if now.left else None
    if action is None or action.args[0] not in now.truth.poses:
        return None
    name = action.args[0]
    X_WO = now.truth.poses[name]
    spot = now.spot(now.scenario.bodies[name], X_WO.rotation, X_WO.translation[:2], (0.08, 0.30))
    return None if spot is None else _put(now, name, spot, f"{name} was pulled from between the open fingers")


def sponge_far(now: Occasion) -> Deed | None:
    """The sponge is put at another end of the table."""
    for name in [name for name in now.tools() if name in _on_the_way(now)]:
        X_WO = now.truth.poses[name]
        rotation = _about_z(now.rng.uniform(0.0, np.pi)) @ now.scenario.bodies[name].X_WO.rotation
        spot = now.spot(now.scenario.bodies[name], rotation, X_WO.translation[:2], (0.25, 0.60))
        if spot is not None:
            return _put(now, name, spot, f"{name} was put {100 * _between(X_WO, spot):.0f} cm away")
    return None


def sponge_covered(now: Occasion, cover: str) -> Deed | None:
    """The late body `cover` is put on the sponge."""
    for name in [name for name in now.tools() if name in _on_the_way(now)]:
        top = now.truth.poses[name]
        body = now.scenario.bodies[cover]
        z = height_above(now.scenario.bodies[name].shape, top.rotation) + depth_below(body.shape, np.eye(3)) + 1e-3
        X_WO = SE3(np.eye(3), top.translation + np.array([0.0, 0.0, z]))
        if cover not in now.truth.poses and now.stands_free(body, X_WO):
            sentence = f"{cover} was put on {name}"
            return Deed(sentence, (Brought(start=now.t, name=cover, X_WO=X_WO),), names=(cover, name))
    return None


def sponge_out_of_reach(now: Occasion) -> Deed | None:
    """A sponge that can't be done without is thrown on the floor, far from the robot."""
    tools = now.tools()
    for name in tools:
        wanted = any(fact.args[:1] == (name,) for fact in now.machine.agenda.goal)
        if not wanted and not (len(tools) == 1 and any(now.is_crumb(body) for body in now.lacking())):
            continue
        base = now.scenario.robot.X_WB.translation
        spot = SE3(np.eye(3), np.array([base[0] + 1.8, base[1] + 1.8, 0.1]))
        return _put(now, name, spot, f"{name} was thrown on the floor, out of reach")
    return None


def bin_shifted(now: Occasion) -> Deed | None:
    """A bin that is still needed is shifted, so far that what was to be put into its middle would meet its wall or the
    floor beside it, and not out of reach."""
    wanted = {arg for action in now.left for arg in action.args[1:]}
    places = regions_now(now)
    bins = [name for name, region in places.items() if region.kind == "bin" and name in wanted]
    base = now.scenario.robot.X_WB.translation[:2]
    for name in _shuffled(now, bins):
        region = places[name]
        p = region.X_WR.translation[:2]
        others = [region_hull(other) for other in places.values() if other.name != name]
        others += [table_solid(now.scenario.table), *(body_solid(one) for one in now.scenario.fixtures.values())]
        for share in now.rng.uniform(0.35, 0.6, size=40):
            angle = now.rng.uniform(0.0, 2.0 * np.pi)
            by = share * min(region.size[:2]) * np.array([np.cos(angle), np.sin(angle)])
            is_reached = abs(float(np.linalg.norm(p + by - base)) - float(np.linalg.norm(p - base))) < STRAY
            shift = SE3(np.eye(3), np.array([*by, 0.0]))
            if is_reached and overlap_problem(region_hull(region).moved(shift), others) is None:
                fault = BinShifted(start=now.t, region=name, by=(float(by[0]), float(by[1]), 0.0))
                said = f"{name} was shifted by {100 * np.hypot(*by):.0f} cm"
                return Deed(said, (fault,), names=(name,))
    return None


def crumbs_beside_pan(now: Occasion) -> Deed | None:
    """A crumb comes to lie on the table beside the dustpan's opening, where a sponge has room to push it in aslant."""
    crumbs = [name for name in now.truth.poses if now.is_crumb(name) and name != now.held]
    pans = [region for region in regions_now(now).values() if region.kind == "dustpan"]
    for pan in pans:
        opening = opening_of(pan, now.scenario.table)
        for name in _shuffled(now, [name for name in crumbs if name in _goal_bodies(now)]):
            spot = None if opening is None else _beside(now, now.scenario.bodies[name], opening)
            if spot is not None:
                return _put(now, name, spot, f"{name} came to lie on the table beside {pan.name}")
    return None


def _beside(now: Occasion, body: Body, opening: Opening) -> SE3 | None:
    """A spot from which a straight way leads into the opening at 45° at most, with room for a sponge behind it."""
    for _ in range(DRAWS):
        side, past = now.rng.choice([-1.0, 1.0]) * opening.across, now.rng.uniform(0.01, 0.06)
        before = now.rng.uniform(0.04 + past, 0.16)
        p = opening.middle + (opening.half_width + past) * side - before * opening.inward
        behind = p - BEHIND * (opening.inward - side) / np.sqrt(2.0)
        spot = now.placed(body, np.eye(3), p)
        if spot is not None and now.is_on_table(behind, 0.0):
            return spot
    return None


def goal_changed(now: Occasion) -> Deed | None:
    """Something is wanted in another bin than before."""
    agenda = now.machine.agenda
    facts = agenda.facts(now.machine.context.scene)
    bins = sorted(name for name, region in now.scenario.regions.items() if region.kind == "bin")
    planned = {action.args[0]: action.args[1] for action in now.left if action.name == "place"}
    changeable = {}
    for fact in sorted(agenda.goal - facts):
        if fact.predicate not in ("in_bin", "put_away"):
            continue
        place = fact.args[1] if fact.predicate == "in_bin" else planned.get(fact.args[0], "")
        if place in bins:
            changeable[fact.args[0]] = place
    for name in _shuffled(now, list(changeable)):
        place = changeable[name]
        others = [other for other in bins if other != place and _takes_as_much(now.scenario.regions, other, place)]
        if others:
            other = others[int(now.rng.integers(len(others)))]
            wanted = frozenset(fact for fact in agenda.order if fact.args[:1] != (name,)) | {
                Fact("in_bin", (name, other))
            }
            return Deed(f"{name} is wanted in {other} instead of {place}", goal=wanted, names=(name,))
    return None


def _takes_as_much(regions: Mapping[str, Region], other: str, place: str) -> bool:
    sizes = sorted(regions[other].size[:2]), sorted(regions[place].size[:2])
    return all(a >= b for a, b in zip(*sizes, strict=True))


def regions_now(now: Occasion) -> dict[str, Region]:
    """The regions where they stand in truth."""
    seen = now.truth.regions
    return {n: replace(region, X_WR=seen.get(n, region.X_WR)) for n, region in now.scenario.regions.items()}


def _put(now: Occasion, name: str, X_WO: SE3, sentence: str) -> Deed:
    return Deed(sentence, (Moved(start=now.t, name=name, X_WO=X_WO),), names=(name,))


def _shuffled(now: Occasion, items: Sequence[T]) -> list[T]:
    return [items[k] for k in now.rng.permutation(len(items))]


def _on_table(now: Occasion) -> list[str]:
    """What lies about, is still needed, and not in a region."""
    regions = now.scenario.regions.values()
    return [
        name
        for name in now.lying()
        if not any(
            (np.abs(region.X_WR.actInv(now.truth.poses[name].translation)) < np.array(region.size) / 2).all()
            for region in regions
        )
    ]


def _on_the_way(now: Occasion) -> set[str]:
    """What is still to be taken up, and not in the hand."""
    return {action.args[0] for action in now.left if action.name == "pick"} - {now.held}


def _goal_bodies(now: Occasion) -> set[str]:
    return {fact.args[0] for fact in now.machine.agenda.goal if fact.args}


def _between(X_WA: SE3, X_WB: SE3) -> float:
    return float(np.linalg.norm((X_WB.translation - X_WA.translation)[:2]))


def _about_z(angle: float) -> np.ndarray:
    return pin.exp3(np.array([0.0, 0.0, float(angle)]))


def _upright(rotation: np.ndarray) -> np.ndarray:
    """The nearest rotation in which one of the body's axes points up."""
    axis = int(np.argmax(np.abs(rotation[2])))
    up = rotation[:, axis] * np.sign(rotation[2, axis])
    z = np.array([0.0, 0.0, 1.0])
    turn = np.cross(up, z)
    sine = float(np.linalg.norm(turn))
    return rotation if sine < 1e-9 else pin.exp3(turn / sine * np.arctan2(sine, float(up @ z))) @ rotation
