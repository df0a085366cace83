import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.motion.trajectory import Trajectory
from skills.control.dynamics import Dynamics
from skills.control.momentum import GAIN, MomentumObserver
from skills.control.reference import Reference

PERIOD = 0.002
FRICTION = np.full(7, 1.0)


def observed(robot, outside, sensed, duration=0.3):
    """What an observer makes of a simulated free motion under `outside` (7,), of which the sensor tells `sensed`."""
    observer, dynamics, data = MomentumObserver(PERIOD), Dynamics(robot), robot.data()
    q, v = np.full(7, 0.3), np.zeros(7)
    tau, seen = np.zeros(7), []
    for _ in range(round(duration / PERIOD)):
        state = dynamics.state(q, v)
        observer.update(state.M, state.bias, v, tau, sensed)
        seen.append(observer.unmodelled)
        tau = state.bias + np.zeros(7)
        for _ in range(4):
            a = pin.aba(robot.model, data, q, v, tau + outside)
            v = v + a * PERIOD / 4
            q = q + v * PERIOD / 4
    return np.array(seen)


@settings(max_examples=6, derandomize=True, deadline=None)
@given(shares=st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7).map(np.array))
def test_a_torque_from_outside_is_found_in_motion_to_a_few_percent(robot, shares):
    torques = shares * [4.0, 4.0, 3.0, 3.0, 1.0, 0.5, 0.02]
    seen = observed(robot, torques, np.zeros(7), 0.15)
    np.testing.assert_allclose(seen[-1], torques, atol=0.12)


def test_it_is_seen_with_the_observers_time_constant(robot):
    torque = np.array([0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    seen = observed(robot, torque, np.zeros(7))[:, 1]
    rise = np.argmax(seen > 3.0 * (1.0 - np.exp(-1.0))) * PERIOD
    assert rise == pytest.approx(1.0 / GAIN, abs=0.006)


def test_what_the_sensor_explains_is_not_unmodelled(robot):
    torque = np.array([0.5, 2.0, -1.0, 1.0, 0.3, -0.2, 0.1])
    assert np.abs(observed(robot, torque, torque)).max() < 0.15


def test_what_lasts_is_no_longer_sudden():
    observer = MomentumObserver(PERIOD)
    for _ in range(2):
        observer.update(np.eye(7), np.zeros(7), np.zeros(7), np.zeros(7), np.zeros(7))
    steps = []
    for _ in range(500):
        observer.update(np.eye(7), np.zeros(7), np.zeros(7), -5.0 * np.ones(7), np.zeros(7))
        steps.append(observer.sudden[0])
    assert max(steps) > 4.0
    assert steps[-1] < 0.5
    assert observer.unmodelled[0] == pytest.approx(5.0, abs=0.01)


def test_another_model_makes_no_jump(robot):
    observer = MomentumObserver(PERIOD)
    v = np.ones(7)
    for scale in (1.0, 1.0, 3.0, 3.0):
        if scale == 3.0:
            observer.change_model()
        observer.update(scale * np.eye(7), np.zeros(7), v, np.zeros(7), np.zeros(7))
    np.testing.assert_array_equal(observer.unmodelled, np.zeros(7))


def test_joint_friction_of_1_newton_metre_hardly_bends_a_path(lab):
    rig = lab.rig(lab.home)
    rig.plant.set_joint_friction(FRICTION)
    rig.controller.follow(Reference(Trajectory.standstill(lab.home), "impedance", lab.stiffness))
    rig.run(0.1)
    line = lab.straight(rig.q, [0.0, 0.25, 0.0], 0.1)
    reference = Reference(line, "impedance", lab.stiffness)
    errors = rig.follow(reference, lambda _: rig.controller.tracking_error.position)
    assert max(errors) < 3e-3
    assert errors[len(errors) // 2] < 1e-3
    # Without compensation 1 Nm at the wrist alone is worth 3 N at 1000 N/m.
    assert np.abs(rig.controller.unmodelled).max() > 0.5


def test_an_arm_heavier_than_believed_does_not_sag_for_long(lab):
    rig = lab.rig(lab.home)
    rig.plant.scale_masses(1.2)
    rig.run(0.5)
    assert rig.controller.stopped is None
    assert np.abs(rig.q - lab.home).max() < 2e-3
