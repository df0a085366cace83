"""What a scene file may say about what goes wrong during a run."""

import numpy as np
import pytest

from scenarios.disturbance import Bring, Disorder, Moment, Move, NewGoal, PushArm, ShiftRegion, Take
from scenarios.document import parse_document
from scenarios.errors import SceneInvalid
from scenarios.load import build_scenario

SCENE = """\
version: 1
name: disturbed
robot: {model: iiwa14_wsg50}
table: {size: [0.8, 1.2, 0.05], pose: {xyz: [0.6, 0.0, 0.025]}}
regions:
  crate: {kind: bin, size: [0.3, 0.3, 0.13], pose: {xyz: [-0.1, 0.9, 0.065]}}
objects:
  cup: {shape: {box: [0.05, 0.05, 0.08]}, mass: 0.2, pose: {on: table, xy: [0.6, 0.0]}}
  tin: {shape: {box: [0.05, 0.05, 0.08]}, mass: 0.2, pose: {on: table, xy: [0.6, 0.0]}, noise: {xy: 0.01}}
goal: clear-table
disturbances:
"""


def read(*entries, seed=0):
    text = SCENE + "".join(f"  - {entry}\n" for entry in entries)
    return build_scenario(parse_document(text, "scene.yaml"), seed)


BRINGS = "{at: 3, bring: {object: tin}}"


def test_everything_that_may_happen_is_read():
    found = read(
        "{at: 2.5, move: {object: cup, by: [0.1, 0, 0], turn_deg: [0, 0, 90]}}",
        BRINGS,
        "{phase: approach, action: pick, nth: 2, after: 0.5, take: {object: cup}}",
        "{phase: lift, shift: {region: crate, by: [0, 0.05, 0]}}",
        "{at: 4, push: {force: [100, 0, 0], seconds: 0.1, link: link_4}}",
        "{at: 5, disorder: {what: pose-delay, size: 0.3, seconds: 2}}",
        '{at: 6, goal: "(in_bin cup crate)"}',
    ).disturbances
    moments = [one.moment for one in found]
    assert moments[0] == Moment(at=2.5)
    assert moments[2] == Moment(phase="approach", action="pick", nth=2, after=0.5)
    happenings = [one.happening for one in found]
    assert happenings[0] == Move("cup", (0.1, 0.0, 0.0), (0.0, 0.0, np.pi / 2))
    assert isinstance(happenings[1], Bring)
    assert happenings[2:] == [
        Take("cup"),
        ShiftRegion("crate", (0.0, 0.05, 0.0)),
        PushArm((100.0, 0.0, 0.0), 0.1, "link_4"),
        Disorder("pose-delay", 0.3, 2.0),
        NewGoal("(and (in_bin cup crate))"),
    ]


@pytest.mark.parametrize("seed", [0, 3])
def test_what_is_brought_is_not_there_at_the_start_and_may_overlap_what_is(seed):
    assert read(BRINGS, seed=seed).late == {"tin"}


def test_what_is_taken_before_it_is_brought_back_is_there_at_the_start():
    with pytest.raises(SceneInvalid, match="overlaps"):
        read("{at: 1, take: {object: tin}}", BRINGS)


def test_what_is_brought_to_its_declared_pose_must_have_room_there():
    sunk = SCENE.replace("{on: table, xy: [0.6, 0.0]}, noise", "{xyz: [0.6, 0.0, 0.05]}, noise")
    with pytest.raises(SceneInvalid, match=r"objects\.tin\.pose, line 9: 'tin' overlaps 'table'"):
        build_scenario(parse_document(f"{sunk}  - {BRINGS}\n", "scene.yaml"))


def test_a_goal_may_be_clear_table_from_then_on():
    found = read(BRINGS, "{at: 6, goal: clear-table}").disturbances
    assert found[1].happening == NewGoal("(and (put_away cup) (put_away tin))")


def test_disturbances_that_are_no_list_are_refused():
    with pytest.raises(SceneInvalid, match="expected a list of entries, got nothing"):
        read()


@pytest.mark.parametrize(
    ("entry", "complaint"),
    [
        ("{at: 1, take: {object: cap}}", "unknown object 'cap', did you mean 'cup'"),
        ("{at: 1, shift: {region: table, by: [0, 0.1, 0]}}", "unknown region 'table'"),
        ("{at: 1, push: {force: [1, 0, 0], seconds: 1, link: elbow}}", "unknown link 'elbow'"),
        ("{at: 1, push: {force: [1, 0, 0], seconds: 1, link: link_0}}", "link 'link_0' doesn't move"),
        ("{at: 1, bring: {object: tin, pose: {on: shelf, xy: [0, 0]}}}", "unknown surface 'shelf'"),
        ('{at: 1, goal: "(in_bin cap crate)"}', "unknown object 'cap'"),
        ("{at: 1, bring: {object: tin, pose: {on: table, xy: [5, 0]}}}", "lies off 'table'"),
        ("{at: 1, bring: {object: tin, pose: {xyz: [0.6, 0, 0.05]}}}", "'tin' overlaps 'table'"),
        ("{at: 1, move: {object: cup}}", "nothing is moved, expected `by` or `turn_deg`"),
        ("{at: 1, move: {object: cup, turn_deg: [0, 0, 360]}}", "nothing is moved, expected `by` or `turn_deg`"),
        ("{at: 1, shift: {region: crate, by: [0, 0, 0]}}", "shifts nothing, expected a length other than 0"),
        ("{at: 1, push: {force: [0, 0, 0], seconds: 1}}", "pushes nothing, expected a force other than 0"),
        ("{at: 1, disorder: {what: pose-delay, seconds: 1}}", "pose-delay has no size, expected `size`"),
        ("{at: 1, disorder: {what: pose-missing, size: 1, seconds: 1}}", "pose-missing has none, expected no size"),
        ("{phase: lift, nth: 1.5, take: {object: cup}}", "expected a whole number, got 1.5"),
        ("{at: 1}", "0 things happen"),
        ("{at: 1, take: {object: cup}, bring: {object: tin}}", "2 things happen"),
        ("{take: {object: cup}}", "either `at` or `phase`, neither is given"),
        ("{at: 1, phase: lift, take: {object: cup}}", "either `at` or `phase`, both are given"),
        ("{at: 1, nth: 2, take: {object: cup}}", "stands alone"),
        ("{at: -1, take: {object: cup}}", "disturbances"),
        ("{at: 1, disorder: {what: headache, seconds: 1}}", "headache"),
        ("{at: 1, disturb: {}}", "unknown key"),
    ],
)
def test_what_makes_no_sense_is_refused_with_its_place(entry, complaint):
    with pytest.raises(SceneInvalid) as refused:
        read(BRINGS, entry)
    assert complaint in str(refused.value)
    assert "disturbances[1]" in str(refused.value)
    assert "\n" not in str(refused.value)
