import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pinocchio import SE3

from scenarios.scenario import Body
from scenarios.shapes import Box
from sim.disturbance import DisturbedPlant
from sim.plant import GripCommand
from sim.robot_faults import Push
from sim.sensor_faults import ForceFrozen
from skills.control.bracing import Brace
from skills.control.dynamics import Dynamics
from skills.control.reference import Reference
from skills.control.safety import SafetyLimits

PERIOD = 0.002
STILL = np.zeros(7)
NOWHERE = np.zeros(6)
HOME = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])
SPEEDS = arrays(float, 7, elements=st.floats(-0.2, 0.2))


@pytest.fixture
def brace(robot):
    return Brace(robot, SafetyLimits(speed=2.5).collision, PERIOD)


def block(at, mass=0.0):
    """Something that gives way to nothing."""
    return Body("block", Box((0.06, 0.2, 0.1)), mass, 0.5, (1.0, 0.0, 0.0, 1.0), SE3(np.eye(3), np.array(at)))


def hardest(rig):
    """Watches the largest force in N between the arm and the block."""

    def look(_):
        forces = [c.normal_force for c in rig.plant.contacts() if "block" in (c.first, c.second)]
        return sum(forces)

    return look


@pytest.mark.parametrize("link", [None, "link_7", "link_6", "link_4"])
@pytest.mark.parametrize("posture", range(3))
@pytest.mark.parametrize("angle", [0.0, 1.6, 3.1, 4.7])
def test_a_level_push_of_100_n_moves_the_hand_by_millimetres(lab, link, posture, angle):
    rig = lab.rig(lab.postures[posture])
    force = (100.0 * np.cos(angle), 100.0 * np.sin(angle), 0.0)
    rig.plant = DisturbedPlant(rig.plant, [Push(force, link, start=0.3, end=0.4)])
    start = rig.position
    away = rig.run(0.9, lambda o: np.linalg.norm(rig.robot.X_WG(o.q).translation - start))
    assert max(away) < 0.008
    assert away[-1] < 0.002


@pytest.mark.parametrize("gap", [0.003, 0.005, 0.01])
@pytest.mark.parametrize("link", [None, "link_7"])
def test_a_hand_that_is_pushed_beside_something_hard_strikes_it_with_less_than_60_n(lab, gap, link):
    q0 = lab.ik(lab.down(0.6, 0.0, 0.03), lab.home)
    rig = lab.rig(q0, (block([0.6 + 0.01 + gap + 0.03, 0.0, lab.table_top + 0.05]),))
    rig.plant = DisturbedPlant(rig.plant, [Push((100.0, 0.0, 0.0), link, start=0.3, end=0.4)])
    assert max(rig.run(0.9, hardest(rig))) < 60.0


def test_what_the_hand_runs_into_is_not_pressed_against(lab):
    q0 = lab.ik(lab.down(0.55, 0.0, 0.03), lab.home)
    rig = lab.rig(q0, (block([0.65, 0.0, lab.table_top + 0.05]),))
    rig.controller.follow(Reference(lab.straight(q0, [0.15, 0.0, 0.0], 0.15)))
    forces = rig.run(2.0, hardest(rig))
    assert rig.controller.stopped is not None
    assert 20.0 < max(forces) < 60.0
    assert forces[-1] < 10.0


@given(SPEEDS)
def test_what_gives_back_no_more_than_it_took_is_not_borne(robot, v):
    brace, dynamics = Brace(robot, SafetyLimits(speed=2.5).collision, PERIOD), Dynamics(robot)
    for speed in (v, 0.5 * v, -0.3 * v, -0.3 * v):
        state = dynamics.state(HOME, speed)
        against = -40.0 * v / max(np.linalg.norm(v), 1e-9)
        assert not brace.bear(state, NOWHERE, against, (HOME, v)).any()


@given(SPEEDS, arrays(float, 6, elements=st.floats(-60.0, 60.0)))
def test_what_is_done_against_a_push_never_drives_the_arm(robot, v, wrench):
    brace, dynamics = Brace(robot, SafetyLimits(speed=2.5).collision, PERIOD), Dynamics(robot)
    for _ in range(20):
        torque = brace.bear(dynamics.state(HOME, v), wrench, STILL, (HOME, STILL))
        assert float(torque @ v) <= 1e-9


def test_a_push_is_borne_as_a_whole_once_it_has_done_work(robot, brace):
    dynamics = Dynamics(robot)
    push = np.array([60.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    along = np.linalg.pinv(dynamics.state(HOME, STILL).J) @ push / 600.0
    state = dynamics.state(HOME, along)
    borne = [brace.bear(state, push, STILL, (HOME - 0.1 * along, along)) for _ in range(3)]
    assert not borne[0].any()
    np.testing.assert_allclose(borne[-1], -state.J.T @ push, atol=0.05)


def test_what_turns_round_is_an_echo_of_the_arms_own_torques_and_is_left_alone(robot, brace):
    dynamics = Dynamics(robot)
    outside = np.array([20.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    v = np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    borne = [brace.bear(dynamics.state(HOME, v), NOWHERE, outside, (HOME, STILL)) for _ in range(3)]
    assert borne[-1].any()
    brace.bear(dynamics.state(HOME, -v), NOWHERE, -outside, (HOME, STILL))
    assert not brace.bear(dynamics.state(HOME, v), NOWHERE, outside, (HOME, STILL)).any()
    assert brace.is_struck


def test_what_is_borne_may_not_double_within_10_ms(robot, brace):
    dynamics = Dynamics(robot)
    v = np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    state = dynamics.state(HOME, v)

    def borne(size):
        outside = np.array([size, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        return -brace.bear(state, NOWHERE, outside, (HOME - 0.1 * v, v))[0]

    for _ in range(5):
        before = borne(10.0)
    after = [borne(100.0) for _ in range(5)][-1]
    assert before == pytest.approx(10.0)
    assert 10.0 < after < 20.0


def test_what_comes_from_across_is_no_part_of_a_push(robot, brace):
    dynamics = Dynamics(robot)
    push, wall = np.array([40.0, 0.0, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, -40.0, 0.0, 0.0, 0.0, 0.0])
    along = np.linalg.pinv(dynamics.state(HOME, STILL).J) @ push / 100.0
    state, course = dynamics.state(HOME, along), (HOME - 0.1 * along, along)
    alone = [brace.bear(state, push, STILL, course) for _ in range(4)][-1]
    with_wall = brace.bear(state, push + wall, STILL, course)
    np.testing.assert_allclose(with_wall, alone, atol=0.05)


def test_what_rubbed_for_long_before_leaves_a_push_no_less_active(robot, brace):
    dynamics = Dynamics(robot)
    rubbing = np.array([-20.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    along = np.linalg.pinv(dynamics.state(HOME, STILL).J) @ rubbing / -100.0
    moving, driven = dynamics.state(HOME, along), dynamics.state(HOME, -2.0 * along)
    for _ in range(2000):
        assert not brace.bear(moving, rubbing, STILL, (HOME, along)).any()
    borne = [brace.bear(driven, 3.0 * rubbing, STILL, (HOME, STILL)).any() for _ in range(10)]
    assert borne[-1]


@pytest.mark.parametrize("posture", range(3))
@pytest.mark.parametrize("newtons", [25.0, 40.0, 60.0, 100.0])
def test_a_steady_push_is_borne_without_chatter(lab, posture, newtons):
    rig = lab.rig(lab.postures[posture])
    rig.run(0.3)
    rig.push = np.array([0.0, newtons, 0.0])
    rig.run(0.5)
    steps = lab.steps(rig)
    rig.run(0.3, steps)
    assert steps.largest < 1.0


def test_fingers_that_close_off_centre_on_something_fixed_push_the_hand_and_nobody_else_does(lab):
    q0 = lab.ik(lab.down(0.6, 0.01, 0.03), lab.home)
    thin = Body("block", Box((0.06, 0.03, 0.1)), 0.0, 0.5, (1.0,) * 4, SE3(np.eye(3), np.array([0.6, 0.0, 0.1])))
    rig = lab.rig(q0, (thin,), GripCommand(-0.1, 40.0))
    rig.run(1.5)
    assert rig.controller.stopped is None
    assert abs(rig.position[1]) < 0.004


def test_a_wrist_that_freezes_under_a_push_leaves_no_phantom(lab):
    rig = lab.rig(lab.home)
    rig.plant = DisturbedPlant(rig.plant, [Push((0.0, 60.0, 0.0), start=0.3, end=0.5), ForceFrozen(start=0.35)])
    rig.run(1.0)
    rig.controller.acknowledge()
    start = rig.position
    rig.run(1.0)
    assert np.linalg.norm(rig.position - start) < 0.02
    assert not rig.controller.is_struck


def test_ordinary_work_is_no_push(lab):
    rig = lab.rig(lab.home)
    there = Reference(lab.straight(lab.home, [0.05, 0.2, 0.05], 0.5))
    struck = rig.follow(there, lambda _: rig.controller.is_struck)
    assert not any(struck)
