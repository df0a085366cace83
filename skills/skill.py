"""What a skill is, and what all of them share: trying samples in turn, and naming culprits.

A skill turns an action into motion (`refine`), says what the motion changes (`predict`) and gives the
behaviour tree that carries it out (`subtree`). One primitive, one file.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from pinocchio import SE3
from py_trees.behaviour import Behaviour

from planner.crash import crash_of
from planner.failure import Blocked, MotionFailure, RefinementFailure
from planner.motion.motion_planner import MotionPlanner
from planner.refinement import Budget, Hints, Pair, Phase, Refinement, Refiner
from planner.support import burden
from planner.task.symbols import GroundAction
from scenarios.shapes import bounding_radius
from sim.robot import RobotModel
from sim.scene import SceneState
from skills.context import ActionRun, SkillContext
from skills.control.reference import Mode
from skills.ways import KnownWays

UNCOUNTED = 30
"""Samples that may fail before any motion is sought, for each try that counts."""


class Skill(Refiner, Protocol):
    """A primitive: a refiner with a behaviour tree. phases: the names of its phases, in order."""

    name: str
    arity: int
    phases: tuple[str, ...]

    def subtree(self, run: ActionRun, context: SkillContext) -> Behaviour:
        """The tree that carries out `run.refinement`, which is filled in before its first motion."""
        ...


@dataclass(frozen=True)
class ContactSettings:
    """How contact is made. `mode` "hybrid" (closed loop on the measured force) or "impedance" (open loop).

    stiffness (6,): N/m and Nm/rad in W, linear first, of contact motions in impedance mode.
    force: N pressed on a sponge; speed: m/s of contact motions. pre_wipe: metres behind the start
    and above the table of the pose from which a stroke begins, None for what geometry asks.
    """

    mode: Mode = "hybrid"
    stiffness: tuple[float, ...] = (1000.0, 1000.0, 500.0, 50.0, 50.0, 50.0)
    force: float = 10.0
    speed: float = 0.1
    pre_wipe: tuple[float, float] | None = None


@dataclass(frozen=True)
class Toolkit:
    """What skills refine with. known: ways of the hand found earlier."""

    robot: RobotModel
    motion: MotionPlanner
    contact: ContactSettings
    known: KnownWays = field(default_factory=KnownWays)


@dataclass(frozen=True)
class Unfit:
    """A sample refused by a cheap look, before any motion was sought. All of the culprits have to go."""

    reason: str
    culprits: frozenset[str] = frozenset()


def beyond_reach(toolkit: Toolkit, action: GroundAction, scene: SceneState) -> RefinementFailure | None:
    """The failure, proven as the action's object lies, when the stretched arm does not come to it; else None."""
    name, robot = action.args[0], toolkit.robot
    distance = float(np.linalg.norm(scene.poses[name].translation - robot.shoulder))
    reach = robot.reach + bounding_radius(scene.scenario.bodies[name].shape)
    if distance <= reach:
        return None
    reason = f"{name} lies {distance:.2f} m from the shoulder, the arm reaches {reach:.2f} m"
    return RefinementFailure(action, reason, proof="here")


def hand_would_hit(
    toolkit: Toolkit, scene: SceneState, X_WG: SE3, allowed: frozenset[Pair], margin: float | None = None
) -> Unfit | None:
    """What the hand at X_WG, with what it holds, would hit or come nearer to than `margin` metres, whatever the arm
    does; movable bodies are culprits if nothing else is hit."""
    hits = toolkit.motion.hand_hits(scene, X_WG, allowed, margin)
    if not hits:
        return None
    movable = hits & frozenset(scene.poses)
    return Unfit("the hand would hit " + ", ".join(sorted(hits)), movable if movable == hits else frozenset())


def laden(action: GroundAction, scene: SceneState) -> Unfit | None:
    """What stands on the action's object and would have to go before it is moved."""
    on_it = burden(scene, action.args[0])
    return Unfit(f"{', '.join(sorted(on_it))} would come along", on_it) if on_it else None


Attempt = Callable[[Any, SceneState], "tuple[Phase, ...] | MotionFailure | Unfit"]
"""Tries one sample in a scene: phases, or why not."""


def refine_by_sampling(
    action: GroundAction,
    scene: SceneState,
    samples: Iterable[Any],
    attempt: Attempt,
    budget: Budget,
    hints: Hints,
    nothing: str = "nothing can be tried with its shape where it lies",
) -> Refinement | RefinementFailure:
    """Try samples in turn, hinted ones first, until one works or the budget is spent. `nothing`: why there may be none.

    A sample that fails is tried again without the other movable bodies; if it works then, those
    of them that its motion would have hit are its culprits. One for which another's culprits and more have to go is
    not looked into further: nothing would follow from it. An error in trying a sample fails that sample.
    """
    crashes: dict[str, None] = {}

    def tried(sample: Any, world: SceneState) -> tuple[Phase, ...] | MotionFailure | Unfit:
        try:
            return attempt(sample, world)
        except Exception as error:  # A motion planner that crashes once may find the next sample's motion.
            crashes[crash_of(error)] = None
            return MotionFailure(f"working it out crashed, {crash_of(error)}")

    attempts: list[Blocked] = []
    counted = uncounted = 0
    reasons: dict[str, int] = {}
    for sample in _in_order(samples, hints):
        outcome = tried(sample, scene)
        if isinstance(outcome, tuple):
            return Refinement(action, sample, outcome, crashes=tuple(crashes))
        known = [entry.culprits for entry in attempts if entry.culprits]
        blocked = Blocked(sample, outcome.reason, _culprits(action, sample, scene, tried, outcome, known))
        reasons[blocked.reason] = reasons.get(blocked.reason, 0) + 1
        if isinstance(outcome, Unfit) and not blocked.culprits:
            uncounted += 1
        else:
            counted += 1
            attempts.append(blocked)
        if counted >= budget.tries or uncounted >= UNCOUNTED * budget.tries:
            break
    if not reasons:
        return RefinementFailure(action, nothing, (Blocked(None, nothing),))
    common = max(reasons, key=lambda reason: reasons[reason])
    total = counted + uncounted
    reason = f"none of {total} samples works, most often because {common}"
    return RefinementFailure(action, reason, tuple(attempts) or (Blocked(None, common),), crashes=tuple(crashes))


def _in_order(samples: Iterable[Any], hints: Hints) -> Iterable[Any]:
    yield from (sample for sample in hints.first if sample not in hints.avoid)
    yield from (sample for sample in samples if sample not in hints.avoid and sample not in hints.first)


def _culprits(
    action: GroundAction,
    sample: Any,
    scene: SceneState,
    attempt: Attempt,
    outcome: MotionFailure | Unfit,
    known: Sequence[frozenset[str]],
) -> frozenset[str]:
    """Movable bodies without which the sample works and which its motion then would hit; empty if it doesn't.

    The action's own objects are none: without them there is nothing to do. What can't become anything but one of the
    `known` sets or more, the latter where a cheap look alone tells so, is not looked into.
    """
    own = frozenset(action.args)
    if not outcome.culprits or outcome.culprits & own:
        return frozenset()
    suspects, is_sure = outcome.culprits, isinstance(outcome, Unfit)
    for _ in range(len(scene.poses)):
        if (is_sure and any(culprits <= suspects for culprits in known)) or (len(suspects) == 1 and suspects in known):
            return suspects
        again = attempt(sample, scene.without(suspects))
        if isinstance(again, tuple):
            return suspects if is_sure else _needed(suspects, sample, scene, attempt)
        if not again.culprits or again.culprits <= suspects or again.culprits & own:
            return frozenset()
        suspects = suspects | again.culprits
        is_sure = is_sure and isinstance(again, Unfit)
    return frozenset()


def _needed(suspects: frozenset[str], sample: Any, scene: SceneState, attempt: Attempt) -> frozenset[str]:
    """The suspects less those that may stay: dropped one by one while the sample still works."""
    if len(suspects) == 1:
        return suspects
    for name in sorted(suspects):
        if isinstance(attempt(sample, scene.without(suspects - {name})), tuple):
            suspects = suspects - {name}
    return suspects
