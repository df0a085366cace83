import numpy as np
import pinocchio as pin
import pytest

from sim.plant import GripCommand
from sim.wrench import Wrench
from skills.control.contact import ContactWrench, Touch, hand_inertia
from skills.control.dynamics import Dynamics
from skills.control.force import ForceLoop, smooth_step
from skills.control.reference import Reference

PERIOD = 0.002


def test_the_hand_weighs_what_its_bodies_weigh(robot):
    hand = hand_inertia(robot)
    assert hand.mass == pytest.approx(1.4, abs=1e-6)
    np.testing.assert_allclose(hand.lever[:2], 0.0, atol=1e-9)
    assert hand.lever[2] < -0.05


def sensed(robot, q, v, a, load, push):
    """What the sensor reads, from momentum balance alone: `push` (6,) acts on the tool, about G, in W axes."""
    data = robot.data()
    pin.forwardKinematics(robot.model, data, q, v, a)
    pose = pin.updateFramePlacement(robot.model, data, robot.tcp_id)
    total = hand_inertia(robot) + load
    in_world = pin.SE3(np.eye(3), pose.translation)
    spin = pin.getFrameVelocity(robot.model, data, robot.tcp_id, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED).angular
    rates = pin.getFrameClassicalAcceleration(robot.model, data, robot.tcp_id, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    arm = pose.rotation @ total.lever
    inertia = pose.rotation @ total.inertia @ pose.rotation.T
    centre = rates.linear + np.cross(rates.angular, arm) + np.cross(spin, np.cross(spin, arm))
    force = total.mass * (np.array([0.0, 0.0, -9.81]) - centre)
    torque = np.cross(arm, force) - inertia @ rates.angular - np.cross(spin, inertia @ spin)
    at_tool = pin.Force(force + push[:3], torque + push[3:])
    felt = robot.X_EG.act(pose.actInv(in_world.act(at_tool)))
    return Wrench(felt.linear, felt.angular)


def test_weight_and_inertia_of_hand_and_load_are_taken_off(robot):
    rng = np.random.default_rng(0)
    load = pin.Inertia(0.5, np.array([0.01, 0.0, 0.03]), 1e-3 * np.eye(3))
    push = np.array([1.0, -2.0, 5.0, 0.1, 0.2, -0.3])
    for _ in range(10):
        q, v, a = rng.uniform(-1.0, 1.0, (3, 7))
        contact = ContactWrench(robot, PERIOD)
        contact.carry(load)
        contact.update(Dynamics(robot).state(q, v - a * PERIOD), Wrench(np.zeros(3), np.zeros(3)))
        contact.update(Dynamics(robot).state(q, v), sensed(robot, q, v, a, load, push))
        np.testing.assert_allclose(contact.raw, push, atol=1e-9)


def test_taring_takes_off_an_error_of_the_sensor_wherever_the_hand_turns(robot):
    still, nothing = np.zeros(7), pin.Inertia.Zero()
    offset = Wrench(np.array([0.3, -0.2, 0.5]), np.array([0.01, 0.02, 0.0]))

    def reading(q):
        true = sensed(robot, q, still, still, nothing, np.zeros(6))
        return Wrench(true.force + offset.force, true.torque + offset.torque)

    def at(q):
        return Dynamics(robot).state(q, still)

    contact = ContactWrench(robot, PERIOD)
    for _ in range(200):
        contact.update(at(np.full(7, 0.3)), reading(np.full(7, 0.3)))
    assert np.linalg.norm(contact.smooth) > 0.3
    contact.tare()
    for _ in range(200):
        contact.update(at(np.full(7, -0.4)), reading(np.full(7, -0.4)))
    assert np.linalg.norm(contact.smooth) < 1e-3


def touched(forces):
    touch, seen = Touch(PERIOD), []
    for force in forces:
        touch.update(force)
        seen.append(touch.closed)
    return seen


def test_a_knock_of_two_ticks_is_no_contact():
    assert not any(touched([0.0, 30.0, 30.0, 0.0] * 5))


def test_contact_is_seen_within_8_ms_and_its_loss_within_50_ms():
    seen = touched([0.0] * 10 + [3.0] * 50 + [0.0] * 50)
    assert 10 < seen.index(True) <= 10 + 4
    assert seen[59]
    assert not seen[60 + 25]


def test_a_bouncing_contact_is_not_lost():
    assert all(touched([3.0] * 10 + [0.0, 0.0, 0.0, 2.0] * 50)[10:])


def test_the_force_loop_removes_a_constant_error_and_keeps_its_bounds():
    loop = ForceLoop(PERIOD)
    loop.reset(0.0)
    loop.aim(10.0)
    for _ in range(3000):
        measured = 0.8 * loop.command
        loop.update(measured)
    assert measured == pytest.approx(10.0, abs=0.05)
    for _ in range(10000):
        loop.update(0.0)
    assert loop.command <= 20.0


def test_the_wanted_force_ramps_without_a_jump():
    loop = ForceLoop(PERIOD)
    loop.reset(2.0)
    loop.aim(12.0)
    wanted = [loop.wanted]
    for _ in range(300):
        loop.update(loop.wanted)
        wanted.append(loop.wanted)
    assert wanted[0] == 2.0
    assert wanted[-1] == 12.0
    assert max(np.diff(wanted)) < 0.2


def test_a_smooth_step_is_level_at_both_ends():
    assert smooth_step(-1.0) == 0.0
    assert smooth_step(2.0) == 1.0
    assert smooth_step(0.01) < 1e-3
    assert smooth_step(0.99) > 1 - 1e-3


@pytest.mark.parametrize("speed", [-0.1, 0.1])
def test_fingers_driven_against_their_stops_are_not_felt_as_contact(lab, speed):
    rig = lab.rig(lab.home, grip=GripCommand(speed, 80.0))
    rig.run(1.2)
    assert rig.controller.felt < 0.2


def test_swinging_through_the_air_is_not_felt_as_contact(lab):
    rig = lab.rig(lab.home)
    swing = lab.straight(lab.home, [0.05, 0.25, -0.1], 0.5)
    seen = rig.follow(Reference(swing), lambda _: np.linalg.norm(rig.controller._wrench.raw[:3]))
    assert rig.controller.finished
    assert max(seen) < 0.3
