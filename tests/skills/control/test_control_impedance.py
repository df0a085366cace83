import numpy as np
import pytest

from planner.motion.trajectory import Trajectory
from skills.control.dynamics import Dynamics
from skills.control.reference import Reference
from skills.control.state import Target
from skills.control.tasks import pose_error

PUSH = 10.0


def damping_ratio(x, period):
    """Of the oscillator ẍ + 2 ζ ω ẋ + ω² x = 0 that a free response x (n,) obeys best."""
    speed = (x[2:] - x[:-2]) / (2 * period)
    acceleration = (x[2:] - 2 * x[1:-1] + x[:-2]) / period**2
    (damping, spring), *_ = np.linalg.lstsq(np.column_stack([-speed, -x[1:-1]]), acceleration, rcond=None)
    return damping / (2 * np.sqrt(spring))


@pytest.mark.parametrize("posture", [0, 1, 2])
def test_10_newtons_displace_the_tool_by_force_over_stiffness_and_it_returns_critically_damped(lab, posture):
    q0 = lab.postures[posture]
    rig = lab.rig(q0)
    rig.controller.follow(Reference(Trajectory.standstill(q0), "impedance", lab.stiffness))
    rig.run(0.1)
    rest = Dynamics(lab.robot).state(rig.q, np.zeros(7))
    home = Target(rest.p, rest.R, np.zeros(6), np.zeros(6))

    direction = np.array([0.6, 0.6, np.sqrt(0.28)])
    rig.push = PUSH * direction
    rig.run(1.0)
    moved = rig.position - rest.p
    expected = rig.push / lab.stiffness[:3]
    assert np.linalg.norm(moved - expected) < 0.05 * np.linalg.norm(expected)
    np.testing.assert_allclose(moved, expected, rtol=0.05)

    rig.push = None
    root = np.sqrt(lab.stiffness)
    squares, modes = np.linalg.eigh(root[:, None] * rest.mobility * root)
    dynamics = Dynamics(lab.robot)
    response = rig.run(0.4, lambda o: modes.T @ (root * pose_error(home, dynamics.state(o.q, o.v))))
    response = np.array(response)[1:]
    frequencies = np.sqrt(squares)
    for mode in range(6):
        if abs(response[0, mode]) > 0.3 * np.abs(response[0]).max():
            span = min(len(response), int(6.0 / frequencies[mode] / lab.period))
            ratio = damping_ratio(response[:span, mode], lab.period)
            assert ratio == pytest.approx(1.0, abs=0.1), f"mode {mode} of posture {posture}"
    assert rig.controller.fallbacks == 0
    assert rig.controller.torque_limit_violations == 0


def test_pressing_by_impedance_shifts_the_set_point_below_the_surface(lab):
    rig = lab.gripped_sponge(0.6, 0.0, 0.02)
    down = lab.straight(rig.q, [0.0, 0.0, -0.03], 0.06)
    rig.follow(Reference(down, "impedance", lab.stiffness, 10.0, until_contact=True))
    assert rig.controller.contact
    slide = lab.straight(rig.q, [0.0, 0.06, 0.0], 0.1)
    forces = rig.follow(Reference(slide, "impedance", lab.stiffness, 10.0), lambda _: rig.pressed_on_table("sponge"))
    assert np.mean(forces) == pytest.approx(10.0, rel=0.05)
    assert np.sqrt(np.mean((np.array(forces) - 10.0) ** 2)) < 1.0
    assert not rig.controller.contact_lost
