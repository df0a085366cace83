from dataclasses import replace

import numpy as np
import pinocchio as pin
import pybullet
import pytest
from pinocchio import SE3

from scenarios.scenario import Body, Region, RobotPlacement, Scenario, Table
from scenarios.shapes import Box
from sim.bullet import BulletPlant
from sim.disturbance import DisturbedPlant, Fault
from sim.plant import Command, GripCommand
from sim.robot import RobotModel
from sim.robot_faults import JointFriction, Push, SlipperyPads, WeakGrip
from sim.sensor_faults import (
    ForceBias,
    ForceDelay,
    ForceFrozen,
    ForceMissing,
    ForceNoise,
    JointDelay,
    PoseDelay,
    PoseMissing,
    PoseNoise,
)
from sim.world_faults import BinShifted, Brought, Moved, TakenAway

IDLE = GripCommand(0.0, 80.0)
HOME = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])
FALLING = {"stone": (0.8, 0.2, 3.0), "feather": (0.8, -0.2, 3.0)}


@pytest.fixture
def make():
    """Makes plants with a table and two bodies in free fall, disturbed by what is asked for."""
    made = []

    def plant(*faults):
        bodies = {
            name: Body(name, Box((0.04, 0.04, 0.04)), 0.2, 0.5, (1.0, 0, 0, 1.0), SE3(np.eye(3), np.array(place)))
            for name, place in FALLING.items()
        }
        table = Table((0.8, 1.2, 0.05), SE3(np.eye(3), np.array([0.62, 0.0, 0.025])), 0.3)
        robot = RobotModel()
        scenario = Scenario("bare", 0, RobotPlacement(robot.name, SE3.Identity(), HOME), table, {}, {}, bodies, "")
        made.append(DisturbedPlant(BulletPlant(scenario, robot), faults))
        return made[-1]

    yield plant
    for one in made:
        one.close()


def watched(plant, duration, tau=None):
    """Observations at every step under constant torques: those that hold the weight at first, plus `tau`."""
    robot, seen = RobotModel(), []
    hold = pin.computeGeneralizedGravity(robot.model, robot.data(), HOME)
    for _ in range(round(duration / plant.timestep)):
        seen.append(plant.observe())
        plant.apply(Command(hold if tau is None else hold + tau, IDLE))
        plant.step()
    return seen


def wrists(seen):
    return np.array([o.wrist.vector for o in seen])


def test_without_faults_everything_is_sensed_as_it_is(make):
    for o, true in zip(watched(make(), 0.05), watched(make(ForceBias((9.0, 0, 0), start=1.0)), 0.05), strict=True):
        np.testing.assert_array_equal(o.wrist.vector, true.wrist.vector)
        np.testing.assert_array_equal(o.q, true.q)


def test_noise_has_its_deviation_and_is_the_same_for_the_same_seed(make):
    true = wrists(watched(make(), 0.6))
    first = wrists(watched(make(ForceNoise(0.3, 0.02, seed=1)), 0.6))
    again = wrists(watched(make(ForceNoise(0.3, 0.02, seed=1)), 0.6))
    other = wrists(watched(make(ForceNoise(0.3, 0.02, seed=2)), 0.6))
    error = first - true
    assert np.std(error[:, :3]) == pytest.approx(0.3, rel=0.1)
    assert np.std(error[:, 3:]) == pytest.approx(0.02, rel=0.1)
    assert abs(np.mean(error[:, :3])) < 0.03
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1


def test_asked_twice_between_two_steps_a_noisy_sensor_says_the_same(make):
    plant = make(ForceNoise(1.0))
    assert plant.observe() is plant.observe()
    before = plant.observe()
    plant.step()
    assert plant.observe() is not before


def test_a_bias_holds_between_its_start_and_its_end(make):
    true = wrists(watched(make(), 0.03))
    seen = wrists(watched(make(ForceBias((0.5, 0, -1.0), (0, 0.1, 0), start=0.01, end=0.02)), 0.03))
    expected = np.zeros((30, 6))
    expected[10:20] = [0.5, 0, -1.0, 0, 0.1, 0]
    np.testing.assert_allclose(seen - true, expected, atol=1e-12)


def test_a_late_force_sensor_tells_what_was_felt_4_ms_ago(make):
    shaken = Push((0.0, 30.0, 0.0), start=0.01, end=0.03)
    true = wrists(watched(make(shaken), 0.05))
    late = wrists(watched(make(shaken, ForceDelay(0.004)), 0.05))
    np.testing.assert_array_equal(late[4:], true[:-4])
    np.testing.assert_array_equal(late[:4], np.repeat(true[:1], 4, axis=0))
    assert np.abs(late[11:14] - true[11:14]).max() > 1.0


def test_a_frozen_force_sensor_keeps_to_its_last_word_and_thaws(make):
    fall = Push((0.0, 30.0, 0.0))
    true = wrists(watched(make(fall), 0.04))
    frozen = wrists(watched(make(fall, ForceFrozen(start=0.01, end=0.03)), 0.04))
    assert np.all(frozen[10:30] == true[10])
    np.testing.assert_array_equal(frozen[30:], true[30:])


def test_a_missing_force_is_not_a_number_and_nothing_else_is_lost(make):
    o = watched(make(ForceMissing()), 0.002)[-1]
    assert np.all(np.isnan(o.wrist.vector))
    assert np.all(np.isfinite(o.q))


def test_late_joints_are_where_they_were(make):
    pushed = Push((0.0, 60.0, 0.0))
    true = watched(make(pushed), 0.04)
    late = watched(make(pushed, JointDelay(0.004)), 0.04)
    for now, then in zip(late[4:], true, strict=False):
        np.testing.assert_array_equal(now.q, then.q)
        np.testing.assert_array_equal(now.v, then.v)
    assert late[-1].q[0] != true[-1].q[0]


def test_poses_may_be_noisy_late_or_missing_each_for_some_bodies_only(make):
    true = watched(make(), 0.05)
    faults = (PoseNoise(0.01, 0.02, frozenset({"stone"})), PoseDelay(0.02, frozenset({"feather"})))
    seen = watched(make(*faults), 0.05)
    pairs = zip(seen, true, strict=True)
    noise = np.array([o.poses["stone"].translation - t.poses["stone"].translation for o, t in pairs])
    assert np.std(noise) == pytest.approx(0.01, rel=0.3)
    for o, then in zip(seen[20:], true, strict=False):
        np.testing.assert_array_equal(o.poses["feather"].translation, then.poses["feather"].translation)
        np.testing.assert_array_equal(o.velocities["feather"], then.velocities["feather"])
    gone = watched(make(PoseMissing(frozenset({"stone"}), start=0.01)), 0.02)
    assert "stone" in gone[0].poses
    assert set(gone[-1].poses) == set(gone[-1].velocities) == {"feather"}


def test_late_and_missing_poses_tell_for_how_long_they_hide_what_is_moved_now(make):
    plant = make(PoseDelay(0.3, start=0.01, end=1.0))
    assert plant.hides_poses_for() == 0.0
    watched(plant, 0.02)
    assert plant.hides_poses_for() == pytest.approx(0.3)
    plant.suffer(PoseMissing(start=0.0, end=0.5))
    assert plant.hides_poses_for() == pytest.approx(0.48)
    plant.suffer(PoseNoise(0.01))
    plant.suffer(PoseMissing())
    assert plant.hides_poses_for() == np.inf


def test_a_joint_with_friction_sticks_below_it_and_slides_above(make):
    twist = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.8])
    rubbing = JointFriction((1.0,) * 7)
    stuck = watched(make(rubbing), 0.02, twist)[-1]
    assert abs(stuck.v[6]) < 1e-6
    free = watched(make(), 0.02, twist)
    sliding = watched(make(rubbing), 0.02, 2.25 * twist)
    # 1.8 Nm less 1 Nm of friction drive as 0.8 Nm do.
    assert sliding[-1].v[6] == pytest.approx(free[-1].v[6], rel=0.05)


def test_friction_in_the_joints_is_not_felt_at_the_wrist_and_ends_with_its_fault(make):
    plain = wrists(watched(make(), 0.1))
    rubbing = make(JointFriction((1.0,) * 7, end=0.1))
    np.testing.assert_allclose(wrists(watched(rubbing, 0.1))[1:], plain[1:], atol=0.02)
    afterwards = watched(rubbing, 0.1, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5]))
    assert afterwards[-1].v[6] > 1.0


def test_what_rubs_at_the_same_time_adds_up_and_the_rest_goes_on_rubbing(make):
    twist = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.5])
    both = watched(make(JointFriction((1.0,) * 7, end=0.02), JointFriction((1.0,) * 7)), 0.04, twist)
    assert abs(both[19].v[6]) < 1e-6
    one = watched(make(JointFriction((1.0,) * 7)), 0.02, twist)
    assert both[-1].v[6] == pytest.approx(one[-1].v[6], rel=0.1)


def test_an_arm_heavier_than_its_model_sags_and_its_hand_weighs_more(make):
    locked = JointFriction((500.0,) * 7, end=0.02)
    plain, heavy = make(locked), make(locked)
    heavy._plant.scale_masses(1.2)
    before, after = watched(plain, 0.06), watched(heavy, 0.06)
    np.testing.assert_allclose(after[18].wrist.vector, 1.2 * before[18].wrist.vector, atol=0.05)
    assert after[-1].q[1] - before[-1].q[1] > 5e-4


def test_a_push_on_the_elbow_turns_the_shoulder(make):
    assert abs(watched(make(Push((0.0, 40.0, 0.0), "link_4")), 0.1)[-1].v[0]) > 0.1
    with pytest.raises(ValueError, match="no moving link 'tail'"):
        watched(make(Push((0.0, 40.0, 0.0), "tail")), 0.01)


def test_what_is_no_fault_of_sensors_or_world_is_refused(make):
    with pytest.raises(TypeError, match="neither a fault of sensors, of commands nor of the world"):
        make(Fault())


def test_faults_are_plain_values():
    assert ForceNoise(0.3) == ForceNoise(0.3)
    assert replace(ForceBias((1.0, 0.0, 0.0)), start=2.0).holds_at(2.0)
    assert not ForceBias((1.0, 0.0, 0.0), start=2.0).holds_at(1.999)


def test_a_moved_body_lies_elsewhere_and_what_is_taken_is_gone_until_it_is_brought(make):
    there = SE3(np.eye(3), np.array([0.5, 0.3, 2.0]))
    plant = make(
        Moved("stone", there, start=0.01),
        TakenAway("feather", start=0.01),
        Brought("feather", there * SE3(np.eye(3), np.array([0.0, 0.0, 1.0])), start=0.02),
    )
    seen = watched(plant, 0.03)
    np.testing.assert_allclose(seen[11].poses["stone"].translation, there.translation, atol=1e-4)
    assert [index for index, o in enumerate(seen) if "feather" not in o.poses] == list(range(11, 21))
    np.testing.assert_allclose(seen[21].poses["feather"].translation, [0.5, 0.3, 3.0], atol=1e-4)


def test_a_deed_is_done_once_however_long_its_fault_holds(make):
    plant = make(Moved("stone", SE3(np.eye(3), np.array([0.5, 0.3, 2.0]))))
    assert watched(plant, 0.3)[-1].poses["stone"].translation[2] < 1.9


def test_a_weak_grip_lets_the_fingers_be_pushed(make):
    strong = watched(make(), 0.02)[-1].grip_force
    assert strong == pytest.approx(watched(make(WeakGrip(0.5, start=1.0)), 0.02)[-1].grip_force)
    plant = make(WeakGrip(0.5))
    for _ in range(400):
        plant.apply(Command(np.zeros(7), GripCommand(-0.1, 80.0)))
        plant.step()
    assert plant.observe().grip_force < 1.0


def test_pads_that_turned_slippery_are_themselves_again_afterwards(make):
    plant = make(SlipperyPads(0.01, start=0.01, end=0.02))
    found = [pad_friction(plant)]
    for until in (0.015, 0.03):
        watched(plant, until - plant.observe().t)
        found.append(pad_friction(plant))
    assert found == [1.2, 0.01, 1.2]


def pad_friction(plant):
    engine = plant._plant
    (friction,) = {
        pybullet.getDynamicsInfo(engine._robot, finger, physicsClientId=engine._client)[1]
        for finger in engine._finger_joints
    }
    return friction


def test_a_late_pose_says_when_it_was_true(make):
    seen = watched(make(PoseDelay(0.02)), 0.05)
    assert seen[40].seen_at == {"stone": pytest.approx(0.02), "feather": pytest.approx(0.02)}


def test_a_shifted_bin_takes_along_what_lies_in_it():
    region = Region("bin", "bin", (0.3, 0.3, 0.12), 0.01, SE3(np.eye(3), np.array([0.0, 0.7, 0.06])), 0.5)
    body = Body("egg", Box((0.04, 0.04, 0.04)), 0.1, 0.5, (1.0, 0, 0, 1.0), SE3(np.eye(3), np.array([0.0, 0.7, 0.031])))
    table = Table((0.8, 0.6, 0.05), SE3(np.eye(3), np.array([0.62, 0.0, 0.025])), 0.3)
    robot = RobotModel()
    placed = RobotPlacement(robot.name, SE3.Identity(), HOME)
    scenario = Scenario("bin", 0, placed, table, {"bin": region}, {}, {"egg": body}, "")
    plant = DisturbedPlant(BulletPlant(scenario, robot), [BinShifted("bin", (0.05, 0.0, 0.0), start=0.1)])
    seen = watched(plant, 0.3)
    assert not seen[50].regions
    np.testing.assert_allclose(seen[-1].regions["bin"].translation, [0.05, 0.7, 0.06])
    np.testing.assert_allclose(seen[-1].poses["egg"].translation, [0.05, 0.7, 0.03], atol=2e-3)
    plant.close()
