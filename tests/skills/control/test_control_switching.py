import numpy as np
import pytest

from planner.motion.passing import passing
from planner.motion.trajectory import Trajectory
from skills.control.reference import Reference

LARGEST_STEP = 5.0
"""Nm, from one tick to the next."""


def test_changing_modes_and_loads_in_full_motion_makes_no_torque_step(lab):
    rng = np.random.default_rng(0)
    rig = lab.rig(lab.home)
    rig.run(0.01)
    steps = lab.steps(rig)
    for change in range(16):
        path = lab.straight(rig.q, rng.uniform(-0.12, 0.12, 3), 0.3)
        mode = change % 4
        if mode == 0:
            rig.controller.follow(Reference(path))
        elif mode == 1:
            rig.controller.follow(Reference(path, "impedance", lab.stiffness))
        elif mode == 2:
            rig.controller.hold()
        elif change % 8 == 3:
            rig.controller.set_payload(0.4, np.array([0.0, 0.0, 0.02]), 1e-3 * np.eye(3))
        else:
            rig.controller.clear_payload()
        rig.run(rng.uniform(0.02, 0.2), steps)
    assert steps.largest < LARGEST_STEP
    assert rig.controller.fallbacks == 0
    assert rig.controller.torque_limit_violations == 0


def test_changing_modes_in_contact_makes_no_torque_step(lab):
    rng = np.random.default_rng(1)
    rig = lab.gripped_sponge(0.6, 0.0, 0.01)
    steps = lab.steps(rig)

    def somewhere():
        return lab.straight(rig.q, [*rng.uniform(-0.06, 0.06, 2), 0.0], 0.1)

    lower = lab.straight(rig.q, [0.0, 0.0, -0.02], 0.04)
    touch = Reference(lower, "hybrid", force=10.0, until_contact=True)
    rig.follow(touch, steps)
    changes = {
        "force": lambda: rig.controller.follow(Reference(somewhere(), "hybrid", force=20.0)),
        "spring": lambda: rig.controller.follow(Reference(somewhere(), "impedance", lab.stiffness, 5.0)),
        "position": lambda: rig.controller.follow(Reference(somewhere())),
        "hold": rig.controller.hold,
    }
    for before in changes:
        for after in changes:
            for change in (before, after):
                changes[change]()
                rig.run(rng.uniform(0.02, 0.12), steps)
            assert steps.largest < LARGEST_STEP, f"from {before} to {after}"


def test_holding_in_motion_stops_softly_and_stays(lab):
    rig = lab.rig(lab.home)
    rig.controller.follow(Reference(lab.straight(lab.home, [0.0, 0.3, 0.0], 0.4)))
    rig.run(0.5)
    rig.controller.hold()
    speeds = rig.run(0.5, lambda o: np.abs(o.v).max())
    stopped = rig.q
    for _ in range(20):
        rig.controller.hold()
        rig.run(0.02)
    assert max(speeds) < 1.05 * speeds[0]
    assert speeds[-1] < 0.01
    assert rig.controller.reference is None
    assert rig.controller.finished
    np.testing.assert_allclose(rig.q, stopped, atol=1e-3)


def test_position_mode_tracks_a_fast_line_within_a_millimetre(lab):
    rig = lab.rig(lab.home)
    line = lab.straight(lab.home, [0.05, 0.3, -0.05], 0.25)
    errors = rig.follow(Reference(line), lambda _: rig.controller.tracking_error.position)
    assert rig.controller.finished
    assert max(errors) < 1e-3
    assert rig.controller.tracking_error.joint < 1e-3


def test_a_reference_that_starts_elsewhere_is_joined(lab):
    rig = lab.rig(lab.home)
    rig.run(0.02)
    elsewhere = lab.home + 0.1
    rig.follow(Reference(Trajectory.standstill(elsewhere)))
    assert rig.controller.finished
    np.testing.assert_allclose(rig.q, elsewhere, atol=5e-3)


def test_a_loaded_arm_that_knows_its_load_does_not_sag(lab):
    rig = lab.rig(lab.home)
    rig.run(0.1)
    before = rig.position
    rig.push = np.array([0.0, 0.0, -0.4 * 9.81])
    rig.controller.set_payload(0.4, np.zeros(3), 1e-6 * np.eye(3))
    rig.run(0.4)
    assert np.linalg.norm(rig.position - before) < 5e-5
    rig.controller.clear_payload()
    rig.run(0.4)
    assert np.linalg.norm(rig.position - before) > 2e-4


def test_the_same_run_gives_the_same_torques_to_the_last_bit(lab):
    def run():
        rig = lab.rig(lab.home)
        rig.controller.follow(Reference(lab.straight(lab.home, [0.0, 0.1, 0.0], 0.3), "impedance", lab.stiffness))
        rig.push = np.array([5.0, 0.0, 3.0])
        return np.array(rig.run(0.2, lambda _: rig.tau.copy()))

    np.testing.assert_array_equal(run(), run())


def test_the_arm_passes_from_one_motion_into_the_next_without_a_stop(lab):
    rig = lab.rig(lab.home)
    rig.run(0.01)
    first = lab.straight(rig.q, [0.12, 0.0, 0.0], 0.3)
    second = lab.straight(first.end, [0.0, 0.12, 0.0], 0.3)
    head, entry = passing(first, second, 0.3 * min(first.duration, second.duration))
    steps = lab.steps(rig)
    rig.controller.follow(Reference(head, then=entry))
    while not rig.controller.passed:
        rig.run(0.002, steps)
    assert not rig.controller.finished
    # The tree comes to look a little later.
    rig.run(0.016, steps)
    assert np.linalg.norm(rig.plant.observe().v) > 0.05
    late = rig.controller.time_in_reference
    rig.controller.follow(Reference(entry))
    tau = rig.tau.copy()
    rig.run(0.002, steps)
    assert np.abs(rig.tau - tau).max() < 0.5
    assert rig.controller.time_in_reference == pytest.approx(late - head.duration + 0.002)
    off = rig.run(entry.duration, lambda seen: steps(seen) or rig.controller.tracking_error.joint)
    assert steps.largest < LARGEST_STEP
    assert max(off) < 2e-3
    assert rig.controller.finished
    np.testing.assert_allclose(rig.q, second.end, atol=2e-3)


def test_a_motion_that_passes_into_another_can_be_stopped_in_between(lab):
    rig = lab.rig(lab.home)
    rig.run(0.01)
    first = lab.straight(rig.q, [0.12, 0.0, 0.0], 0.3)
    head, entry = passing(first, lab.straight(first.end, [0.0, 0.12, 0.0], 0.3), 0.2)
    rig.controller.follow(Reference(head, then=entry))
    rig.run(head.duration + 0.01)
    rig.controller.hold()
    rig.run(0.6)
    assert rig.controller.finished
    assert rig.controller.reference is None
    assert np.abs(rig.q - entry.start).max() < 0.2
