"""What the format alone can't say about a scene: names, references, and whether everything can stand where it is put.

Each check yields problems as (key path, message), in the file's order.
"""

from collections.abc import Iterator

import numpy as np
from pinocchio import SE3

from scenarios import schema
from scenarios.document import KeyPath
from scenarios.names import NAME, TABLE, known, name_problem
from scenarios.regions import interior
from scenarios.scenario import Region, Scenario, Table
from scenarios.schema_parts import PoseOn
from scenarios.solids import Solid, body_solid, region_hull, region_solid, table_solid
from scenarios.standing import overlap_problem, support_problem

Problem = tuple[KeyPath, str]

GROUPS = ("regions", "fixed", "objects", "tools")
"""The mappings of a scene file whose keys are names."""

LIP_GAP = 0.001
"""How far in metres a dustpan's lip may lie from the table's top."""


def key_of(file: schema.SceneFile, name: str) -> KeyPath:
    """The key path at which a name is declared."""
    return next((group, name) for group in GROUPS if name in getattr(file, group))


def name_problems(file: schema.SceneFile) -> Iterator[Problem]:
    """Names that can't be used, or are given twice."""
    if not NAME.fullmatch(file.name):
        yield ("name",), name_problem(file.name) or ""
    first: dict[str, str] = {}
    for group in GROUPS:
        for name in getattr(file, group):
            problem = name_problem(name)
            if problem is not None:
                yield (group, name), problem
            elif first.setdefault(name, group) != group:
                yield (group, name), f"name {name!r} is given in {first[name]} already, expected another"


def reference_problems(file: schema.SceneFile) -> Iterator[Problem]:
    """Surfaces in `on` and regions in `home` that the scene doesn't hold."""
    surfaces = {TABLE, *file.regions}
    for group in ("fixed", "objects", "tools"):
        for name, thing in getattr(file, group).items():
            on = thing.pose.on if isinstance(thing.pose, PoseOn) else TABLE
            if on not in surfaces:
                yield (group, name, "pose", "on"), f"unknown surface {on!r}, {known(on, surfaces)}"
            home = getattr(thing, "home", None)
            if home is not None and home not in file.regions:
                yield (group, name, "home"), f"unknown region {home!r}, {known(home, file.regions)}"


def surface_problems(file: schema.SceneFile, scenario: Scenario) -> Iterator[Problem]:
    """Poses `on` a surface whose xy lie beside it."""
    placed = {**scenario.fixtures, **scenario.bodies}
    for group in ("fixed", "objects", "tools"):
        for name, thing in getattr(file, group).items():
            if not isinstance(thing.pose, PoseOn):
                continue
            problem = lies_off(scenario, thing.pose.on, placed[name].X_WO)
            if problem is not None:
                yield (group, name, "pose", "xy"), problem


def lies_off(scenario: Scenario, on: str, X_WO: SE3) -> str | None:
    """In what way a pose X_WO on a surface lies beside it, or None."""
    if on == TABLE:
        half = np.array(scenario.table.size) / 2
        X_WS, lower, upper = scenario.table.X_WT, -half, half
    else:
        X_WS = scenario.regions[on].X_WR
        lower, upper = interior(scenario.regions[on])
    p_SO = X_WS.actInv(X_WO.translation)
    if np.all(p_SO[:2] >= lower[:2]) and np.all(p_SO[:2] <= upper[:2]):
        return None
    limits = " and ".join(f"{a} {lower[i]:.3f} to {upper[i]:.3f}" for i, a in enumerate("xy"))
    return f"lies off {on!r}: at ({p_SO[0]:.3f}, {p_SO[1]:.3f}) from its centre, expected {limits} m"


def surroundings_problems(scenario: Scenario) -> Iterator[Problem]:
    """Table, regions and fixtures that overlap each other."""
    hulls = [table_solid(scenario.table)]
    for region in scenario.regions.values():
        hull = region_hull(region)
        problem = overlap_problem(hull, hulls)
        if problem is not None:
            yield ("regions", region.name, "pose"), f"{region.name!r} {problem}"
        hulls.append(hull)
        yield from _dustpan_problems(region, scenario.table)
    others = surfaces(scenario)
    for fixture in scenario.fixtures.values():
        solid = body_solid(fixture)
        problem = overlap_problem(solid, others)
        if problem is not None:
            yield ("fixed", fixture.name, "pose"), f"{fixture.name!r} {problem}"
        others.append(solid)


def _dustpan_problems(region: Region, table: Table) -> Iterator[Problem]:
    top = float(table.X_WT.translation[2]) + table.size[2] / 2
    bottom = float(region.X_WR.translation[2]) - region.size[2] / 2
    if region.ramp_deg is not None and abs(bottom - top) > LIP_GAP:
        yield (
            ("regions", region.name, "pose"),
            f"the ramp's lip is at z {bottom:.4f}, expected it flush with the table's top at {top:.4f}",
        )
    floor = bottom + region.wall
    if region.kind == "dustpan" and region.ramp_deg is None and floor > top + LIP_GAP:
        yield (
            ("regions", region.name, "pose"),
            f"the floor is at z {floor:.4f}, expected it below the table's top at {top:.4f}, or a ramp_deg",
        )


def body_problems(file: schema.SceneFile, scenario: Scenario) -> Iterator[Problem]:
    """Movable bodies that overlap something, float, or hang over an edge."""
    still = immovable(scenario)
    bodies = [body_solid(body) for body in scenario.bodies.values() if body.name not in scenario.late]
    for i, solid in enumerate(bodies):
        others = [*still, *bodies[:i], *bodies[i + 1 :]]
        problem = overlap_problem(solid, [*still, *bodies[:i]]) or support_problem(solid, others)
        if problem is not None:
            yield (*key_of(file, solid.name), "pose"), f"{solid.name!r} {problem}"


def surfaces(scenario: Scenario) -> list[Solid]:
    """The table and the regions' parts."""
    return [table_solid(scenario.table), *(region_solid(region) for region in scenario.regions.values())]


def immovable(scenario: Scenario) -> list[Solid]:
    """Everything that never moves: table, regions, fixtures."""
    return [*surfaces(scenario), *(body_solid(fixture) for fixture in scenario.fixtures.values())]
