"""What is pressed on, told by the force that is felt along the normal at each tick."""

import numpy as np
import pytest

from planner.motion.trajectory import Trajectory
from skills.control.pressed import PressedContact
from skills.control.reference import Reference

PERIOD, FORCE = 0.002, 10.0
STILL = Trajectory.standstill(np.zeros(7))
SOFT = np.full(6, 500.0)
STROKE = Reference(STILL, "hybrid", force=FORCE)
TOUCH = Reference(STILL, "hybrid", force=FORCE, until_contact=True)
SOFT_TOUCH = Reference(STILL, "impedance", stiffness=SOFT, force=FORCE, until_contact=True)


def feel(contact, reference, felt, seconds, weight=0.0):
    """Feel that for a while, and regulate by it: what became of the contact, and after how many seconds."""
    for n in range(round(seconds / PERIOD)):
        change = contact.look(reference, felt, weight)
        if change is not None:
            return change, (n + 1) * PERIOD
        contact.loop.update(felt)
    return None, seconds


@pytest.fixture
def contact():
    return PressedContact(PERIOD)


@pytest.fixture
def pressed(contact):
    """Pressed with all its force, and settled."""
    contact.begin(STROKE, FORCE, 0.0)
    assert feel(contact, STROKE, FORCE, 0.5) == (None, 0.5)
    return contact


def test_what_is_lowered_has_touched_once_a_force_is_there_for_a_moment(contact):
    assert feel(contact, TOUCH, 0.5, 0.1)[0] is None
    change, after = feel(contact, TOUCH, 3.0, 0.1)
    assert change == "touched"
    assert 0.004 <= after <= 0.01


def test_pressing_begins_with_what_is_felt_but_no_harder_than_wanted(contact):
    contact.begin(TOUCH, 3.0, 0.0)
    assert contact.loop.wanted == 3.0
    contact.begin(TOUCH, 25.0, 0.0)
    assert contact.loop.wanted == FORCE
    contact.begin(TOUCH, -2.0, 0.0)
    assert contact.loop.wanted == 0.0


def test_a_force_that_is_regulated_already_goes_on(pressed):
    pressed.begin(Reference(STILL, "hybrid", force=6.0), 3.0, 0.0, keeps_force=True)
    assert pressed.loop.wanted == FORCE


@pytest.mark.parametrize("stroke", [STROKE, Reference(STILL, "impedance", stiffness=SOFT, force=FORCE)])
def test_without_any_contact_a_stroke_is_lost_within_50_ms(contact, stroke):
    contact.begin(stroke, FORCE, 0.0)
    assert feel(contact, stroke, FORCE, 0.5)[0] is None
    change, after = feel(contact, stroke, 0.0, 1.0)
    assert change == "lost"
    assert after <= 0.05


def test_a_moment_without_contact_is_no_loss(pressed):
    assert feel(pressed, STROKE, 0.0, 0.036)[0] is None
    assert feel(pressed, STROKE, FORCE, 1.0)[0] is None
    assert feel(pressed, STROKE, 0.0, 0.036)[0] is None


def test_a_force_that_is_too_small_by_far_is_still_borne(pressed):
    assert feel(pressed, STROKE, 0.25 * FORCE, 1.0)[0] is None


def test_what_only_rubs_between_the_fingers_bears_nothing(pressed):
    change, after = feel(pressed, STROKE, 0.15 * FORCE, 1.0)
    assert change == "lost"
    assert after <= 0.05


def test_a_load_that_is_lost_seems_to_bear_its_weight(pressed):
    assert feel(pressed, STROKE, 5.0, 1.0, weight=3.0)[0] is None
    assert feel(pressed, STROKE, 3.3, 1.0, weight=3.0)[0] == "lost"


def test_however_heavy_a_load_most_of_the_force_is_enough(pressed):
    assert feel(pressed, STROKE, 0.85 * FORCE, 1.0, weight=30.0)[0] is None


@pytest.mark.parametrize(("sideways", "change"), [(0.0, "lost"), (1.0, None)])
def test_a_load_weighs_only_along_the_vertical(contact, sideways, change):
    R_WC = np.eye(3) if not sideways else np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    reference = Reference(STILL, "hybrid", force=FORCE, R_WC=R_WC)
    contact.begin(reference, FORCE, 0.0)
    assert feel(contact, reference, FORCE, 0.5, weight=3.0)[0] is None
    assert feel(contact, reference, 3.0, 1.0, weight=3.0)[0] == change


def test_a_soft_tool_has_time_to_take_the_force_up(contact):
    contact.begin(TOUCH, 8.0, 0.0)
    assert feel(contact, TOUCH, 1.2, 0.08)[0] is None
    assert feel(contact, TOUCH, 1.2, 0.08)[0] == "lost"


def test_a_tool_that_bounces_while_an_impedance_touches_down_is_waited_for(contact):
    assert feel(contact, SOFT_TOUCH, 3.0, 0.1)[0] == "touched"
    contact.begin(SOFT_TOUCH, 3.0, 0.0)
    assert feel(contact, SOFT_TOUCH, 0.0, 0.2)[0] is None
    assert feel(contact, SOFT_TOUCH, 0.0, 0.2)[0] == "lost"


def test_what_was_pressed_on_lingers_until_it_is_no_longer_felt(pressed):
    assert pressed.linger()
    pressed.end()
    assert pressed.linger()
    feel(pressed, None, 0.0, 0.1)
    assert not pressed.linger()
    feel(pressed, None, 5.0, 0.1)
    assert not pressed.linger()
