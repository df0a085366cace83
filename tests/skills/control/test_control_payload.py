import numpy as np
import pinocchio as pin
import pytest
from pinocchio import SE3

from scenarios.scenario import Body
from scenarios.shapes import Box
from sim.plant import GripCommand, Observation
from sim.wrench import Wrench
from skills.control.contact import hand_inertia
from skills.control.payload import estimate_payload
from skills.control.reference import Reference


def reading(robot, q, mass, com, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    total = hand_inertia(robot) + pin.Inertia(mass, com, np.zeros((3, 3)))
    weight = robot.X_WG(q).rotation.T @ np.array([0.0, 0.0, -9.81])
    felt = robot.X_EG.act(total * pin.Motion(weight, np.zeros(3))).vector + noise * rng.normal(size=6)
    zero = np.zeros(7)
    return Observation(0.0, q, zero, zero, 0.05, 0.0, 0.0, Wrench(felt[:3], felt[3:]), {}, {})


POSES = (
    np.full(7, 0.3),
    np.array([0.0, 0.5, 0.0, -1.2, 0.4, 1.0, 0.0]),
    np.array([0.3, 0.2, 0.1, -1.0, 0.0, 0.2, 1.0]),
)


def test_mass_and_centre_are_found_from_three_orientations(robot):
    com = np.array([0.01, -0.02, 0.03])
    mass, found = estimate_payload(robot, [reading(robot, q, 0.4, com) for q in POSES])
    assert mass == pytest.approx(0.4, abs=1e-3)
    np.testing.assert_allclose(found, com, atol=1e-3)


def test_one_reading_gives_the_mass_and_the_line_of_action(robot):
    com = np.array([0.01, -0.02, 0.03])
    mass, found = estimate_payload(robot, [reading(robot, POSES[0], 0.4, com)])
    down = robot.X_WG(POSES[0]).rotation.T @ np.array([0.0, 0.0, -1.0])
    assert mass == pytest.approx(0.4, abs=1e-3)
    assert np.linalg.norm(np.cross(down, found - com)) < 2e-3


def test_noise_of_a_real_sensor_shifts_little(robot):
    com = np.array([0.0, 0.02, 0.02])
    readings = [reading(robot, q, 0.4, com, 0.05, seed) for seed, q in enumerate(POSES * 5)]
    mass, found = estimate_payload(robot, readings)
    assert mass == pytest.approx(0.4, abs=0.01)
    np.testing.assert_allclose(found, com, atol=0.02)


def test_an_empty_hand_weighs_nothing_and_never_less(robot):
    mass, com = estimate_payload(
        robot, [reading(robot, q, 0.0, np.zeros(3), 0.05, seed) for seed, q in enumerate(POSES * 5)]
    )
    assert 0.0 <= mass < 0.02
    assert np.all(np.isfinite(com))


def test_no_reading_is_an_error(robot):
    with pytest.raises(ValueError, match="at least one wrist reading"):
        estimate_payload(robot, [])


def test_a_lifted_box_is_weighed(lab):
    box = Body(
        "box", Box((0.04, 0.06, 0.06)), 0.3, 0.6, (1.0, 0.0, 0.0, 1.0), SE3(np.eye(3), np.array([0.6, 0.0, 0.08]))
    )
    q0 = lab.ik(lab.down(0.6, 0.0, 0.03), lab.home)
    rig = lab.rig(q0, (box,), GripCommand(-0.1, 40.0))
    rig.run(0.4)
    rig.follow(Reference(lab.straight(q0, [0.0, 0.0, 0.05], 0.2)))
    rig.run(0.3)
    mass, _ = estimate_payload(lab.robot, rig.run(0.02, lambda o: o))
    # Only the mass: the simulated sensor does not feel how the pads resist turning (PAD_RESISTANCE in sim/bullet.py).
    assert mass == pytest.approx(0.3, rel=0.02)
