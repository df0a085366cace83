"""What lies still costs the engine nothing, and yet nothing is nailed down."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from pinocchio import SE3

from scenarios.load import load_scenario
from scenarios.scenario import Body
from scenarios.shapes import Box, Cylinder
from sim.bullet import BulletPlant
from sim.plant import Command, GripCommand
from sim.robot import RobotModel

SIDE = 0.06
CUBE = Box((SIDE, SIDE, SIDE))


@pytest.fixture
def stack():
    """A cube on a cube on a table, left alone until both are at rest to the last digit."""
    scenario = load_scenario("fig1", 0)
    top = scenario.table.X_WT.act(np.array([0.0, 0.0, scenario.table.size[2] / 2]))
    bodies = {
        name: Body(name, CUBE, 0.2, 0.5, (1.0, 0.0, 0.0, 1.0), SE3(np.eye(3), top + np.array([0.0, 0.0, height])))
        for name, height in (("lower", SIDE / 2), ("upper", 1.5 * SIDE))
    }
    plant = BulletPlant(replace(scenario, bodies=bodies), RobotModel())
    wait(plant, 3.0)
    assert not np.any(plant.observe().velocities["upper"])
    yield plant
    plant.close()


def wait(plant, seconds):
    robot = RobotModel()
    data = robot.data()
    for _ in range(round(seconds / plant.timestep)):
        seen = plant.observe()
        plant.apply(Command(pin.rnea(robot.model, data, seen.q, seen.v, -40.0 * seen.v), GripCommand(0.0, 80.0)))
        plant.step()


def spot(plant, name):
    return plant.observe().poses[name].translation


def test_what_is_put_in_the_air_falls(stack):
    before = spot(stack, "upper")
    stack.put("upper", SE3(np.eye(3), before + np.array([0.15, 0.0, 0.1])))
    wait(stack, 0.6)
    assert spot(stack, "upper")[2] == pytest.approx(before[2] - SIDE, abs=2e-3)


def test_what_lay_on_something_falls_when_that_is_taken_away(stack):
    before = spot(stack, "upper")
    stack.put("lower", SE3(np.eye(3), spot(stack, "lower") + np.array([0.15, 0.0, 0.0])))
    wait(stack, 0.6)
    assert spot(stack, "upper")[2] == pytest.approx(before[2] - SIDE, abs=2e-3)


def test_what_is_struck_moves(stack):
    before = spot(stack, "upper")
    tilted = pin.rpy.rpyToMatrix(0.6, 0.0, 0.0)
    stack.put("lower", SE3(tilted, before + np.array([0.0, 0.04, 0.1])))
    wait(stack, 0.6)
    assert np.linalg.norm(spot(stack, "upper") - before) > 0.01


def test_cylinders_that_lie_do_not_roll_off_by_themselves():
    scenario = load_scenario("fig1", 0)
    sizes = {"rod": (0.011, 0.24), "can": (0.027, 0.088), "jar": (0.045, 0.07), "tube": (0.016, 0.12)}
    lying = {}
    for k, (name, (radius, height)) in enumerate(sizes.items()):
        p = np.array([0.62, -0.15 + 0.14 * k, 0.05 + radius])
        X_WO = SE3(pin.rpy.rpyToMatrix(np.pi / 2, 0.0, 0.6 + 0.7 * k), p)
        lying[name] = Body(name, Cylinder(radius, height), 0.09, 0.55, (1.0, 0.0, 0.0, 1.0), X_WO)
    plant = BulletPlant(replace(scenario, bodies=lying), RobotModel())
    wait(plant, 6.0)
    ways = {name: np.linalg.norm(spot(plant, name) - body.X_WO.translation) for name, body in lying.items()}
    plant.close()
    assert max(ways.values()) < 1e-3, ways
