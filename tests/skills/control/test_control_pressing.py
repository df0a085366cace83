import numpy as np
import pytest

from planner.motion.trajectory import Trajectory
from sim.plant import GripCommand
from skills.control.reference import Reference

FORCE = 10.0


def tool_path(rig, start):
    return lambda o: (rig.pressed_on_table("sponge"), *(rig.robot.X_WG(o.q).translation - start))


def test_a_sponge_slides_35_cm_with_10_newtons_on_a_straight_path(lab):
    rig = lab.gripped_sponge(0.6, -0.2, 0.01)
    above = rig.position
    held = rig.robot.X_WG(rig.q).actInv(rig.plant.observe().poses["sponge"])

    lower = lab.straight(rig.q, [0.0, 0.0, -0.02], 0.03)
    touching = rig.follow(
        Reference(lower, "hybrid", force=FORCE, until_contact=True), lambda _: rig.pressed_on_table("sponge"), 2
    )
    assert rig.controller.contact
    assert rig.controller.finished
    assert max(touching) < 1.15 * FORCE

    start = np.array([above[0], above[1], rig.position[2]])
    stroke = lab.straight(lab.ik(lab.down(*start[:2], start[2] - lab.table_top), rig.q), [0.0, 0.35, 0.0], 0.1)
    seen = np.array(rig.follow(Reference(stroke, "hybrid", force=FORCE), tool_path(rig, start), 5))
    forces, sideways, along = seen[:, 0], seen[:, 1], seen[:, 2]

    assert np.mean(forces) == pytest.approx(FORCE, rel=0.01)
    assert np.sqrt(np.mean((forces - FORCE) ** 2)) < 0.02 * FORCE
    assert np.abs(sideways).max() < 1e-3
    assert along[-1] == pytest.approx(0.35, abs=1e-3)
    now = rig.robot.X_WG(rig.q).actInv(rig.plant.observe().poses["sponge"])
    assert np.linalg.norm(now.translation - held.translation) < 1e-3
    assert rig.controller.fallbacks == 0
    assert rig.controller.torque_limit_violations == 0


def test_a_touch_that_finds_nothing_ends_without_contact(lab):
    rig = lab.rig(lab.home)
    lower = lab.straight(lab.home, [0.0, 0.0, -0.03], 0.03)
    rig.follow(Reference(lower, "hybrid", force=FORCE, until_contact=True))
    assert rig.controller.finished
    assert not rig.controller.contact
    assert not rig.controller.contact_lost


def test_contact_lost_at_an_edge_is_noticed_within_50_ms_and_the_arm_holds(lab):
    edge = 0.6
    q0 = lab.ik(lab.down(0.35, edge - 0.05, 0.006), np.radians([60.0, 20.0, 0.0, -90.0, 0.0, 70.0, 60.0]))
    rig = lab.rig(q0, grip=GripCommand(-0.3, 20.0))
    rig.run(0.3)
    rig.controller.tare()
    steps = lab.steps(rig)
    lower = lab.straight(q0, [0.0, 0.0, -0.015], 0.02)
    rig.follow(Reference(lower, "hybrid", force=5.0, until_contact=True), steps)
    assert rig.controller.contact
    assert steps.largest < 5.0
    over_the_edge = lab.straight(rig.q, [0.0, 0.1, 0.0], 0.1)
    rig.controller.follow(Reference(over_the_edge, "hybrid", force=5.0))
    airborne = 0
    for _ in range(1000):
        rig.tick()
        touching = any("table" in (c.first, c.second) for c in rig.plant.contacts())
        airborne = 0 if touching else airborne + 1
        if rig.controller.contact_lost:
            break
    assert rig.controller.contact_lost
    assert airborne * lab.period <= 0.05
    height = rig.position[2]
    rig.run(0.3)
    assert rig.controller.reference is None
    assert rig.controller.finished
    assert height - rig.position[2] < 0.01


def test_a_slide_without_contact_is_lost_at_once(lab):
    rig = lab.rig(lab.home)
    rig.run(0.02)
    rig.controller.follow(Reference(Trajectory.standstill(lab.home, 1.0), "hybrid", force=FORCE))
    rig.run(0.05)
    assert rig.controller.contact_lost
    rig.controller.follow(Reference(Trajectory.standstill(lab.home, 1.0)))
    assert not rig.controller.contact_lost


def test_a_sponge_that_slides_up_between_the_fingers_bears_no_more_and_the_arm_holds_before_they_meet_the_table(lab):
    rig = lab.gripped_sponge(0.6, -0.2, 0.01)
    lower = lab.straight(rig.q, [0.0, 0.0, -0.02], 0.03)
    rig.follow(Reference(lower, "hybrid", force=FORCE, until_contact=True))
    rig.controller.follow(Reference(lab.straight(rig.q, [0.0, 0.3, 0.0], 0.1), "hybrid", force=FORCE))
    rig.run(1.0)
    assert not rig.controller.contact_lost
    height = rig.position[2]
    rig.plant.set_pad_friction(0.002)
    struck = rig.run(0.5, lambda _: any("table" in pair and "sponge" not in pair for pair in rig.touching()))
    assert rig.controller.contact_lost
    assert not any(struck)
    assert height - rig.position[2] < 0.005


@pytest.mark.parametrize("mass", [0.15, 0.3])
def test_a_sponge_that_falls_out_while_it_is_lowered_is_missed_before_the_hand_has_sunk_far(lab, mass):
    rig = lab.gripped_sponge(0.6, -0.2, 0.05, mass)
    lower = lab.straight(rig.q, [0.0, 0.0, -0.06], 0.03)
    rig.controller.follow(Reference(lower, "hybrid", force=FORCE, until_contact=True))
    rig.run(0.3)
    rig.plant.take_away("sponge")
    height = rig.position[2]
    struck = rig.run(2.0, lambda _: any("table" in pair for pair in rig.touching()))
    assert rig.controller.contact_lost
    assert not any(struck)
    assert height - rig.position[2] < 0.015


def test_a_hand_that_touches_harder_than_is_wanted_eases_at_once(lab):
    rig = lab.rig(lab.ik(lab.down(0.6, 0.0, 0.02), lab.home), grip=GripCommand(-0.3, 20.0))
    rig.run(0.5)
    rig.controller.tare()
    lower = lab.straight(rig.q, [0.0, 0.0, -0.03], 0.02)
    rig.controller.follow(Reference(lower, "hybrid", force=5.0, until_contact=True))
    pressed = rig.run(
        3.0, lambda _: sum(c.normal_force for c in rig.plant.contacts() if "table" in (c.first, c.second))
    )
    hardest = int(np.argmax(pressed))
    assert pressed[hardest] > 10.0
    assert max(pressed[hardest + 25 :]) < 7.0
    assert pressed[-1] == pytest.approx(5.0, abs=0.1)
