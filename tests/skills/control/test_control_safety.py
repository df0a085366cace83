from dataclasses import replace

import numpy as np
import pytest

from planner.motion.trajectory import Trajectory
from sim.disturbance import DisturbedPlant
from sim.plant import Command
from sim.robot_faults import Push
from sim.sensor_faults import ForceDelay, ForceFrozen, ForceMissing, ForceNoise, JointDelay
from skills.control.controller import ArmController
from skills.control.dynamics import Dynamics
from skills.control.limits import FREE, ApproachLimit, Block
from skills.control.reference import Reference
from skills.control.safety import (
    Collision,
    ForceTooHigh,
    Guard,
    SafetyLimits,
    SensorLost,
    TooFast,
    TorqueSpent,
)
from skills.control.state import Target
from skills.control.tasks import HybridTask
from skills.control.torque_qp import TorqueQP

PERIOD = 0.002
STILL = np.zeros(7)
ALLOWED = np.array([0.0, -40.0, 0.0, 0.0, 0.0, 0.0])


def strict(rig, **limits):
    """The rig's controller anew, with other safety limits."""
    rig.controller = ArmController(rig.robot, PERIOD, SafetyLimits(**{"speed": rig.robot.tcp_speed_max, **limits}))
    rig.run(0.05)
    return rig


def test_the_approach_is_limited_and_the_arm_does_not_stop_for_it(robot):
    state = Dynamics(robot).state(np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0]), STILL)
    dive = Target(state.p - [0.0, 0.0, 0.5], state.R, np.zeros(6), np.zeros(6))
    sideways = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    limit = ApproachLimit(np.array([0.0, 0.0, 1.0]), 0.05)
    free = TorqueQP(robot, PERIOD).solve(state, [HybridTask(dive, sideways)], STILL)
    kept = TorqueQP(robot, PERIOD).solve(state, [HybridTask(dive, sideways)], STILL, (limit,))
    assert (state.J @ free.a + state.drift)[2] < -20.0
    assert (state.J @ kept.a + state.drift)[2] == pytest.approx(-0.05 / 0.01, abs=0.01)
    assert kept.status == "solved"


def test_away_from_the_surface_nothing_is_limited(robot):
    state = Dynamics(robot).state(np.full(7, 0.3), STILL)
    block = Block(np.zeros((3, 7)), np.zeros(3), np.zeros(3))
    ApproachLimit(np.array([0.0, 0.0, 1.0]), 0.05).fill(state, block, 1)
    np.testing.assert_array_equal(block.upper, [0.0, FREE, 0.0])
    np.testing.assert_allclose(block.R[1], state.J[2])
    assert not block.R[[0, 2]].any()


def test_a_tool_that_loses_the_table_sinks_no_faster_than_allowed(lab):
    rig = lab.rig(lab.home)
    rig.run(0.05)
    rig.controller.follow(Reference(Trajectory.standstill(lab.home, 1.0), "hybrid", force=40.0))
    speeds = rig.run(0.04, lambda _: -rig.controller._state.V[2])
    assert max(speeds) < 0.08
    assert rig.controller.stopped is None


def test_a_contact_force_near_its_limit_stops_the_arm(lab):
    rig = lab.rig(lab.home)
    rig.push = np.array([0.0, 0.0, 44.0])
    rig.run(0.3)
    assert rig.controller.stopped is None
    rig.push = np.array([0.0, 0.0, 47.0])
    rig.run(0.05)
    assert isinstance(rig.controller.stopped, ForceTooHigh)
    assert rig.controller.stopped.limit == 60.0
    assert rig.controller.reference is None
    assert not rig.controller.finished
    assert rig.controller.collision is None


def test_a_hand_near_its_speed_limit_is_braked_without_a_jerk(lab):
    rig = strict(lab.rig(lab.home), speed=0.3)
    rig.controller.follow(Reference(lab.straight(lab.home, [0.0, 0.3, 0.0], 0.4)))
    steps = lab.steps(rig)

    def look(observation):
        steps(observation)
        return np.linalg.norm(rig.controller._state.V[:3])

    speeds = rig.run(1.0, look)
    assert isinstance(rig.controller.stopped, TooFast)
    assert max(speeds) < 0.3
    assert speeds[-1] < 1e-2
    assert steps.largest < 5.0


def test_a_torque_limit_is_kept_and_working_at_it_stops_the_arm(lab):
    rig = lab.rig(lab.home)
    weak = replace_torques(rig.robot, 1.01 * np.abs(held_torques(rig)))
    rig.controller = ArmController(weak, PERIOD)
    rig.run(0.05)
    rig.push = np.array([0.0, 0.0, -40.0])
    rig.run(0.3)
    assert isinstance(rig.controller.stopped, TorqueSpent)
    assert rig.controller.torque_limit_violations == 0


def held_torques(rig):
    rig.run(0.2)
    return np.maximum(np.abs(rig.tau), 5.0)


def replace_torques(robot, tau_max):
    weak = robot.with_payload(1e-9, np.zeros(3), 1e-12 * np.eye(3))
    weak.tau_max = tau_max
    return weak


def test_a_blow_against_the_elbow_stops_the_arm_and_is_told(lab):
    rig = lab.rig(lab.home)
    rig.controller.follow(Reference(lab.straight(lab.home, [0.0, 0.3, 0.0], 0.25)))
    rig.run(0.6)
    assert rig.controller.collision is None
    before = rig.q
    for _ in range(60):
        observation = rig.plant.observe()
        rig.tau = rig.controller.update(observation)
        rig.plant.apply(Command(rig.tau, rig.grip))
        for _ in range(2):
            rig.plant.push(np.array([0.0, -80.0, 0.0]), "link_4")
            rig.plant.step()
    told = rig.controller.collision
    assert isinstance(told, Collision)
    assert 3.0 < told.torque < 80.0
    assert "joint" in str(told)
    rig.run(1.0)
    assert not rig.controller.finished
    assert np.abs(rig.plant.observe().v).max() < 0.02
    assert np.abs(rig.q - before).max() < 0.2
    rig.controller.follow(Reference(Trajectory.standstill(rig.q)))
    rig.run(0.3)
    assert rig.controller.stopped is None
    assert rig.controller.finished


@pytest.mark.parametrize("bend", [80.0, 100.0])
def test_a_push_on_the_hand_neither_flings_the_arm_about_nor_drives_a_joint_onto_its_stop(lab, bend):
    start = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, bend, 0.0])
    rig = lab.rig(start)
    rig.run(0.3)
    rig.push = np.array([-100.0, 0.0, 0.0])
    pushed = rig.run(0.1, lambda observation: observation.q)
    rig.push = None
    pushed += rig.run(0.4, lambda observation: observation.q)
    assert isinstance(rig.controller.stopped, ForceTooHigh)
    assert (rig.robot.q_max - np.abs(pushed)).min() > 0.05
    assert np.abs(pushed[-1] - start).max() < 0.3


@pytest.mark.parametrize("posture", range(3))
@pytest.mark.parametrize("force", [(-100.0, 0.0, 0.0), (0.0, 100.0, 0.0)])
def test_an_arm_that_is_pushed_comes_to_rest_though_its_joints_states_come_10_ms_late(lab, posture, force):
    rig = lab.rig(lab.postures[posture])
    rig.plant = DisturbedPlant(rig.plant, [JointDelay(0.01), Push(force, start=0.3, end=0.4)])

    def look(_):
        return np.abs(rig.plant.truth().v / rig.robot.v_max).max(), rig.controller.felt

    speeds, felt = np.array(rig.run(1.3, look)).T
    assert isinstance(rig.controller.stopped, ForceTooHigh)
    assert speeds.max() < 6.0
    assert felt.max() < 500.0
    assert speeds[-100:].max() < 0.15
    assert felt[-100:].max() < 5.0


@pytest.mark.parametrize("posture", range(3))
def test_a_push_on_the_wrist_displaces_the_hand_by_a_centimetre_and_it_comes_back(lab, posture):
    rig = lab.rig(lab.postures[posture])
    rig.plant = DisturbedPlant(rig.plant, [Push((0.0, 0.0, -100.0), "link_6", start=0.3, end=0.4)])
    start = rig.robot.X_WG(lab.postures[posture]).translation

    def away(_):
        return np.linalg.norm(rig.robot.X_WG(rig.plant.truth().q).translation - start)

    displaced = rig.run(0.7, away)
    assert isinstance(rig.controller.stopped, Collision)
    assert max(displaced) < 0.0115
    assert displaced[-1] < 0.004


def test_ordinary_work_on_an_arm_with_friction_and_wrong_masses_is_no_collision(lab):
    rig = lab.rig(lab.home)
    rig.plant.set_joint_friction(np.full(7, 1.0))
    rig.plant.scale_masses(1.2)
    rig.run(0.3)
    there = lab.straight(rig.q, [0.05, 0.3, -0.05], 0.4)
    rig.follow(Reference(there))
    rig.follow(Reference(lab.straight(rig.q, [-0.05, -0.3, 0.05], 0.4)))
    assert rig.controller.stopped is None


def test_a_joint_that_rubs_with_3_nm_and_turns_round_is_no_collision(lab):
    for joint in (2, 4, 6):
        rig = lab.rig(lab.postures[1])
        rig.plant.set_joint_friction(3.0 * np.eye(7)[joint])
        rig.run(0.2)
        way = 0.8 * np.eye(7)[joint] * np.sin(np.linspace(0.0, 2.0 * np.pi, 60))[:, None]
        times = np.linspace(0.0, 4.0, 60)
        rig.follow(Reference(Trajectory(times, rig.q + way, np.gradient(way, times, axis=0))))
        assert rig.controller.stopped is None


def test_a_wrist_sensor_that_falls_silent_while_pressing_stops_the_arm(lab):
    rig = lab.gripped_sponge(0.6, 0.0, 0.01)
    lower = lab.straight(rig.q, [0.0, 0.0, -0.02], 0.03)
    rig.follow(Reference(lower, "hybrid", force=10.0, until_contact=True))
    rig.plant = DisturbedPlant(rig.plant, [ForceMissing()])
    rig.run(0.018)
    assert rig.controller.stopped is None
    rig.run(0.02)
    assert isinstance(rig.controller.stopped, SensorLost)
    assert np.all(np.isfinite(rig.tau))
    rig.run(0.3)
    assert np.abs(rig.plant.observe().v).max() < 0.02


def test_a_wrist_sensor_that_is_frozen_while_contact_is_sought_stops_the_arm_before_it_presses_hard(lab):
    rig = lab.gripped_sponge(0.6, 0.0, 0.02)
    rig.plant = DisturbedPlant(rig.plant, [ForceFrozen(start=rig.plant.observe().t + 0.3)])
    rig.controller.follow(
        Reference(lab.straight(rig.q, [0.0, 0.0, -0.03], 0.03), "hybrid", force=10.0, until_contact=True)
    )
    assert max(rig.run(1.5, lambda _: rig.pressed_on_table("sponge"))) < 20.0
    assert isinstance(rig.controller.stopped, SensorLost)


def test_in_free_motion_a_silent_sensor_changes_nothing(lab):
    rig = lab.rig(lab.home)
    rig.plant = DisturbedPlant(rig.plant, [ForceMissing()])
    rig.follow(Reference(lab.straight(lab.home, [0.0, 0.1, 0.0], 0.2)))
    assert rig.controller.finished


def test_one_odd_reading_stops_nothing():
    guard = Guard(SafetyLimits(speed=2.5, contact_force=60.0), np.full(7, 100.0), PERIOD)

    def pushed(wrench):
        return guard.look(np.zeros(6), wrench, STILL, STILL, False)

    def struck(torque):
        return guard.look(np.zeros(6), np.zeros(6), torque, STILL, False)

    assert [pushed(wrench) for wrench in (ALLOWED, 3 * ALLOWED, 3 * ALLOWED, ALLOWED)] == [None] * 4
    assert [pushed(3 * ALLOWED) for _ in range(3)][-1] == ForceTooHigh(120.0, 60.0)
    hit = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 9.0])
    assert [struck(hit) for _ in range(3)] == [None] * 3
    assert struck(hit) == Collision(7, 9.0)
    guard.reset()
    assert struck(hit) is None


@pytest.mark.parametrize(("force", "is_pressed", "is_stop"), [(50, False, True), (50, True, False), (56, True, True)])
def test_a_force_that_is_regulated_may_come_nearer_to_the_limit_than_a_blow(force, is_pressed, is_stop):
    guard, wrench = (
        Guard(SafetyLimits(speed=2.5), np.full(7, 100.0), PERIOD),
        np.array([0.0, 0.0, force, 0.0, 0.0, 0.0]),
    )
    stops = [guard.look(np.zeros(6), wrench, STILL, STILL, is_pressed) for _ in range(3)]
    assert (stops[-1] is not None) == is_stop


def test_a_tare_under_noise_and_delay_leaves_a_tenth_of_a_newton(lab):
    rig = lab.rig(lab.home)
    rig.plant = DisturbedPlant(rig.plant, [ForceNoise(0.3, 0.01, seed=3), ForceDelay(0.004)])
    rig.run(0.2)
    rig.controller.tare()
    rig.run(0.2)
    felt = np.mean(rig.run(0.5, lambda _: rig.controller._wrench.raw[:3]), axis=0)
    assert np.abs(felt).max() < 0.1


def test_reasons_are_plain_values():
    assert replace(TooFast(1.0, 2.0), speed=1.5) == TooFast(1.5, 2.0)
    assert str(SensorLost(0.022)) == "the wrist sensor has told nothing new for 22 ms"
