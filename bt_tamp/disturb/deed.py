"""What is done to a run at one moment, and what whoever does it sees before."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pinocchio import SE3

from bt_tamp.executive.build import Machine
from planner.motion.collision import part_names
from planner.motion.motion_planner import MotionPlanner
from planner.motion.world import obstacles
from planner.refinement import Phase, pairs
from planner.task.symbols import Fact, GroundAction
from scenarios.checks import immovable
from scenarios.goal import is_crumb
from scenarios.scenario import Body, Scenario
from scenarios.shapes import bounding_radius
from scenarios.solids import body_solid
from scenarios.standing import overlap_problem
from sim.disturbance import Fault
from sim.plant import Observation
from sim.scene import SceneState, depth_below

CLEARANCE = 0.01
"""Metres from the arm, at least, at which something is put down."""

EDGE = 0.02
"""Metres by which what is put on the table stays away from its edge."""

BEHIND = 0.08
"""Metres on the table that a sponge takes up behind the middle of a crumb."""

WORKSPACE = (0.42, 0.78)
"""Metres from the robot's axis between which what is put down can be taken up again."""

CAUGHT = 0.03
"""Metres by which the middle of what falls must be inside the edge of what it falls on."""

ON_TOP = 0.005
"""Metres between the table's top and what stands on it."""

FALLS = 9
"""Moments at which it is looked where something would fall."""

DRAWS = 60


@dataclass(frozen=True)
class Later:
    """What follows a deed at time `t` (s)."""

    t: float
    draw: "Draw"


@dataclass(frozen=True)
class Deed:
    """What is done: a sentence in the past tense for the story, faults for the plant, what is wanted from now on (None:
    as before), and what follows. names: the bodies and regions concerned. is_certain: it matters whatever comes of it,
    as its draw made sure (else it must be seen to have changed something). is_in_the_way: of the running motion.
    loosens: what is named first may part from the hand."""

    sentence: str
    faults: tuple[Fault, ...] = ()
    goal: frozenset[Fact] | None = None
    later: Later | None = None
    names: tuple[str, ...] = ()
    is_certain: bool = False
    is_in_the_way: bool = False
    loosens: bool = False


@dataclass(frozen=True)
class Occasion:
    """The moment: time t (s), the true state of the world, the machine that runs, and a stream of chance.

    `motion` answers the disturber's own questions about collisions; nothing is counted for the run's planner.
    """

    t: float
    truth: Observation
    machine: Machine
    motion: MotionPlanner
    rng: np.random.Generator

    @property
    def scenario(self) -> Scenario:
        return self.machine.context.scene.scenario

    @property
    def scene(self) -> SceneState:
        """The true scene, the hand as it is believed."""
        believed = self.machine.context.scene
        poses = dict(self.truth.poses)
        held = believed.held if believed.held is not None and believed.held.name in poses else None
        return SceneState(believed.scenario, poses, self.truth.q, self.truth.opening, held)

    @property
    def held(self) -> str | None:
        """What is in the hand."""
        held = self.scene.held
        return held.name if held else None

    @property
    def phase(self) -> Phase | None:
        """What the arm does now, None while it plans."""
        return self.machine.context.phase if self.machine.agenda.running is not None else None

    @property
    def left(self) -> tuple[GroundAction, ...]:
        """The actions that are left, the running one first."""
        return self.machine.agenda.left

    def lying(self) -> list[str]:
        """Bodies of actions that are left, and of what the goal lacks, that lie about; in that order."""
        agenda = self.machine.agenda
        facts = agenda.facts(self.machine.context.scene)
        wanted = [fact.args[0] for fact in sorted(agenda.goal - facts) if fact.args]
        names = dict.fromkeys([*(action.args[0] for action in self.left), *wanted])
        return [name for name in names if name in self.truth.poses and name != self.held]

    def lacking(self) -> list[str]:
        """Bodies that are there, not in the hand, and that the goal still lacks."""
        agenda = self.machine.agenda
        missing = agenda.goal - agenda.facts(self.machine.context.scene)
        names = sorted({fact.args[0] for fact in missing if fact.args})
        return [name for name in names if name in self.truth.poses and name != self.held]

    def is_crumb(self, name: str) -> bool:
        """Is a body a crumb?"""
        return is_crumb(self.scenario.bodies[name], self.scenario.robot.model)

    def tools(self) -> list[str]:
        """Sponges that are there and still needed."""
        bodies = self.scenario.bodies
        needed = {arg for action in self.left for arg in action.args} | set(self.lacking())
        wipes = any(self.is_crumb(name) for name in self.lacking())
        return [name for name in self.truth.poses if bodies[name].tool == "sponge" and (wipes or name in needed)]

    def table_height(self) -> float:
        """Height of the table's top in W."""
        table = self.scenario.table
        return float(table.X_WT.translation[2]) + table.size[2] / 2

    def falls_within_reach(self, seconds: float) -> bool:
        """Would what is held, let go of now or within so many seconds, fall onto the table or into a region?"""
        held, phase = self.scene.held, self.phase
        if held is None:
            return False
        hands = [self.machine.robot.X_WG(self.truth.q)]
        if phase is not None:
            passed = self.machine.context.controller.time_in_reference
            times = np.linspace(passed, passed + seconds, FALLS)
            hands += [self.machine.robot.X_WG(phase.trajectory.at(float(t))[0]) for t in times]
        return all(self._is_caught((X_WG * held.X_GO).translation) for X_WG in hands)

    def _is_caught(self, p: np.ndarray) -> bool:
        table = self.scenario.table
        places = [(table.X_WT, table.size), *((region.X_WR, region.size) for region in self.scenario.regions.values())]
        return any((np.abs(X_WS.actInv(p)[:2]) < np.array(size[:2]) / 2 - CAUGHT).all() for X_WS, size in places)

    def stands_free(self, body: Body, X_WO: SE3, soon: Sequence[np.ndarray] = ()) -> bool:
        """Can a body be put at X_WO without overlapping anything, the arm and what it holds included, where that is now
        and at `soon` (7,) as well?"""
        return not self.is_taken(body, X_WO) and self._is_clear(body, X_WO, soon)

    def is_taken(self, body: Body, X_WO: SE3) -> bool:
        """Would a body at X_WO overlap anything but the arm?"""
        around = [
            body_solid(self.scenario.bodies[name], X) for name, X in self.truth.poses.items() if name != body.name
        ]
        return overlap_problem(body_solid(body, X_WO), [*immovable(self.scenario), *around]) is not None

    def _is_clear(self, body: Body, X_WO: SE3, soon: Sequence[np.ndarray]) -> bool:
        """Does a body at X_WO keep clear of the arm and what that holds, where it is now and at `soon` (7,)?"""
        scene = self.scene
        if scene.held is not None and scene.held.name == body.name:
            scene = replace(scene, held=None)
        alone = replace(scene.moved(body.name, X_WO), poses={body.name: X_WO, **_held_pose(scene)})
        # What the arm or what it holds touches besides, a sponge the table in a stroke, is no matter here.
        mine = frozenset(part_names(self.machine.robot, scene.held))
        others = frozenset(obstacle.name for obstacle in obstacles(alone)) - {body.name}
        allowed = pairs(mine, others)
        return all(self.motion.free(alone, q, allowed, CLEARANCE) for q in (self.truth.q, *soon))

    def spot(self, body: Body, rotation: np.ndarray, around: np.ndarray, distances: tuple[float, float]) -> SE3 | None:
        """A free place on the table for a body turned so: its distance (m) in the plane from `around` (2,) within
        `distances`; None if none was found."""
        margin = BEHIND if self.is_crumb(body.name) else EDGE + min(bounding_radius(body.shape), 0.06)
        for _ in range(DRAWS):
            angle, distance = self.rng.uniform(0.0, 2.0 * np.pi), self.rng.uniform(*distances)
            p = around + distance * np.array([np.cos(angle), np.sin(angle)])
            X_WO = self.placed(body, rotation, p)
            if X_WO is not None and self.is_on_table(p, margin):
                return X_WO
        return None

    def placed(self, body: Body, rotation: np.ndarray, p: np.ndarray) -> SE3 | None:
        """A body turned so at p (2,) on the table, within reach; None if it doesn't stand free there."""
        z = self.table_height() + depth_below(body.shape, rotation) + 5e-4
        X_WO, reach = SE3(rotation, np.array([*p, z])), np.linalg.norm(p - self.scenario.robot.X_WB.translation[:2])
        is_good = self.is_on_table(p, 0.0) and WORKSPACE[0] < reach < WORKSPACE[1] and self.stands_free(body, X_WO)
        return X_WO if is_good else None

    def is_on_top(self, body: Body, X_WO: SE3) -> bool:
        """Does a body at X_WO stand on the table's top?"""
        height = float(X_WO.translation[2]) - depth_below(body.shape, X_WO.rotation) - self.table_height()
        return abs(height) < ON_TOP and self.is_on_table(X_WO.translation[:2], 0.0)

    def is_on_table(self, p: np.ndarray, margin: float) -> bool:
        """Does a point (2,) lie at least `margin` metres inside the table's edges?"""
        table = self.scenario.table
        local = table.X_WT.actInv(np.array([*p, self.table_height()]))[:2]
        return bool((np.abs(local) < np.array(table.size[:2]) / 2 - margin).all())


Draw = Callable[[Occasion], Deed | None]
"""Draws one instance for an occasion; None if there is nothing to do then."""


def _held_pose(scene: SceneState) -> dict[str, SE3]:
    return {} if scene.held is None else {scene.held.name: scene.poses[scene.held.name]}
