"""The believed scene stated in the planner's predicates.

in_bin(o, place)  o lies in a region, or on the table      holding(o)    the hand holds o
put_away(o)       o lies in some bin                       hand_empty()  it holds nothing
is_sponge(o)      o is a tool to wipe with
graspable(o)      nothing learned speaks against grasping o as it lies
stuck(o)          o can't be taken up as it lies: the opposite of graspable, or more
away(o)           o isn't where it is known to be in the way
"""

from collections.abc import Iterable
from functools import lru_cache
from typing import Protocol

from planner.support import borne, supports
from planner.task.layout import Layout, layout
from planner.task.pddl import Domain
from planner.task.primitives import AWAY, GRASPABLE, STUCK
from planner.task.symbols import Fact
from scenarios.goal import parse_goal
from scenarios.names import TABLE
from sim.scene import SceneState

OBSERVED = frozenset({"in_bin", "put_away", "holding", "hand_empty", "is_sponge"})
"""Predicates that the scene alone decides."""


class Optimism(Protocol):
    """What was learned of bodies as they lie (`planner.task.learned`)."""

    def ungraspable(self, scene: SceneState) -> frozenset[str]:
        """Bodies known to have no grasp as they lie."""
        ...

    def stuck(self, scene: SceneState) -> frozenset[str]:
        """Bodies that can't be taken up as they lie and must be moved otherwise first."""
        ...

    def in_the_way(self, scene: SceneState) -> frozenset[str]:
        """Bodies that lie where they are known to be in the way."""
        ...


def place_of(scene: SceneState, name: str) -> str | None:
    """Where a body lies: a region's name, "table", or None (in the hand, on the floor, in the air).

    In a region: the centre inside its walls and below its rim. On the table: the centre above the
    plate and the lowest point near its top. Or on top of something on the table or in a dustpan (but for
    crumbs: only what lies on the table itself can be wiped). What stands on what the hand holds counts as on the
    table: there it can be taken from once that is put down.
    """
    return _place_of(scene, name, layout(scene.scenario))


def _place_of(scene: SceneState, name: str, fixed: Layout) -> str | None:
    if (scene.held is not None and scene.held.name == name) or name not in scene.poses:
        return None
    place = fixed.place_of(name, scene.poses[name])
    if place is not None or fixed.kinds[name] == "crumb":
        return place
    over = fixed.over(scene.poses[name])
    if over is not None:
        fixtures = scene.scenario.fixtures if over == TABLE else ()
        if any(other in fixtures or _place_of(scene, other, fixed) == over for other in supports(scene, name)):
            return over
    return TABLE if name in borne(scene) else None


def observed_facts(scene: SceneState) -> frozenset[Fact]:
    """The facts that the scene alone decides."""
    fixed = layout(scene.scenario)
    return _observed(fixed, *_places(scene, fixed))


def facts(scene: SceneState, learned: Optimism) -> frozenset[Fact]:
    """Everything that holds in the scene, given what failures have taught; the same set for the same."""
    fixed = layout(scene.scenario)
    known = learned.ungraspable(scene), learned.stuck(scene), learned.in_the_way(scene)
    return _stated(fixed, *_places(scene, fixed), *known)


_Places = tuple[tuple[str, str | None], ...]


def _places(scene: SceneState, fixed: Layout) -> tuple[_Places, str | None]:
    """Every body with its place, and what the hand holds."""
    places = tuple([(name, _place_of(scene, name, fixed)) for name in scene.poses])
    return places, None if scene.held is None else scene.held.name


# Asked at every tick of the tree, and little of it changes from one to the next.
@lru_cache(maxsize=64)
def _observed(fixed: Layout, places: _Places, held: str | None) -> frozenset[Fact]:
    found = {Fact("hand_empty") if held is None else Fact("holding", (held,))}
    for name, place in places:
        if name in fixed.sponges:
            found.add(Fact("is_sponge", (name,)))
        if place is not None:
            found.add(Fact("in_bin", (name, place)))
        if place in fixed.bins:
            found.add(Fact("put_away", (name,)))
    return frozenset(found)


@lru_cache(maxsize=64)
def _stated(
    fixed: Layout,
    places: _Places,
    held: str | None,
    ungraspable: frozenset[str],
    stuck: frozenset[str],
    in_the_way: frozenset[str],
) -> frozenset[Fact]:
    names = frozenset(name for name, _ in places)
    solid = frozenset(name for name in names if fixed.kinds[name] != "crumb")
    lying = {Fact(GRASPABLE, (name,)) for name in solid - ungraspable}
    lying |= {Fact(STUCK, (name,)) for name in solid & stuck}
    lying |= {Fact(AWAY, (name,)) for name in names - in_the_way}
    return _observed(fixed, places, held) | lying


def objects_of(scene: SceneState) -> dict[str, str]:
    """Every body and surface with its PDDL type: crumb, movable, tool; bin, dustpan, tabletop."""
    fixed = layout(scene.scenario)
    return {**{name: fixed.kinds[name] for name in scene.poses}, **fixed.surfaces}


def goal_facts(text: str) -> frozenset[Fact]:
    """The literals of a goal, `(and (in_bin book right_bin) …)`. Raises scenarios.goal.GoalError."""
    return frozenset(Fact(predicate, args) for predicate, args in parse_goal(text))


def stated_in(domain: Domain, objects: Iterable[str], found: Iterable[Fact]) -> frozenset[Fact]:
    """Those of the facts that the domain's predicates and the objects can state."""
    names = set(objects)
    counts = {name: len(parameters) for name, parameters in domain.predicates.items()}
    return frozenset(f for f in found if counts.get(f.predicate) == len(f.args) and names.issuperset(f.args))
