"""Hand-made scenes and a stand-in for skills, with which the loop can be watched without geometry."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from pinocchio import SE3

from planner.failure import Blocked, RefinementFailure
from planner.motion.trajectory import Trajectory
from planner.refinement import Budget, Hints, Phase, Refinement
from planner.task.symbols import GroundAction
from scenarios.regions import interior
from scenarios.scenario import Body, Region, RobotPlacement, Scenario, Table
from scenarios.shapes import Box, extents
from sim.scene import Held, SceneState

GREY = (0.5, 0.5, 0.5, 1.0)
Q = np.zeros(7)


def at(x: float, y: float, z: float = 0.0) -> SE3:
    return SE3(np.eye(3), np.array([x, y, z]))


def tabletop_scene(solid: str = "", crumbs: str = "", bins: tuple[str, ...] = ("left_bin", "right_bin")) -> SceneState:
    """A table of 1 m × 1 m with its top at z = 0, bins beside it, a tray beyond its far edge, a sponge in the tray."""
    bodies = {}
    for index, name in enumerate(solid.split()):
        x, y = -0.4 + 0.12 * (index % 7), -0.4 + 0.12 * (index // 7)
        bodies[name] = Body(name, Box((0.06, 0.06, 0.06)), 0.3, 0.5, GREY, at(x, y, 0.03))
    for index, name in enumerate(crumbs.split()):
        bodies[name] = Body(name, Box((0.02, 0.02, 0.02)), 0.01, 0.5, GREY, at(0.45, -0.4 + 0.05 * index, 0.01))
    bodies["sponge"] = Body("sponge", Box((0.1, 0.06, 0.04)), 0.05, 0.5, GREY, at(0.75, 0, -0.08), tool="sponge")
    regions = {
        name: Region(name, "bin", (0.5, 0.5, 0.2), 0.01, at(0, 1.0 + index, -0.1), 0.5)
        for index, name in enumerate(bins)
    }
    regions["dustpan"] = Region("dustpan", "dustpan", (0.4, 0.4, 0.1), 0.01, at(0.75, 0, -0.06), 0.5, "-x")
    robot = RobotPlacement("iiwa14_wsg50", SE3.Identity(), Q)
    table = Table((1.0, 1.0, 0.05), at(0, 0, -0.025), 0.5)
    return SceneState.initial(Scenario("hand-made", 0, robot, table, regions, {}, bodies, ""), 0.1)


def lies_at_start(scene: SceneState, name: str) -> bool:
    """Does a body lie where the scenario has it?"""
    is_held = scene.held is not None and scene.held.name == name
    start = scene.scenario.bodies[name].X_WO.translation
    return not is_held and bool(np.allclose(scene.poses[name].translation, start))


Blocking = Callable[[GroundAction, int, SceneState], set[str] | None]
"""What keeps a sample from working: bodies, an empty set for something else, None for nothing."""


@dataclass
class StandIn:
    """Refines every primitive by asking what blocks a sample; samples are numbers, and choose slots and drag ends."""

    blocking: Blocking
    pool: int = 100
    calls: list[tuple[str, list[int], frozenset[int]]] = field(default_factory=list)

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        attempts = []
        for sample in self._order(hints, budget.tries):
            culprits = self.blocking(action, sample, scene)
            attempts.append(Blocked(sample, "blocked", frozenset(culprits or ())))
            if culprits is None:
                attempts.pop()
                self.calls.append((str(action), [*(a.sample for a in attempts), sample], hints.avoid))
                phase = Phase("go", "move", Trajectory.standstill(scene.q), scene.opening)
                return Refinement(action, sample, (phase,))
        self.calls.append((str(action), [a.sample for a in attempts], hints.avoid))
        return RefinementFailure(action, "every sample is blocked", tuple(attempts))

    def _order(self, hints: Hints, tries: int) -> Iterator[int]:
        others = (n for n in range(self.pool) if n not in hints.avoid and n not in hints.first)
        samples = (*hints.first, *others)
        return iter(samples[:tries])

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        name, *rest = refinement.action.args
        sample = refinement.sample
        match refinement.action.name:
            case "pick":
                return replace(scene, held=Held(name, at(0, 0, 0.001 * sample)))
            case "place":
                return replace(self._put(scene, name, rest[0], sample), held=None)
            case "wipe":
                return self._put(scene, name, rest[1], sample)
            case "drag" | "drag_aside":
                X_WO = scene.poses[name]
                return scene.moved(name, at(0, -0.1 - 0.02 * sample) * X_WO)
        raise AssertionError(refinement.action)

    def _put(self, scene: SceneState, name: str, place: str, sample: int) -> SceneState:
        height = extents(scene.scenario.bodies[name].shape)[2] / 2
        offset = at(-0.05 + 0.02 * (sample % 5), -0.05 + 0.02 * (sample // 5 % 5), height + 0.001)
        if place == "table":
            table = scene.scenario.table
            return scene.moved(name, table.X_WT * at(0.1, 0.1, table.size[2] / 2) * offset)
        region = scene.scenario.regions[place]
        lower, _ = interior(region)
        return scene.moved(name, region.X_WR * at(0, 0, lower[2]) * offset)


@pytest.fixture
def tabletop() -> Callable[..., SceneState]:
    return tabletop_scene


@pytest.fixture
def stand_in() -> type[StandIn]:
    return StandIn


@pytest.fixture
def is_at_start() -> Callable[[SceneState, str], bool]:
    return lies_at_start
