"""Drag: slide a flat object over the table's edge, where it can be grasped then."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from pinocchio import SE3
from py_trees.behaviour import Behaviour

from planner.failure import MotionFailure, RefinementFailure
from planner.refinement import Budget, Hints, Phase, Refinement
from planner.task.facts import place_of
from planner.task.symbols import GroundAction
from scenarios.names import TABLE
from scenarios.scenario import Body, Table
from scenarios.shapes import reach
from sim.scene import SceneState
from skills.context import ActionRun, SkillContext
from skills.pick import Pick
from skills.pressing import Pressing, in_order
from skills.skill import Toolkit, Unfit, beyond_reach, laden, refine_by_sampling
from skills.towing import (
    EDGE_MARGIN,
    PHASES,
    Tips,
    fixed_in_way,
    is_on_top,
    margin_inside,
    press_pose,
    tip_points,
    tow,
    ways_of_pressing,
    ways_to_press,
)
from skills.towing_tree import towing_tree
from skills.waypoints import shifted

OVERHANGS = (0.06, 0.075, 0.09, 0.045)
"""Metres by which the object is to stand out beyond the edge: enough for the fingers' pads."""

SLANTS = np.radians([0.0, 20.0, -20.0, 40.0, -40.0])
"""Directions of drags off the edge's normal."""

SHORTEST = 0.02
"""Metres that a drag takes the object at least: after less it would count as lying where it lay."""

LEFT_OVER = 0.3
"""Fraction of the overhang, and of the way, that may be missing after a drag."""

MAX_TIPS = 8
"""Ways to press that are tried for one end pose."""

GRASP_BUDGET = Budget()
DISCOURAGED = 0.1
"""Metres of way that an edge's every failure counts for, in choosing among edges."""


@dataclass(frozen=True)
class End:
    """Where a drag ends: with `overhang` metres beyond the table's edge `edge` (0…3: +x, −x, +y, −y of the table),
    along a way that is `slant` rad off the edge's normal."""

    edge: int
    overhang: float
    slant: float

    def pose(self, body: Body, X_WO: SE3, table: Table) -> SE3:
        """The object's pose X_WO there."""
        normal = edge_normal(table, self.edge)
        left = np.array([-normal[1], normal[0], 0.0])
        way = self.overhang - standing_out(body, X_WO, table, self.edge)
        return shifted(X_WO, way * (normal + np.tan(self.slant) * left))


@dataclass(frozen=True)
class Pull:
    """A drag: where to, where the fingertips press, and how."""

    end: End
    tips: Tips
    pressing: Pressing


def edge_normal(table: Table, edge: int) -> np.ndarray:
    """Outward unit vector (3,) in W of one of the table's edges."""
    local = np.zeros(3)
    local[edge // 2] = 1.0 if edge % 2 == 0 else -1.0
    return table.X_WT.rotation @ local


def standing_out(body: Body, X_WO: SE3, table: Table, edge: int) -> float:
    """Metres by which the object at X_WO stands out beyond an edge; negative while it doesn't."""
    normal = edge_normal(table, edge)
    half = reach(body.shape, X_WO.rotation.T @ normal)
    inside = table.size[edge // 2] / 2 - float((X_WO.translation - table.X_WT.translation) @ normal)
    return half - inside


def ends(body: Body, X_WO: SE3, table: Table, rng: np.random.Generator) -> list[list[tuple[float, End]]]:
    """For every edge the poses that a drag may end in, with what each costs, in metres of way: the cheapest first.

    The centre of mass stays above the table and the object leaves it on one side only.
    """
    return [_ends_at(edge, body, X_WO, table, rng) for edge in range(4)]


def _ends_at(edge: int, body: Body, X_WO: SE3, table: Table, rng: np.random.Generator) -> list[tuple[float, End]]:
    found = []
    for rank, overhang in enumerate(OVERHANGS):
        for slant in SLANTS:
            end = End(edge, overhang, float(slant))
            X_WO_end = end.pose(body, X_WO, table)
            way = overhang - standing_out(body, X_WO, table, edge)
            if way < SHORTEST or margin_inside(table, X_WO_end.translation) < EDGE_MARGIN:
                continue
            if any(_leaves(body, X_WO, X_WO_end, table, other) for other in range(4) if other != edge):
                continue
            cost = way / np.cos(slant) + 0.02 * rank + 0.03 * rng.random()
            found.append((float(cost), end))
    return sorted(found, key=lambda entry: entry[0])


def _leaves(body: Body, X_WO: SE3, X_WO_end: SE3, table: Table, edge: int) -> bool:
    """Does the object stand out beyond an edge in the end, more than it does now?"""
    now, then = (standing_out(body, X, table, edge) for X in (X_WO, X_WO_end))
    return then > max(now, 0.0) + 1e-6


class Drag:
    """`drag(object, table)`: fingertips press on the object and take it over an edge, where a grasp is found for it."""

    name = "drag"
    arity = 2
    phases: tuple[str, ...] = PHASES

    def __init__(self, toolkit: Toolkit) -> None:
        self._kit = toolkit
        self._pick = Pick(toolkit)

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        body = scene.scenario.bodies[action.args[0]]
        beyond = beyond_reach(self._kit, action, scene)
        if beyond is not None:
            return beyond
        pressings = ways_of_pressing(self._kit, action, scene)
        if isinstance(pressings, RefinementFailure):
            return pressings
        search = _Search(self._kit, self._pick, action, scene, rng)
        samples = search.pulls(body, in_order(pressings, hints)[0])
        nothing = f"{body.name} offers the fingertips no room, or comes to no edge within the arm's reach"
        outcome = refine_by_sampling(action, scene, samples, search.attempt, budget, hints, nothing)
        crashes = (*outcome.crashes, *search.crashes)
        if isinstance(outcome, RefinementFailure) and search.second_best is not None:
            return replace(search.second_best, crashes=crashes)
        return replace(outcome, crashes=crashes)

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        name = refinement.action.args[0]
        pull: Pull = refinement.sample
        X_WO_end = pull.end.pose(scene.scenario.bodies[name], scene.poses[name], scene.scenario.table)
        last = refinement.phases[-1]
        return replace(scene.moved(name, X_WO_end), q=last.trajectory.end, opening=0.0)

    def subtree(self, run: ActionRun, context: SkillContext) -> Behaviour:
        name = run.action.args[0]

        def stands_out(scene: SceneState) -> bool:
            pull: Pull | None = run.refinement.sample if run.refinement else None
            if pull is None or name not in scene.poses:
                return False
            body, table = scene.scenario.bodies[name], scene.scenario.table
            if place_of(scene, name) != TABLE:
                return False
            out = standing_out(body, scene.poses[name], table, pull.end.edge)
            tow = run.phase("drag").trajectory
            start, end = (context.robot.X_WG(q).translation for q in (tow.at(0.0)[0], tow.end))
            way = float(np.linalg.norm(end - start))
            return out > pull.end.overhang - LEFT_OVER * min(pull.end.overhang, way)

        return towing_tree(self._kit.motion, run, context, self.predict, stands_out)


@dataclass
class _Search:
    """One search for a drag: which ends have a grasp, and how often each edge has failed.

    A drag counts only if a grasp is found where it ends. What else can be moved aside may still be in that grasp's
    way: then the drag is `second_best`, for when there is no better one. crashes: errors met in seeking grasps.
    """

    kit: Toolkit
    pick: Pick
    action: GroundAction
    scene: SceneState
    rng: np.random.Generator
    second_best: Refinement | None = None
    crashes: list[str] = field(default_factory=list)
    _failures: list[int] = field(default_factory=lambda: [0, 0, 0, 0])
    _grasps: dict[tuple[End, frozenset[str]], RefinementFailure | None] = field(default_factory=dict)
    _hopeless: set[End] = field(default_factory=set)

    def pulls(self, body: Body, pressing: Pressing) -> Iterator[Pull]:
        """Samples, the edges by way and by how often they have failed."""
        scene = self.scene
        found = ends(body, scene.poses[body.name], scene.scenario.table, self.rng)
        left = [
            [(cost, end) for cost, end in reversed(entries) if self._is_within_reach(body, end)] for entries in found
        ]
        while any(left):
            edge = min(
                (edge for edge in range(4) if left[edge]),
                key=lambda edge: left[edge][-1][0] + DISCOURAGED * self._failures[edge],
            )
            end = left[edge].pop()[1]
            for tips in self._fitting(body, end):
                yield Pull(end, tips, pressing)
                if end in self._hopeless:
                    break
            self._failures[edge] += 1

    def _is_within_reach(self, body: Body, end: End) -> bool:
        X_WO_end = end.pose(body, self.scene.poses[body.name], self.scene.scenario.table)
        return beyond_reach(self.kit, self.action, self.scene.moved(body.name, X_WO_end)) is None

    def attempt(self, pull: Pull, world: SceneState) -> tuple[Phase, ...] | MotionFailure | Unfit:
        """The motion of one sample, or why there is none."""
        name = self.action.args[0]
        body, table, X_WO = world.scenario.bodies[name], world.scenario.table, world.poses[name]
        X_WO_end = pull.end.pose(body, X_WO, table)
        if not self._fits(body, X_WO, X_WO_end, pull.tips):
            return Unfit("the fingertips would not stay on it, above the table")
        on_it = laden(self.action, world)
        if on_it is not None:
            return on_it
        wall = fixed_in_way(world.scenario, body, X_WO, X_WO_end)
        if wall is not None:
            self._hopeless.add(pull.end)
            return Unfit(f"{wall} stands in its way")
        missing = self._missing_grasp(pull, X_WO_end, world)
        if missing is not None and not missing.culprit_sets:
            self._hopeless.add(pull.end)
            return MotionFailure(f"it could not be grasped there: {missing.reason}")
        phases = tow(self.kit, self.action, world, X_WO_end, pull.tips, pull.pressing)
        if missing is None or not isinstance(phases, tuple):
            return phases
        self._hopeless.add(pull.end)
        if self.second_best is None:
            self.second_best = Refinement(self.action, pull, phases)
        return MotionFailure(f"something would be in the way of a grasp there: {missing.reason}")

    def _missing_grasp(self, pull: Pull, X_WO_end: SE3, world: SceneState) -> RefinementFailure | None:
        """None if a grasp is found where the drag ends, else why there is none."""
        key = pull.end, frozenset(world.poses)
        if key not in self._grasps:
            picking = GroundAction(Pick.name, self.action.args[:2])
            there = replace(world.moved(self.action.args[0], X_WO_end), opening=0.0)
            found = self.pick.refine(picking, there, self.rng, GRASP_BUDGET, Hints())
            self.crashes += found.crashes
            self._grasps[key] = found if isinstance(found, RefinementFailure) else None
        return self._grasps[key]

    def _fitting(self, body: Body, end: End) -> list[Tips]:
        X_WO = self.scene.poses[body.name]
        X_WO_end = end.pose(body, X_WO, self.scene.scenario.table)
        ways = ways_to_press(self.rng)
        return [tips for tips in ways if self._fits(body, X_WO, X_WO_end, tips)][:MAX_TIPS]

    def _fits(self, body: Body, X_WO: SE3, X_WO_end: SE3, tips: Tips) -> bool:
        """Are the fingertips on the object all along, and above the table in the end?"""
        X_WG = press_pose(body, X_WO, X_WO_end.translation - X_WO.translation, tips)
        points = tip_points(X_WG, self.kit.robot.gripper)
        if not is_on_top(body, X_WO, points):
            return False
        way = X_WO_end.translation - X_WO.translation
        return min(margin_inside(self.scene.scenario.table, point + way) for point in points) >= EDGE_MARGIN
