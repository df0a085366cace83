"""The disturbances that a scene file declares, resolved: references checked, poses in W, angles in rad."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from pinocchio import SE3

from scenarios import schema
from scenarios.checks import Problem, immovable, key_of, lies_off
from scenarios.disturbance import (
    Bring,
    Disorder,
    Disturbance,
    Happening,
    Moment,
    Move,
    NewGoal,
    PushArm,
    ShiftRegion,
    Take,
    WeakenGrip,
)
from scenarios.document import KeyPath
from scenarios.goal import GoalError, resolved_goal
from scenarios.names import TABLE, known
from scenarios.placing import body_frame, heights_of
from scenarios.robots import ROBOTS
from scenarios.scenario import Scenario
from scenarios.schema_disturbances import HAPPENINGS, BroughtObject, Entry
from scenarios.schema_parts import PoseOn
from scenarios.solids import body_solid
from scenarios.standing import overlap_problem

Triple = tuple[float, float, float]


def late_ones(file: schema.SceneFile) -> frozenset[str]:
    """Objects that are brought before they are taken, in the order of the file: not there at the start."""
    first: dict[str, bool] = {}
    for entry in file.disturbances:
        if entry.bring is not None:
            first.setdefault(entry.bring.object, True)
        if entry.take is not None:
            first.setdefault(entry.take.object, False)
    return frozenset(name for name, is_brought in first.items() if is_brought)


def disturbance_problems(file: schema.SceneFile, scenario: Scenario) -> Iterator[Problem]:
    """Objects, regions, links and goals that the scene doesn't know."""
    facts = ROBOTS[scenario.robot.model]
    links = facts.links
    for number, entry in enumerate(file.disturbances):
        key = next(key for key in HAPPENINGS if getattr(entry, key) is not None)
        what, path = getattr(entry, key), ("disturbances", number, key)
        name = getattr(what, "object", None)
        if name is not None and name not in scenario.bodies:
            yield (*path, "object"), f"unknown object {name!r}, {known(name, scenario.bodies)}"
        if entry.shift is not None and entry.shift.region not in scenario.regions:
            region = entry.shift.region
            yield (*path, "region"), f"unknown region {region!r}, {known(region, scenario.regions)}"
        if entry.push is not None and entry.push.link is not None and entry.push.link not in links:
            yield (*path, "link"), f"unknown link {entry.push.link!r}, {known(entry.push.link, links)}"
        if entry.push is not None and entry.push.link == facts.base:
            yield (*path, "link"), f"link {facts.base!r} doesn't move: it stands on the floor"
        if entry.bring is not None and name in scenario.bodies:
            yield from _ill_placed(file, scenario, entry.bring, path)
        if entry.goal is not None:
            try:
                _goal(entry.goal, scenario)
            except GoalError as error:
                yield path, str(error)


def _ill_placed(file: schema.SceneFile, scenario: Scenario, bring: BroughtObject, path: KeyPath) -> Iterator[Problem]:
    """What is brought onto nothing known, beside the surface that it is to lie on, or into what never moves."""
    body, pose = scenario.bodies[bring.object], bring.pose
    if pose is None:
        # What is there at the start is looked at with everything else.
        problem = overlap_problem(body_solid(body), immovable(scenario)) if body.name in scenario.late else None
        if problem is not None:
            yield (*key_of(file, body.name), "pose"), f"{body.name!r} {problem}"
        return
    if isinstance(pose, PoseOn) and pose.on not in (surfaces := {TABLE, *scenario.regions}):
        yield (*path, "pose", "on"), f"unknown surface {pose.on!r}, {known(pose.on, surfaces)}"
        return
    X_WO = body_frame(pose, body.shape, heights_of(scenario))
    beside = lies_off(scenario, pose.on, X_WO) if isinstance(pose, PoseOn) else None
    if beside is not None:
        yield (*path, "pose", "xy"), beside
        return
    problem = overlap_problem(body_solid(replace(body, X_WO=X_WO)), immovable(scenario))
    if problem is not None:
        yield (*path, "pose"), f"{body.name!r} {problem}"


def disturbances(file: schema.SceneFile, scenario: Scenario) -> tuple[Disturbance, ...]:
    """The file's disturbances. What they name must be known."""
    heights = heights_of(scenario)
    return tuple(Disturbance(_moment(entry), _happening(entry, scenario, heights)) for entry in file.disturbances)


def _moment(entry: Entry) -> Moment:
    return Moment(entry.at, entry.phase or "", entry.action, entry.nth, entry.after)


def _happening(entry: Entry, scenario: Scenario, heights: Mapping[str, float]) -> Happening:
    if entry.move is not None:
        return Move(entry.move.object, _triple(entry.move.by), _triple(np.radians(entry.move.turn_deg)))
    if entry.take is not None:
        return Take(entry.take.object)
    if entry.bring is not None:
        body, pose = scenario.bodies[entry.bring.object], entry.bring.pose
        X_WO: SE3 = body.X_WO if pose is None else body_frame(pose, body.shape, heights)
        return Bring(body.name, X_WO)
    if entry.shift is not None:
        return ShiftRegion(entry.shift.region, _triple(entry.shift.by))
    if entry.push is not None:
        return PushArm(_triple(entry.push.force), entry.push.seconds, entry.push.link)
    if entry.grip is not None:
        return WeakenGrip(entry.grip.force, entry.grip.seconds)
    if entry.disorder is not None:
        return Disorder(entry.disorder.what, entry.disorder.size or 0.0, entry.disorder.seconds)
    assert entry.goal is not None
    return NewGoal(_goal(entry.goal, scenario))


def _goal(text: str, scenario: Scenario) -> str:
    return resolved_goal(text, scenario.bodies, scenario.regions, scenario.robot.model)


def _triple(values: "list[float] | np.ndarray") -> Triple:
    x, y, z = (float(value) for value in values)
    return x, y, z
