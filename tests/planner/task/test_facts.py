"""The believed scene in the planner's predicates."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import SE3

import skills
from planner.task.facts import facts, goal_facts, objects_of, observed_facts, place_of
from planner.task.learned import Learned
from planner.task.pddl_reader import read_domain, read_text
from planner.task.symbols import Fact
from scenarios.goal import GoalError
from scenarios.load import load_scenario
from scenarios.regions import interior
from sim.scene import Held, SceneState

CATALOGUE = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))


def at(x, y, z, roll=0.0):
    return SE3(pin.rpy.rpyToMatrix(roll, 0.0, 0.0), np.array([x, y, z]))


def test_the_facts_of_fig1_are_those_of_the_paper():
    scene = SceneState.initial(load_scenario("fig1"), 0.1)
    assert observed_facts(scene) == {
        Fact("hand_empty"),
        Fact("is_sponge", ("sponge",)),
        Fact("in_bin", ("sponge", "dustpan")),
        *(Fact("in_bin", (name, "table")) for name in ("book", "box", "carrot", "tomato")),
    }


def test_what_was_merely_nudged_states_the_very_same_set():
    scene, learned = SceneState.initial(load_scenario("fig1"), 0.1), Learned(CATALOGUE)
    nudged = scene.moved("book", at(0.002, 0.0, 0.0) * scene.poses["book"])
    assert facts(nudged, learned) is facts(scene, learned)
    gone = scene.without(frozenset({"book"}))
    assert facts(gone, learned) == {fact for fact in facts(scene, learned) if "book" not in fact.args}


def test_what_is_too_small_to_grasp_is_a_crumb_and_a_tool_is_a_tool():
    kinds = objects_of(SceneState.initial(load_scenario("fig1"), 0.1))
    assert kinds == {
        **{"book": "movable", "box": "movable", "carrot": "crumb", "tomato": "crumb", "sponge": "tool"},
        **{"left_bin": "bin", "right_bin": "bin", "dustpan": "dustpan", "table": "tabletop"},
    }


@pytest.mark.parametrize(
    ("X_WO", "place"),
    [
        (at(0, 0, 0.03), "table"),
        (at(0.49, 0, 0.03), "table"),
        (at(0.51, 0, 0.03), None),
        (at(0, 0, 0.045), "table"),
        (at(0, 0, 0.06), None),
        (at(0, 0, 0.01), None),
        (at(0, 0, 0.03 * np.sqrt(2), roll=np.pi / 4), "table"),
        (at(0, 1.0, -0.15), "left_bin"),
        (at(0, 1.0, -0.02), "left_bin"),
        (at(0, 1.0, -0.195), "left_bin"),
        (at(0, 1.0, -0.205), None),
        (at(0, 1.0, 0.01), None),
        (at(0, 1.245, -0.1), None),
        (at(0.75, 0.1, -0.08), "dustpan"),
        (at(0, 0, -0.7), None),
    ],
)
def test_a_body_lies_in_a_region_on_the_table_or_nowhere(tabletop, X_WO, place):
    scene = tabletop("cup").moved("cup", X_WO)
    assert place_of(scene, "cup") == place


def test_a_held_body_is_in_no_place(tabletop):
    scene = tabletop("cup")
    held = SceneState(scene.scenario, scene.poses, scene.q, 0.06, Held("cup", SE3.Identity()))
    assert place_of(held, "cup") is None
    assert observed_facts(held) >= {Fact("holding", ("cup",))}
    assert Fact("hand_empty") not in observed_facts(held)


def test_what_lies_in_a_bin_is_put_away_and_in_the_dustpan_it_is_not(tabletop):
    scene = tabletop("cup mug").moved("cup", at(0, 1.0, -0.15)).moved("mug", at(0.75, 0.1, -0.08))
    assert Fact("put_away", ("cup",)) in observed_facts(scene)
    assert Fact("put_away", ("mug",)) not in observed_facts(scene)


@settings(max_examples=30, derandomize=True)
@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.15, 0.15), st.floats(-np.pi, np.pi))
def test_a_point_is_in_a_turned_bin_if_it_is_in_the_straight_one(x, y, z, yaw):
    scene = SceneState.initial(load_scenario("fig1"), 0.1)
    scenario, region = scene.scenario, scene.scenario.regions["left_bin"]
    turned = type(region)(
        **{**vars(region), "X_WR": region.X_WR * at(0, 0, 0) * SE3(pin.rpy.rpyToMatrix(0, 0, yaw), np.zeros(3))}
    )
    changed = type(scenario)(**{**vars(scenario), "regions": {**scenario.regions, "left_bin": turned}})
    lower, upper = interior(region)
    scene = SceneState(changed, scene.poses, scene.q, 0.1).moved("book", turned.X_WR * at(x, y, z))
    is_inside = bool(np.all(np.array([x, y, z]) > lower) and np.all(np.array([x, y, z]) < upper))
    near_floor = lower[2] - 0.011 < z <= lower[2]
    if not near_floor:
        assert (place_of(scene, "book") == "left_bin") == is_inside


def test_everything_is_graspable_and_away_until_a_failure_teaches_otherwise(tabletop):
    scene = tabletop("cup", "crumb")
    found = facts(scene, Learned(CATALOGUE))
    assert {f.args[0] for f in found if f.predicate == "graspable"} == {"cup", "sponge"}
    assert {f.args[0] for f in found if f.predicate == "away"} == {"cup", "crumb", "sponge"}


def test_a_body_taken_out_of_the_scene_is_stated_nowhere(tabletop):
    scene = tabletop("cup mug").without(frozenset({"mug"}))
    assert place_of(scene, "mug") is None
    assert not any("mug" in fact.args for fact in facts(scene, Learned(CATALOGUE)))


def test_a_goal_that_is_no_conjunction_is_refused():
    with pytest.raises(GoalError, match="expected a conjunction of positive literals"):
        goal_facts("(or (in_bin a b))")


def test_what_stands_on_something_on_the_table_is_on_the_table(tabletop):
    scene = tabletop("lower middle upper").moved("lower", at(0, 0, 0.03)).moved("middle", at(0.01, 0, 0.09))
    scene = scene.moved("upper", at(0.02, 0, 0.15))
    assert [place_of(scene, name) for name in ("lower", "middle", "upper")] == ["table"] * 3
    assert place_of(scene.without(frozenset({"middle"})), "upper") is None
    beside = scene.moved("middle", at(0.0601, 0, 0.09))
    assert place_of(beside, "middle") is None


def test_a_crumb_on_top_of_something_is_not_on_the_table_where_it_could_be_wiped(tabletop):
    scene = tabletop("cup", "crumb").moved("cup", at(0, 0, 0.03)).moved("crumb", at(0, 0, 0.07))
    assert place_of(scene, "crumb") is None


def test_what_stands_above_the_dustpan_s_rim_on_something_in_it_can_be_taken_from_there(tabletop):
    scene = tabletop("cup mug").moved("mug", at(0.75, 0, -0.03)).moved("cup", at(0.75, 0, 0.03))
    assert place_of(scene, "cup") == "dustpan"
    assert place_of(scene.moved("cup", at(0.75, 0.15, 0.03)), "cup") is None
    assert place_of(scene.moved("mug", at(0, 1.0, -0.03)).moved("cup", at(0, 1.0, 0.03)), "cup") is None


def test_what_stands_on_what_the_hand_holds_counts_as_on_the_table(tabletop):
    scene = tabletop("cup mug").moved("mug", at(0, 1.0, 0.3)).moved("cup", at(0, 1.0, 0.36))
    assert place_of(scene, "cup") is None
    assert place_of(replace(scene, held=Held("mug", at(0, 0, 0))), "cup") == "table"
    assert place_of(replace(scene, held=Held("cup", at(0, 0, 0))), "mug") is None
