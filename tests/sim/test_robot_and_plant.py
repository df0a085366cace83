"""The robot's two models agree, and the simulated world is what it claims to be."""

import numpy as np
import pinocchio as pin
import pybullet as p
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from planner.grasps import grasps
from scenarios.load import load_scenario
from scenarios.shapes import Box, Cylinder, Sphere
from sim.bullet import BulletPlant
from sim.bullet_bodies import resolved_urdf
from sim.plant import Command, GripCommand
from sim.robot import GRAVITY, RobotModel


@pytest.fixture(scope="module")
def bullet_robot():
    client = p.connect(p.DIRECT)
    with resolved_urdf(RobotModel()) as path:
        body = p.loadURDF(path, useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client)
    p.setGravity(0, 0, -GRAVITY, physicsClientId=client)
    yield client, body
    p.disconnect(client)


@pytest.fixture(scope="module")
def full_model():
    return pin.buildModelFromUrdf(str(RobotModel().urdf))


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_pybullet_and_pinocchio_agree_in_mass_matrix_gravity_and_bias(bullet_robot, full_model, seed):
    client, body = bullet_robot
    rng = np.random.default_rng(seed)
    q = rng.uniform(full_model.lowerPositionLimit, full_model.upperPositionLimit)
    v = rng.uniform(-1.0, 1.0, 9)
    data = full_model.createData()
    M = pin.crba(full_model, data, q)
    M = np.triu(M) + np.triu(M, 1).T
    still, zero = [0.0] * 9, np.zeros(9)
    seen = np.array(p.calculateMassMatrix(body, list(q), physicsClientId=client))
    np.testing.assert_allclose(seen, M, atol=1e-9)
    gravity = p.calculateInverseDynamics(body, list(q), still, still, physicsClientId=client)
    np.testing.assert_allclose(gravity, pin.rnea(full_model, data, q, zero, zero), atol=1e-9)
    bias = p.calculateInverseDynamics(body, list(q), list(v), still, physicsClientId=client)
    np.testing.assert_allclose(bias, pin.rnea(full_model, data, q, v, zero), atol=1e-9)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_the_hands_velocity_is_the_rate_of_its_pose(seed):
    robot, rng, dt = RobotModel(), np.random.default_rng(seed), 1e-6
    q = rng.uniform(robot.q_min, robot.q_max)
    v = rng.uniform(-1.0, 1.0, 7)
    before, after, V_WG = robot.X_WG(q - v * dt), robot.X_WG(q + v * dt), robot.V_WG(q, v)
    np.testing.assert_allclose(V_WG[:3], (after.translation - before.translation) / (2 * dt), atol=1e-5)
    np.testing.assert_allclose(V_WG[3:], pin.log3(after.rotation @ before.rotation.T) / (2 * dt), atol=1e-5)


def test_the_arms_limits_are_the_makers():
    robot = RobotModel()
    np.testing.assert_allclose(robot.tau_max, [320, 320, 176, 176, 110, 40, 40])
    np.testing.assert_allclose(robot.v_max, [1.48, 1.48, 1.75, 1.31, 2.27, 2.36, 2.36])
    np.testing.assert_allclose(np.degrees(robot.q_max), [170, 120, 170, 120, 170, 120, 175])


@pytest.fixture
def world():
    scenario = load_scenario("fig2")
    robot = RobotModel()
    plant = BulletPlant(scenario, robot)
    yield plant, robot, scenario
    plant.close()


def hold(plant, robot, scenario, ticks, grip):
    data = robot.data()
    q0 = scenario.robot.q0
    for _ in range(ticks):
        seen = plant.observe()
        a = -400.0 * (seen.q - q0) - 40.0 * seen.v
        plant.apply(Command(pin.rnea(robot.model, data, seen.q, seen.v, a), grip))
        plant.step()
    return plant.observe()


def test_at_rest_the_wrist_feels_the_hands_weight_pointing_down(world):
    seen = hold(*world, 400, GripCommand(0.0, 40.0))
    R_WE = world[1].link_poses(seen.q, seen.opening)["hand"].rotation
    np.testing.assert_allclose(R_WE @ seen.wrist.force, [0.0, 0.0, -1.4 * GRAVITY], atol=0.02)


def test_the_fingers_move_together_and_stop_at_their_stroke(world):
    plant = world[0]
    closing = hold(*world, 500, GripCommand(-0.1, 40.0))
    fingers = p.getJointStates(plant._robot, plant._finger_joints, physicsClientId=plant._client)
    assert closing.opening < 0.07
    assert abs(fingers[0][0] - fingers[1][0]) < 1e-3
    opened = hold(*world, 1500, GripCommand(0.2, 40.0))
    assert abs(opened.opening - world[1].gripper.stroke) < 2e-3


def test_without_torque_the_arm_falls_and_what_lies_on_the_table_stays(world):
    plant, _, scenario = world
    before = plant.observe().poses["cube"]
    for _ in range(300):
        plant.apply(Command(np.zeros(7), GripCommand(0.0, 0.0)))
        plant.step()
    seen = plant.observe()
    assert np.abs(seen.q - scenario.robot.q0).max() > 0.05
    assert np.linalg.norm(seen.poses["cube"].translation - before.translation) < 1e-3


def test_a_command_that_is_not_finite_is_refused(world):
    with pytest.raises(ValueError, match="finite"):
        world[0].apply(Command(np.full(7, np.nan), GripCommand(0.0, 0.0)))


@pytest.mark.parametrize("shape", [Box((0.06, 0.2, 0.03)), Cylinder(0.03, 0.12), Sphere(0.03)])
def test_grasps_are_antipodal_and_fit_the_stroke(shape):
    gripper = RobotModel().gripper
    found = list(grasps(shape, SE3.Identity(), gripper, np.array([-0.6, 0.0, 0.0]), np.random.default_rng(0)))
    assert found
    approach = [grasp.X_OG.rotation[:, 2] for grasp in found]
    assert approach[0][2] < -0.99
    for grasp in found:
        assert grasp.width <= gripper.stroke
        closing, p_OG = grasp.X_OG.rotation[:, 1], np.array(grasp.position)
        assert abs(closing @ p_OG) < 1e-9


def test_a_box_too_wide_for_the_stroke_has_no_grasp():
    gripper = RobotModel().gripper
    wide = Box((0.2, 0.2, 0.2))
    assert not list(grasps(wide, SE3.Identity(), gripper, np.zeros(3) - 1.0, np.random.default_rng(0)))


def test_a_falling_hand_is_stopped_over_several_steps_and_not_within_one(world):
    plant, robot, _ = world
    heights = []
    for _ in range(700):
        plant.apply(Command(np.zeros(7), GripCommand(0.0, 0.0)))
        plant.step()
        touches = any({"finger_left", "finger_right"} & {c.first, c.second} for c in plant.contacts())
        heights.append((robot.X_WG(plant.observe().q).translation[2], touches))
    speeds, touching = -1000.0 * np.diff([h for h, _ in heights]), np.array([t for _, t in heights[1:]])
    touched = int(np.argmax(touching))
    assert speeds[touched - 1] > 0.3
    assert speeds[touched + 1] > 0.5 * speeds[touched - 1]
