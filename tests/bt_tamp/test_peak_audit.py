"""The largest true force: of the arm and what it holds, not of what falls from the hand."""

from dataclasses import replace

import numpy as np
import pytest

from bt_tamp.executive.peak_audit import PeakAudit
from scenarios.load import load_scenario
from sim.bullet import BulletPlant
from sim.contact import Contact
from sim.robot import RobotModel


@pytest.fixture(scope="module")
def seen():
    scenario = load_scenario("fig1", 0)
    robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
    plant = BulletPlant(scenario, robot)
    yield robot, plant.observe()
    plant.close()


def touch(first, second, newtons):
    """One contact with a vertical force on the first."""
    up, x, y = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    return Contact(first, second, (0, 0, 0, 0, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), up, 0.0, newtons, 0.0, x, 0.0, y))


def peak(robot, contacts, truth, held=None):
    audit = PeakAudit(robot)
    audit.look(contacts, truth, held)
    return audit.peak


def falling(truth, name, speed):
    V_WO = np.array([0.0, 0.0, -speed, 0.0, 0.0, 0.0])
    return replace(truth, velocities={**truth.velocities, name: V_WO})


def test_what_the_arm_meets_counts_and_what_others_meet_does_not(seen):
    robot, truth = seen
    assert peak(robot, [touch("table", "box", 300.0), touch("link_5", "box", 12.0)], truth) == pytest.approx(12.0)


def test_what_both_fingers_squeeze_pushes_back_as_much_on_one_as_on_the_other(seen):
    robot, truth = seen
    squeezed = [touch("finger_left", "box", 70.0), touch("box", "finger_right", 70.0)]
    assert peak(robot, squeezed, truth) == pytest.approx(0.0)


def test_what_the_held_body_meets_counts_while_it_moves_with_the_hand(seen):
    robot, truth = seen
    landing = [touch("table", "box", 300.0)]
    assert peak(robot, landing, truth, held="box") == pytest.approx(300.0)
    assert peak(robot, landing, falling(truth, "box", 0.1), held="box") == pytest.approx(300.0)


def test_what_falls_from_the_hand_lands_for_itself_even_while_it_is_still_believed_held(seen):
    robot, truth = seen
    audit, falls = PeakAudit(robot), falling(truth, "box", 0.5)
    audit.look([], falls, "box")
    contacts = [touch("table", "box", 300.0), touch("finger_left", "box", 20.0)]
    audit.look(contacts, replace(falls, t=truth.t + 0.03), "box")
    assert audit.peak == pytest.approx(20.0)


def test_a_blow_that_tears_what_is_held_from_the_hand_counts(seen):
    robot, truth = seen
    audit, torn = PeakAudit(robot), falling(truth, "box", 0.5)
    audit.look([], truth, "box")
    audit.look([touch("table", "box", 300.0)], replace(torn, t=truth.t + 0.01), "box")
    assert audit.peak == pytest.approx(300.0)


@pytest.mark.parametrize(("after", "counted"), [(0.03, 0.0), (0.2, 300.0)])
def test_what_has_just_fallen_is_not_held_yet_again_as_it_lands(seen, after, counted):
    robot, truth = seen
    audit = PeakAudit(robot)
    audit.look([], falling(truth, "box", 0.5), "box")
    audit.look([touch("table", "box", 300.0)], replace(truth, t=truth.t + after), "box")
    assert audit.peak == pytest.approx(counted)


def test_what_the_hand_swings_along_is_held(seen):
    robot, truth = seen
    v = np.full(7, 0.5)
    X_WG, V_WG = robot.X_WG(truth.q), robot.V_WG(truth.q, v)
    lever = truth.poses["box"].translation - X_WG.translation
    along = np.concatenate([V_WG[:3] + np.cross(V_WG[3:], lever), V_WG[3:]])
    assert np.linalg.norm(along[:3]) > 0.3
    swung = replace(truth, v=v, velocities={**truth.velocities, "box": along})
    assert peak(robot, [touch("link_5", "box", 0.0), touch("table", "box", 50.0)], swung, "box") == pytest.approx(50.0)
