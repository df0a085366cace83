"""The classes of disturbances by name: what each does, whether the goal can still be reached, when it may come."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from pinocchio import SE3

from bt_tamp.disturb import robot, world
from bt_tamp.disturb.deed import Draw
from bt_tamp.disturb.disorders import disordered
from bt_tamp.disturb.faulty import ExhaustedMotionPlanner, FailingSolver, FailingTaskPlanner
from bt_tamp.disturb.names import CLASSES
from bt_tamp.disturb.robot import moved_unseen
from bt_tamp.disturb.world import can_topple, has_corners
from bt_tamp.executive.seams import Seams
from planner.refinement import Phase
from planner.task.symbols import Fact, GroundAction
from scenarios.goal import goal_text, parse_goal
from scenarios.names import TABLE
from scenarios.scenario import Body, Scenario
from scenarios.shapes import Box
from sim.disturbance import FOREVER


@dataclass(frozen=True)
class Prospect:
    """A phase that is to come, the actions from its own on, the scene, and what is wanted."""

    phase: Phase
    later: tuple[GroundAction, ...]
    scenario: Scenario
    goal: frozenset[Fact]


Fits = Callable[[Prospect], bool]
"""May it come during such a phase?"""

Strike = Callable[[], None]
"""Told by software that fails, when it does."""

Amend = Callable[[Scenario], Scenario]
"""The scene with what will come late."""

EARLY = 0.3
"""Share of a stroke after which the hand takes up the room where something could still be put."""

SPELLS = 12
"""How often the controller's solver fails for a while."""

STRAY, CRUMB, POST = "stray_box", "stray_crumb", "stray_post"


def _always(to_come: Prospect) -> bool:
    return True


def _holding(to_come: Prospect) -> bool:
    return to_come.phase.held is not None and to_come.phase.kind != "open"


def _moving(to_come: Prospect) -> bool:
    return to_come.phase.kind in ("move", "approach", "slide")


def _before_grasp(to_come: Prospect) -> bool:
    phase = to_come.phase
    return phase.kind == "approach" and phase.held is None and phase.name == "approach"


def _driven(to_come: Prospect) -> bool:
    return to_come.phase.kind not in ("open", "close")


def _feeling(to_come: Prospect) -> bool:
    phase = to_come.phase
    return phase.kind in ("touch", "slide") or (phase.held is not None and phase.kind == "move")


def _stroking(to_come: Prospect) -> bool:
    return to_come.phase.kind == "slide"


def _before_tool(to_come: Prospect) -> bool:
    """Is a tool still to be taken up?"""
    return any(body.tool for body in _untouched(to_come))


def _before_cornered(to_come: Prospect) -> bool:
    """Is anything still to be taken up from the table that lies otherwise once it is turned on the spot?"""
    return any(has_corners(body, body.X_WO.rotation) for body in _untouched(to_come, TABLE))


def _before_tall(to_come: Prospect) -> bool:
    """Is anything still to be taken up from the table that can lie flatter than it stands?"""
    return any(can_topple(body, body.X_WO.rotation) for body in _untouched(to_come, TABLE))


def _before_last(to_come: Prospect) -> bool:
    """Is there anything on the table still to be dealt with that the hand isn't at yet?"""
    held = to_come.phase.held
    names = {action.args[0] for action in _ahead(to_come) if action.args[1:2] == (TABLE,)}
    return bool(names - ({held.name} if held is not None else set()))


def _before_another(to_come: Prospect) -> bool:
    """Will something be dealt with on the table after this, even what is being dragged over it now?"""
    return any(action.name != "place" and action.args[1:2] == (TABLE,) for action in _ahead(to_come))


def _before_needed_tool(to_come: Prospect) -> bool:
    """Is a tool itself wanted somewhere, or still to be wiped with?"""
    bodies = to_come.scenario.bodies
    is_wanted = any(bodies[name].tool for fact in to_come.goal for name in fact.args if name in bodies)
    return is_wanted or any(action.name == "wipe" for action in to_come.later[1:])


def _before_bin(to_come: Prospect) -> bool:
    """Is a bin still needed?"""
    bins = {name for name, region in to_come.scenario.regions.items() if region.kind == "bin"}
    return any(not bins.isdisjoint(action.args[1:]) for action in to_come.later)


def _untouched(to_come: Prospect, place: str | None = None) -> list[Body]:
    """What is to be taken up from a place (None: any), and the hand isn't at it yet."""
    picks = [action for action in _ahead(to_come) if action.name == "pick" and place in (None, *action.args[1:])]
    return [to_come.scenario.bodies[action.args[0]] for action in picks]


def _ahead(to_come: Prospect) -> tuple[GroundAction, ...]:
    """The actions whose objects the hand isn't at yet."""
    phase, running = to_come.phase, to_come.later[0]
    is_held = phase.held is not None and phase.held.name == running.args[0]
    is_coming = phase.kind == "move" or phase.name == "approach"
    return to_come.later if is_coming and not is_held else to_come.later[1:]


def _unchanged(scenario: Scenario) -> Scenario:
    return scenario


def _real(rng: np.random.Generator, strike: Strike) -> Seams:
    return Seams()


@dataclass(frozen=True)
class Kind:
    """A class. draw: one instance (None: it is software that fails, by `seams`); fits: the phases in which it may come;
    while_planning: may it also fall into planning? latest: share of a phase in which it comes; amend: brings what is
    needed into the scene."""

    draw: Draw | None = None
    fits: Fits = _always
    while_planning: bool = True
    latest: float = 1.0
    amend: Amend = _unchanged
    seams: Callable[[np.random.Generator, Strike], Seams] = field(default=_real)


def with_late(body: Body, to: str | None, scenario: Scenario) -> Scenario:
    """The scene with one more body that comes late, wanted in the first region of kind `to` (None: nowhere).

    A body that the scene knows already, as one that goes on from a disturbed run does, stays as it is.
    """
    goal = parse_goal(scenario.goal)
    if to is not None and not any(body.name in names for _, names in goal):
        places = [region.name for region in scenario.regions.values() if region.kind == to]
        if not places:
            return scenario
        goal = (*goal, ("in_bin", (body.name, places[0])))
    if body.name in scenario.bodies:
        return replace(scenario, goal=goal_text(goal))
    bodies = {**scenario.bodies, body.name: body}
    return replace(scenario, bodies=bodies, goal=goal_text(goal), late=scenario.late | {body.name})


def _box(name: str, size: tuple[float, float, float], mass: float) -> Body:
    return Body(name, Box(size), mass, 0.5, (0.55, 0.3, 0.6, 1.0), SE3(np.eye(3), np.array([0.0, 0.0, -1.0])))


_STRAY = _box(STRAY, (0.05, 0.05, 0.07), 0.15)
_CRUMB = _box(CRUMB, (0.024, 0.024, 0.024), 0.012)
_POST = _box(POST, (0.05, 0.05, 0.22), 0.3)


def _failing_solver(status: str, rng: np.random.Generator, strike: Strike) -> Seams:
    """40 ms without a solution, every few seconds."""
    first = np.cumsum(rng.integers(300, 2000, size=SPELLS))
    return Seams(solver=FailingSolver(status, tuple((start, 20) for start in first.tolist()), strike))


def _exhausted_motion_planner(rng: np.random.Generator, strike: Strike) -> Seams:
    return Seams(motion=partial(ExhaustedMotionPlanner, strike=strike))


def _failing_task_planner(rng: np.random.Generator, strike: Strike) -> Seams:
    return Seams(task_planner=partial(FailingTaskPlanner, strike=strike))


KINDS: dict[str, Kind] = {
    "moved": Kind(world.moved, _before_last),
    "rotated": Kind(world.rotated, _before_cornered),
    "toppled": Kind(world.toppled, _before_tall),
    "taken-and-returned": Kind(world.taken_and_returned, _before_last),
    "new-object": Kind(partial(world.new_one, name=STRAY), amend=partial(with_late, _STRAY, "bin")),
    "new-crumb": Kind(partial(world.new_one, name=CRUMB), amend=partial(with_late, _CRUMB, "dustpan")),
    "path-blocked": Kind(partial(world.path_blocked, name=POST), _moving, False, amend=partial(with_late, _POST, None)),
    "stroke-blocked": Kind(
        partial(world.path_blocked, name=POST), _stroking, False, EARLY, amend=partial(with_late, _POST, None)
    ),
    "knocked-from-hand": Kind(world.knocked_from_hand, _holding, False),
    "slipping": Kind(world.slipping, _holding, False),
    "sponge-far": Kind(world.sponge_far, _before_tool),
    "sponge-covered": Kind(
        partial(world.sponge_covered, cover=STRAY), _before_tool, amend=partial(with_late, _STRAY, None)
    ),
    "bin-shifted": Kind(world.bin_shifted, _before_bin),
    "crumbs-beside-pan": Kind(world.crumbs_beside_pan),
    "goal-changed": Kind(world.goal_changed),
    "push": Kind(robot.push),
    "closes-on-nothing": Kind(world.closes_on_nothing, _before_grasp, False),
    "weak-grip": Kind(robot.weak_grip, _holding, False),
    "force-bias": Kind(partial(disordered, what="force-bias", size=6.0), _feeling, False),
    "force-noise": Kind(partial(disordered, what="force-noise", size=0.5), _feeling, False),
    "force-missing": Kind(partial(disordered, what="force-missing", seconds=1.0), _feeling, False),
    "force-frozen": Kind(partial(disordered, what="force-frozen", seconds=1.0), _feeling, False),
    "joint-delay": Kind(partial(disordered, what="joint-delay", size=0.01, seconds=2.0), _driven, False),
    "joint-friction": Kind(partial(disordered, what="joint-friction", size=3.0)),
    "pose-noise": Kind(partial(disordered, what="pose-noise", size=0.005)),
    "pose-delay": Kind(
        partial(moved_unseen, what="pose-delay", size=0.3, seconds=FOREVER, within=(0.5, 2.0)), _before_another
    ),
    "pose-missing": Kind(
        partial(moved_unseen, what="pose-missing", size=0.0, seconds=1.0, within=(0.2, 0.8)), _before_another
    ),
    "qp-infeasible": Kind(seams=partial(_failing_solver, "primal infeasible")),
    "qp-iterations": Kind(seams=partial(_failing_solver, "maximum iterations reached")),
    "motion-budget": Kind(seams=_exhausted_motion_planner),
    "task-planner": Kind(seams=_failing_task_planner),
    "taken-for-good": Kind(world.taken_for_good),
    "sponge-out-of-reach": Kind(world.sponge_out_of_reach, _before_needed_tool),
}
assert KINDS.keys() == CLASSES.keys()


def amended(scenario: Scenario, classes: Iterable[str]) -> Scenario:
    """The scene with everything that the classes bring into it."""
    for name in classes:
        scenario = KINDS[name].amend(scenario)
    return scenario
