"""Meshes, compounds, discs in the simulated world: they rest where they should, turn as they should, can be seen."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pybullet as p
import pytest
from pinocchio import SE3

from scenarios.load import load_scenario
from scenarios.scenario import Body, Scenario
from scenarios.shapes import Box, Compound, Cylinder, Hull, Shape, inertia, reach
from sim.bullet import BulletPlant
from sim.bullet_shapes import principal_axes
from sim.render import Renderer
from sim.robot import RobotModel

ROOF = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.06, 0], [0.1, 0.06, 0], [0.02, 0.03, 0.05], [0.08, 0.03, 0.05]])
TOP = 0.05
DISC = Cylinder(0.08, 0.015)


def _hull() -> Hull:
    return Hull.of(ROOF)[0]


def _rounded(sides: int) -> Hull:
    """A prism with so many sides, nearly a can."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    return Hull.of(np.array([[0.03 * np.cos(a), 0.03 * np.sin(a), z] for a in angles for z in (0.0, 0.1)]))[0]


def _tee() -> Compound:
    """A box, a cylinder and a hull, whose principal axes are not its own."""
    stem = (Cylinder(0.02, 0.08), SE3(np.eye(3), np.array([0.0, 0.0, 0.04])))
    bar = (Box((0.12, 0.03, 0.02)), SE3(pin.rpy.rpyToMatrix(0.0, 0.0, 0.5), np.array([0.02, 0.0, 0.09])))
    return Compound.of([stem, bar, (_hull(), SE3(np.eye(3), np.array([0.0, 0.0, 0.02])))])[0]


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return RobotModel()


@pytest.fixture
def with_body() -> Callable[..., Scenario]:
    """fig1 with nothing but one body, at x, y 0.6, 0.32 (off the arm, which falls), `drop` m above the table, yawed."""

    def scenario(shape: Shape, drop: float = 0.0) -> Scenario:
        height = TOP + reach(shape, np.array([0.0, 0.0, -1.0])) + drop
        X_WO = SE3(pin.rpy.rpyToMatrix(0.0, 0.0, 0.7), np.array([0.6, 0.32, height]))
        return replace(load_scenario("fig1"), bodies={"it": Body("it", shape, 0.2, 0.5, (1.0, 0.0, 0.0, 1.0), X_WO)})

    return scenario


@pytest.mark.parametrize("shape", [_hull(), _tee(), DISC, _rounded(16), _rounded(128)])
def test_it_rests_on_the_table_where_it_was_put(robot, with_body, shape):
    scenario = with_body(shape, drop=0.0005)
    plant = BulletPlant(scenario, robot)
    try:
        start = scenario.bodies["it"].X_WO
        assert np.allclose(plant.observe().poses["it"].homogeneous, start.homogeneous, atol=1e-6)
        for _ in range(400):
            plant.step()
        end = plant.observe().poses["it"]
    finally:
        plant.close()
    np.testing.assert_allclose(end.translation - start.translation, [0.0, 0.0, -0.0005], atol=2e-4)
    assert np.linalg.norm(pin.log3(start.rotation.T @ end.rotation)) < 0.01


@pytest.mark.parametrize("shape", [_hull(), _tee(), DISC])
def test_it_is_put_elsewhere_by_its_own_frame(robot, with_body, shape):
    plant = BulletPlant(with_body(shape), robot)
    try:
        X_WO = SE3(pin.exp3(np.array([0.5, 1.0, -0.3])), np.array([0.4, 0.5, 0.6]))
        plant.put("it", X_WO)
        np.testing.assert_allclose(plant.observe().poses["it"].homogeneous, X_WO.homogeneous, atol=1e-6)
    finally:
        plant.close()


@pytest.mark.parametrize("shape", [_hull(), _tee(), DISC])
def test_its_principal_moments_are_those_of_its_inertia(shape):
    axes = principal_axes(shape)
    assert axes is not None
    R = axes[0].rotation
    np.testing.assert_allclose(R @ np.diag(axes[1]) @ R.T, inertia(shape, 1.0), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_it_is_seen_where_it_is(with_body):
    scenario = with_body(_tee())
    with Renderer(scenario, engine="tiny") as renderer:
        here = pin.SE3ToXYZQUAT(scenario.bodies["it"].X_WO)
        picture = renderer.picture(scenario.robot.q0, 0.1, {"it": here}).astype(int)
        red = (picture[:, :, 0] > 120) & (picture[:, :, 1] < 60) & (picture[:, :, 2] < 60)
        rows, columns = np.nonzero(red)
        ((x, y),) = renderer.camera.project(here[:3])
    assert red.sum() > 100
    assert abs(columns.mean() - x) < 15
    assert abs(rows.mean() - y) < 15


@pytest.mark.parametrize("shape", [_hull(), _tee(), DISC])
def test_the_engine_has_its_mass_and_its_moments_about_its_centre(robot, with_body, shape):
    plant = BulletPlant(with_body(shape), robot)
    try:
        info = p.getDynamicsInfo(plant._bodies["it"], -1, physicsClientId=plant._client)
    finally:
        plant.close()
    assert info[0] == pytest.approx(0.2)
    np.testing.assert_allclose(info[2], np.linalg.eigvalsh(inertia(shape, 0.2)), rtol=1e-6)
