"""A resolved scenario as JSON and back: what replay and rendering need, without the scene file."""

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from scenarios.scenario import Body, Fixture, Region, RobotPlacement, Scenario, Table
from scenarios.shapes import Box, Compound, Convex, Cylinder, Hull, Part, Shape, Sphere

FORMAT = 1


def scenario_to_json(scenario: Scenario) -> str:
    """The scenario as indented JSON. Poses are [x, y, z, qx, qy, qz, qw] in W, lengths in metres."""
    data = {
        "format": FORMAT,
        "name": scenario.name,
        "seed": scenario.seed,
        "goal": scenario.goal,
        "late": sorted(scenario.late),
        "robot": _plain(scenario.robot),
        "table": _plain(scenario.table),
        "regions": {name: _plain(region) for name, region in scenario.regions.items()},
        "fixtures": {name: _plain(fixture) for name, fixture in scenario.fixtures.items()},
        "bodies": {name: _plain(body) for name, body in scenario.bodies.items()},
    }
    return json.dumps(data, indent=1, ensure_ascii=False) + "\n"


def scenario_from_json(text: str) -> Scenario:
    """Read what `scenario_to_json` wrote. Raises ValueError for anything else."""
    try:
        data = json.loads(text)
        if data["format"] != FORMAT:
            raise ValueError(f"format {data['format']!r}, expected {FORMAT}")
        return Scenario(
            name=data["name"],
            seed=data["seed"],
            robot=RobotPlacement(**_revived(data["robot"])),
            table=Table(**_revived(data["table"])),
            regions={name: Region(**_revived(record)) for name, record in data["regions"].items()},
            fixtures={name: Fixture(**_revived(record)) for name, record in data["fixtures"].items()},
            bodies={name: Body(**_revived(record)) for name, record in data["bodies"].items()},
            goal=data["goal"],
            late=frozenset(data.get("late", ())),
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"not a recorded scenario: {error!r}") from None


def _plain(record: Any) -> dict[str, Any]:
    return {field.name: _plain_value(getattr(record, field.name)) for field in fields(record)}


def _plain_value(value: Any) -> Any:
    match value:
        case SE3():
            return pin.SE3ToXYZQUAT(value).tolist()
        case np.ndarray():
            return value.tolist()
        case Box(size):
            return {"box": list(size)}
        case Cylinder(radius, height):
            return {"cylinder": {"radius": radius, "height": height}}
        case Sphere(radius):
            return {"sphere": {"radius": radius}}
        case Hull(vertices):
            return {"mesh": {"vertices": [list(p) for p in vertices]}}
        case Compound(parts):
            return {"compound": [{"shape": _plain_value(p.shape), "pose": [*p.position, *p.quaternion]} for p in parts]}
    return value


def _revived(record: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _revived_value(name, value) for name, value in record.items()}


def _revived_value(name: str, value: Any) -> Any:
    if name.startswith("X_"):
        return pin.XYZQUATToSE3(np.array(value, dtype=float))
    if name == "shape":
        return _shape(value)
    if name == "q0":
        return np.array(value, dtype=float)
    return tuple(value) if isinstance(value, list) else value


def _shape(data: Mapping[str, Any]) -> Shape:
    match dict(data):
        case {"compound": list(parts)}:
            return Compound(tuple(_part(part) for part in parts))
    return _convex(data)


def _part(data: Mapping[str, Any]) -> Part:
    x, y, z, qx, qy, qz, qw = data["pose"]
    return Part(_convex(data["shape"]), (x, y, z), (qx, qy, qz, qw))


def _convex(data: Mapping[str, Any]) -> Convex:
    match dict(data):
        case {"box": [x, y, z]}:
            return Box((x, y, z))
        case {"cylinder": {"radius": radius, "height": height}}:
            return Cylinder(radius, height)
        case {"sphere": {"radius": radius}}:
            return Sphere(radius)
        case {"mesh": {"vertices": list(vertices)}}:
            return Hull(tuple((x, y, z) for x, y, z in vertices))
    raise ValueError(f"shape {data!r}, expected box, cylinder, sphere, mesh or compound")
