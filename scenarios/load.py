"""From a scene file to a `Scenario`: read, hold against the format, resolve poses, check, draw the noise."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenarios import checks, schema
from scenarios.disturbing import disturbance_problems, disturbances, late_ones
from scenarios.document import Document, read_document
from scenarios.forms import forms
from scenarios.goal import GoalError, resolved_goal
from scenarios.library import scenario_path
from scenarios.noise import NoFreePose, PoseNoise, draw_poses
from scenarios.placing import declared_scenario
from scenarios.scenario import Scenario


def load_scenario(name_or_path: str | Path, seed: int = 0) -> Scenario:
    """Load a scene by the name of a shipped one or by its path, with the noise of `seed` drawn (0: none).

    Raises SceneError for everything that is wrong with the file, ValueError for a negative seed.
    """
    path = scenario_path(name_or_path)
    return build_scenario(read_document(path, str(name_or_path)), seed)


def build_scenario(document: Document, seed: int = 0) -> Scenario:
    """Build the scenario that a document describes. Raises SceneInvalid or, for a negative seed, ValueError."""
    if seed < 0:
        raise ValueError(f"seed {seed}, expected 0 or above")
    file = schema.validate_document(document)
    _refuse(document, [*checks.name_problems(file), *checks.reference_problems(file)])
    shapes, problems = forms(file, document.folder)
    _refuse(document, problems)
    scenario = replace(declared_scenario(file, shapes), late=late_ones(file))
    try:
        model = scenario.robot.model
        scenario = replace(scenario, goal=resolved_goal(scenario.goal, scenario.bodies, scenario.regions, model))
    except GoalError as error:
        raise schema.invalid(document, ("goal",), str(error)) from None
    _refuse(document, checks.surface_problems(file, scenario))
    _refuse(document, disturbance_problems(file, scenario))
    scenario = replace(scenario, disturbances=disturbances(file, scenario))
    _refuse(document, [*checks.surroundings_problems(scenario), *checks.body_problems(file, scenario)])
    if seed == 0:
        return scenario
    try:
        there = {name: body for name, body in scenario.bodies.items() if name not in scenario.late}
        noises = {name: noise for name, noise in _noises(file).items() if name in there}
        poses = draw_poses(there, noises, checks.immovable(scenario), seed)
    except NoFreePose as error:
        path = (*checks.key_of(file, error.name), "pose")
        raise schema.invalid(document, path, f"seed {seed}: {error}") from None
    bodies = {name: replace(body, X_WO=poses.get(name, body.X_WO)) for name, body in scenario.bodies.items()}
    return replace(scenario, seed=seed, bodies=bodies)


def _noises(file: schema.SceneFile) -> dict[str, PoseNoise]:
    things: dict[str, schema.Thing | schema.Tool] = {**file.objects, **file.tools}
    given = {name: thing.noise for name, thing in things.items() if thing.noise is not None}
    return {name: PoseNoise(noise.xy, float(np.radians(noise.yaw_deg))) for name, noise in given.items()}


def _refuse(document: Document, problems: Iterable[checks.Problem]) -> None:
    found = list(problems)
    if found:
        path, message = found[0]
        raise schema.invalid(document, path, message, len(found) - 1)
