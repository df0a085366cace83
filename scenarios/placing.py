"""The scene a file describes, as plain data: poses resolved, no noise, nothing checked yet."""

from collections.abc import Mapping

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from scenarios import schema
from scenarios.names import TABLE
from scenarios.scenario import Body, Fixture, Region, RobotPlacement, Scenario, Table
from scenarios.schema_parts import Pose, PoseOn
from scenarios.shapes import Shape, reach


def declared_scenario(file: schema.SceneFile, shapes: Mapping[str, Shape]) -> Scenario:
    """The scenario at seed 0, its goal as written; `shapes` by name. Names in `on` and goal must be known."""
    table = Table(_triple(file.table.size), frame(file.table.pose), file.table.friction)
    regions = {name: _region(name, region) for name, region in file.regions.items()}
    heights = _heights(table, regions)
    things: dict[str, schema.Thing | schema.Tool] = {**file.objects, **file.tools}
    return Scenario(
        name=file.name,
        seed=0,
        robot=_robot(file.robot),
        table=table,
        regions=regions,
        fixtures={name: _fixture(name, fixed, shapes[name], heights) for name, fixed in file.fixed.items()},
        bodies={name: _body(name, thing, shapes[name], heights) for name, thing in things.items()},
        goal=file.goal,
    )


def frame(pose: Pose) -> SE3:
    """The pose as SE3: fixed-axis roll, pitch, yaw, R = Rz Ry Rx."""
    return SE3(pin.rpy.rpyToMatrix(np.radians(pose.rpy_deg)), np.array(pose.xyz, dtype=float))


def _frame_on(pose: PoseOn, shape: Shape, heights: Mapping[str, float]) -> SE3:
    z = heights[pose.on] + reach(shape, np.array([0.0, 0.0, -1.0]))
    return SE3(pin.rpy.rpyToMatrix(0.0, 0.0, np.radians(pose.yaw_deg)), np.array([*pose.xy, z]))


def heights_of(scenario: Scenario) -> dict[str, float]:
    """Height in W of the surface on which things rest: of the table's top, of each region's floor."""
    return _heights(scenario.table, scenario.regions)


def _heights(table: Table, regions: Mapping[str, Region]) -> dict[str, float]:
    heights = {TABLE: float(table.X_WT.translation[2]) + table.size[2] / 2}
    return heights | {n: float(r.X_WR.translation[2]) - r.size[2] / 2 + r.wall for n, r in regions.items()}


def body_frame(pose: Pose | PoseOn, shape: Shape, heights: Mapping[str, float]) -> SE3:
    """Where a body of this shape stands."""
    return _frame_on(pose, shape, heights) if isinstance(pose, PoseOn) else frame(pose)


def _robot(robot: schema.Robot) -> RobotPlacement:
    q0 = np.radians(robot.q0_deg)
    q0.setflags(write=False)
    return RobotPlacement(robot.model, frame(robot.base), q0)


def _region(name: str, region: schema.Region) -> Region:
    return Region(
        name=name,
        kind=region.kind,
        size=_triple(region.size),
        wall=region.wall,
        X_WR=frame(region.pose),
        friction=region.friction,
        open_side=region.open_side,
        ramp_deg=region.ramp_deg,
    )


def _fixture(name: str, fixed: schema.Fixed, shape: Shape, heights: Mapping[str, float]) -> Fixture:
    return Fixture(name, shape, body_frame(fixed.pose, shape, heights), fixed.friction, _rgba(fixed.color))


def _body(name: str, thing: schema.Thing | schema.Tool, shape: Shape, heights: Mapping[str, float]) -> Body:
    is_tool = isinstance(thing, schema.Tool)
    return Body(
        name=name,
        shape=shape,
        mass=thing.mass,
        friction=thing.friction,
        color=_rgba(thing.color),
        X_WO=body_frame(thing.pose, shape, heights),
        home=thing.home,
        tool=thing.kind if is_tool else None,
        contact_stiffness=thing.contact_stiffness if is_tool else None,
        contact_damping=thing.contact_damping if is_tool else None,
    )


def _triple(numbers: list[float]) -> tuple[float, float, float]:
    x, y, z = numbers
    return float(x), float(y), float(z)


def _rgba(color: str) -> tuple[float, float, float, float]:
    digits = color[1:].ljust(8, "f")
    r, g, b, a = (int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4, 6))
    return r, g, b, a
