"""Random obstacle courses without geometry, to watch task planning alone: the scenes and the stand-in of `bench task`.

A course says which things have to leave their places before which others can be taken or wiped, and which lie flat, so
that no grasp is found before they are dragged. `StandIn` answers the search-then-sample loop accordingly.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from pinocchio import SE3

from planner.failure import Blocked, RefinementFailure
from planner.motion.trajectory import Trajectory
from planner.refinement import Budget, Hints, Phase, Refinement
from planner.task.situation import is_displaced, whereabouts
from planner.task.symbols import GroundAction
from scenarios.goal import goal_text, parse_goal
from scenarios.names import TABLE
from scenarios.scenario import Body, Region, RobotPlacement, Scenario, Table
from scenarios.shapes import Box
from sim.robot import RobotModel
from sim.scene import Held, SceneState

BINS = ("left_bin", "right_bin")
PAN = "dustpan"
SPONGE = "sponge"

CRUMBS, FLAT, BYSTANDERS = 0.3, 0.25, 0.15
"""Shares: of the objects, of the solid ones, and of the solid ones that need not be put away."""

OBSTRUCTED, EITHER, PAIRS = 0.45, 0.25, 0.2
"""Shares: of the objects, of the obstructed ones that have two ways out, and of ways out for which two have to go."""

SPACING = 0.15
THING, CRUMB, SPONGE_SIZE = (0.06, 0.06, 0.06), (0.02, 0.02, 0.02), (0.09, 0.06, 0.04)
"""Metres."""

GREY = (0.5, 0.5, 0.5, 1.0)
SAMPLES = 100
"""Ways in which the stand-in can do an action, at most."""


@dataclass(frozen=True)
class Course:
    """What is where in whose way. Solvable: whatever obstructs comes earlier in `solids`.

    needs: by object, sets of solid things; once all of any one set have left their places, it can be taken or wiped.
    flat: have no grasp as they lie at first, but can be dragged. goal: PDDL.
    """

    seed: int
    solids: tuple[str, ...]
    crumbs: tuple[str, ...]
    needs: Mapping[str, tuple[frozenset[str], ...]]
    flat: frozenset[str]
    goal: str

    @property
    def size(self) -> int:
        """Number of objects; the sponge is not counted."""
        return len(self.solids) + len(self.crumbs)

    def shortest(self) -> int:
        """Length of the shortest plan, by trying every set of bystanders that might be moved.

        Whatever lies flat is dragged once, whatever else is moved or has to be put away is picked and placed, every
        crumb is wiped once and the sponge is taken up once, when all that obstructs a wipe is gone.
        """
        wanted = {args[0] for _, args in parse_goal(self.goal)}.intersection(self.solids)
        others = [name for name in self.solids if name not in wanted]
        sets = (wanted.union(moved) for count in range(len(others) + 1) for moved in combinations(others, count))
        possible = [moved for moved in sets if self._is_enough(moved)]
        moves = min(sum(2 for n in m if n in wanted or n not in self.flat) + len(m & self.flat) for m in possible)
        return moves + len(self.crumbs) + 2

    def _is_enough(self, moved: set[str]) -> bool:
        """Can all of these and the crumbs be taken when nothing else is moved?"""
        return all(any(way <= moved for way in self.needs.get(n, (frozenset(),))) for n in (*moved, *self.crumbs))

    def scene(self) -> SceneState:
        """Everything in rows on a large table, two bins and a dustpan beside it, the sponge in the dustpan."""
        names = (*self.solids, *self.crumbs)
        side = SPACING * (int(np.ceil(np.sqrt(len(names)))) + 4)
        bodies = {}
        for index, name in enumerate(names):
            row, column = divmod(index, int(np.ceil(np.sqrt(len(names)))))
            x, y = (SPACING * (k + 2.5) - side / 2 for k in (column, row))
            bodies[name] = _body(name, CRUMB if name in self.crumbs else THING, x, y, 0.0)
        bodies[SPONGE] = replace(_body(SPONGE, SPONGE_SIZE, side, 0.0, -0.1), tool="sponge")
        regions = {
            name: Region(name, "bin", (0.4, 0.4, 0.2), 0.01, _at(index, side, 0.0), 0.5)
            for index, name in enumerate(BINS)
        }
        regions[PAN] = Region(PAN, "dustpan", (0.4, 0.4, 0.2), 0.01, _at(side, 0.0, 0.0), 0.5, "-x")
        robot = RobotPlacement(RobotModel().name, SE3.Identity(), np.zeros(7))
        table = Table((side, side, 0.05), _at(0.0, 0.0, -0.025), 0.5)
        return SceneState.initial(Scenario("course", self.seed, robot, table, regions, {}, bodies, self.goal), 0.1)


def random_course(size: int, seed: int) -> Course:
    """A course with so many objects, at least one of them solid."""
    rng = np.random.default_rng([seed, size])
    crumbs = tuple(f"crumb{i:02d}" for i in range(int(CRUMBS * size)))
    solids = tuple(f"thing{i:02d}" for i in rng.permutation(size - len(crumbs)))
    needs = {}
    for index, name in enumerate((*solids, *crumbs)):
        earlier = solids[:index]
        if earlier and rng.random() < OBSTRUCTED:
            ways = 1 + (rng.random() < EITHER)
            needs[name] = tuple(_some(earlier, 1 + (rng.random() < PAIRS), rng) for _ in range(ways))
    flat = frozenset(name for name in solids if rng.random() < FLAT)
    wanted = [name for name in solids if rng.random() >= BYSTANDERS] or solids[:1]
    literals = [("in_bin", (n, str(rng.choice(BINS)))) if rng.random() < 0.5 else ("put_away", (n,)) for n in wanted]
    literals += [("in_bin", (name, PAN)) for name in crumbs]
    return Course(seed, solids, crumbs, needs, flat, goal_text([*literals, ("put_away", (SPONGE,))]))


@dataclass
class StandIn:
    """All primitives at once. Samples are numbers: each goes one of the ways out that the course has for the object."""

    course: Course

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        """The first sample that nothing blocks, or all that were tried."""
        attempts = []
        for sample in self._samples(budget, hints):
            culprits = self.blocking(action, sample, scene)
            if culprits is None:
                phase = Phase("go", "move", Trajectory.standstill(scene.q), scene.opening)
                return Refinement(action, sample, (phase,))
            attempts.append(Blocked(sample, "blocked", culprits))
        return RefinementFailure(action, "every sample is blocked", tuple(attempts))

    def blocking(self, action: GroundAction, sample: int, scene: SceneState) -> frozenset[str] | None:
        """What keeps a sample from working: things, none of them if moving them does not help; None if nothing does."""
        name = action.args[0]
        if action.name == "place" or (action.name != "wipe" and not self._lies_as_at_first(name, scene)):
            return None
        ways = self.course.needs.get(name, (frozenset(),))
        culprits = frozenset(n for n in ways[sample % len(ways)] if self._lies_as_at_first(n, scene))
        if action.name != "wipe" and (action.name == "pick") == (name in self.course.flat):
            return frozenset()
        return culprits or None

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        """The object in the hand, in the middle of where it is put, or dragged on."""
        name, *rest = refinement.action.args
        match refinement.action.name:
            case "pick":
                return replace(scene, held=Held(name, SE3.Identity()))
            case "place":
                return replace(self._put(scene, name, rest[0]), held=None)
            case "wipe":
                return self._put(scene, name, rest[1])
            case _:
                return scene.moved(name, _at(-0.05, 0.0, 0.0) * scene.poses[name])

    def _put(self, scene: SceneState, name: str, place: str) -> SceneState:
        height = _half_height(scene, name)
        if place == TABLE:
            return scene.moved(name, _at(0.0, 0.0, height))
        return scene.moved(name, scene.scenario.regions[place].X_WR * _at(0.0, 0.0, height - 0.09))

    def _lies_as_at_first(self, name: str, scene: SceneState) -> bool:
        return not is_displaced(whereabouts(self._start, name), whereabouts(scene, name))

    @cached_property
    def _start(self) -> SceneState:
        return self.course.scene()

    def _samples(self, budget: Budget, hints: Hints) -> Iterator[int]:
        others = (n for n in range(SAMPLES) if n not in hints.avoid and n not in hints.first)
        return iter((*hints.first, *others)[: budget.tries])


def _some(names: tuple[str, ...], count: int, rng: np.random.Generator) -> frozenset[str]:
    return frozenset(str(name) for name in rng.choice(names, min(count, len(names)), replace=False))


def _half_height(scene: SceneState, name: str) -> float:
    shape = scene.scenario.bodies[name].shape
    assert isinstance(shape, Box)
    return shape.size[2] / 2


def _at(x: float, y: float, z: float) -> SE3:
    return SE3(np.eye(3), np.array([x, y, z]))


def _body(name: str, size: tuple[float, float, float], x: float, y: float, z: float) -> Body:
    return Body(name, Box(size), 0.2, 0.5, GREY, _at(x, y, z + size[2] / 2))
