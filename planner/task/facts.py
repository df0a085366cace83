"""The believed scene stated in the planner's predicates.

in_bin(o, place)  o lies in a region, or on the table      holding(o)    the hand holds o
put_away(o)       o lies in some bin                       hand_empty()  it holds nothing
is_sponge(o)      o is a tool to wipe with
graspable(o), away(o)  nothing learned speaks against grasping o as it lies; o isn't known to be in the way
"""

from collections.abc import Iterable
from typing import Protocol

import numpy as np

from planner.task.pddl import Domain, Problem
from planner.task.primitives import AWAY, GRASPABLE
from planner.task.symbols import Fact
from scenarios.goal import is_crumb, parse_goal
from scenarios.names import TABLE
from scenarios.regions import interior
from scenarios.scenario import Region, Scenario
from scenarios.shapes import Box, Cylinder, Shape, Sphere
from sim.scene import SceneState

OBSERVED = frozenset({"in_bin", "put_away", "holding", "hand_empty", "is_sponge"})
"""Predicates that the scene alone decides."""

REST_ABOVE = 0.02
REST_BELOW = 0.01
"""Metres that a body's lowest point may lie above or below a surface on which it counts as resting."""


class Optimism(Protocol):
    """What was learned of bodies as they lie (`planner.task.learned`)."""

    def is_graspable(self, name: str, scene: SceneState) -> bool:
        """Does nothing learned speak against grasping the body as it lies?"""
        ...

    def is_away(self, name: str, scene: SceneState) -> bool:
        """Is the body not where it is known to be in the way?"""
        ...


def place_of(scene: SceneState, name: str) -> str | None:
    """Where a body lies: a region's name, "table", or None (in the hand, on the floor, in the air).

    In a region: the centre inside its walls and below its rim. On the table: the centre above the
    plate and the lowest point near its top.
    """
    if (scene.held is not None and scene.held.name == name) or name not in scene.poses:
        return None
    X_WO = scene.poses[name]
    for region in scene.scenario.regions.values():
        if _is_inside(region, X_WO.translation):
            return region.name
    table = scene.scenario.table
    X_TO = table.X_WT.actInv(X_WO)
    half = np.array(table.size) / 2
    height = X_TO.translation[2] - _depth(scene.scenario.bodies[name].shape, X_TO.rotation) - half[2]
    is_above = bool(np.all(np.abs(X_TO.translation[:2]) <= half[:2]))
    return TABLE if is_above and -REST_BELOW <= height <= REST_ABOVE else None


def observed_facts(scene: SceneState) -> frozenset[Fact]:
    """The facts that the scene alone decides."""
    bins = {name for name, region in scene.scenario.regions.items() if region.kind == "bin"}
    found = {Fact("hand_empty") if scene.held is None else Fact("holding", (scene.held.name,))}
    for name in scene.poses:
        place = place_of(scene, name)
        if place is not None:
            found.add(Fact("in_bin", (name, place)))
        if place in bins:
            found.add(Fact("put_away", (name,)))
        if scene.scenario.bodies[name].tool == "sponge":
            found.add(Fact("is_sponge", (name,)))
    return frozenset(found)


def facts(scene: SceneState, learned: Optimism) -> frozenset[Fact]:
    """Everything that holds in the scene, given what failures have taught."""
    solid = [name for name in scene.poses if kind_of(scene.scenario, name) != "crumb"]
    graspable = {Fact(GRASPABLE, (name,)) for name in solid if learned.is_graspable(name, scene)}
    away = {Fact(AWAY, (name,)) for name in scene.poses if learned.is_away(name, scene)}
    return observed_facts(scene) | graspable | away


def kind_of(scenario: Scenario, name: str) -> str:
    """The PDDL type of a body: crumb, movable or tool."""
    body = scenario.bodies[name]
    if body.tool is not None:
        return "tool"
    return "crumb" if is_crumb(body, scenario.robot.model) else "movable"


def objects_of(scene: SceneState) -> dict[str, str]:
    """Every body and surface with its PDDL type."""
    scenario = scene.scenario
    bodies = {name: kind_of(scenario, name) for name in scene.poses}
    return {**bodies, **{name: region.kind for name, region in scenario.regions.items()}, TABLE: "tabletop"}


def problem_of(
    scene: SceneState, goal: Iterable[Fact], learned: Optimism, name: str = "observed", domain: str = "table-cleaning"
) -> Problem:
    """The problem of reaching the goal from the scene as it is, for the catalogue's domain."""
    return Problem(name, domain, objects_of(scene), facts(scene, learned), frozenset(goal))


def goal_facts(text: str) -> frozenset[Fact]:
    """The literals of a goal, `(and (in_bin book right_bin) …)`. Raises scenarios.goal.GoalError."""
    return frozenset(Fact(predicate, args) for predicate, args in parse_goal(text))


def stated_in(domain: Domain, objects: Iterable[str], found: Iterable[Fact]) -> frozenset[Fact]:
    """Those of the facts that the domain's predicates and the objects can state."""
    names = set(objects)
    counts = {name: len(parameters) for name, parameters in domain.predicates.items()}
    return frozenset(f for f in found if counts.get(f.predicate) == len(f.args) and names.issuperset(f.args))


def _is_inside(region: Region, p_W: np.ndarray) -> bool:
    lower, upper = interior(region)
    p_R = region.X_WR.actInv(p_W)
    return bool(np.all(p_R >= lower - [0.0, 0.0, REST_BELOW]) and np.all(p_R <= upper))


def _depth(shape: Shape, R: np.ndarray) -> float:
    """How far the shape, turned by R, reaches below its centre, in metres."""
    match shape:
        case Box(size):
            return float(np.abs(R[2]) @ np.array(size)) / 2
        case Cylinder(radius, height):
            return float(np.hypot(R[2, 0], R[2, 1]) * radius + abs(R[2, 2]) * height / 2)
        case Sphere(radius):
            return radius
