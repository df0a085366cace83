"""What failures teach, rule by rule."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pinocchio import SE3

import skills
from planner.failure import ArmStopped, Blocked, GraspSlipped, RefinementFailure
from planner.task.learned import Learned, minimal
from planner.task.pddl_reader import read_domain, read_text
from planner.task.situation import Situation, Spot
from planner.task.symbols import GroundAction
from sim.scene import Held

CATALOGUE = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))
PICK = GroundAction("pick", ("cup", "table"))
PLACE = GroundAction("place", ("cup", "right_bin"))
WIPE = GroundAction("wipe", ("crumb", "table", "dustpan"))
PUT_MUG = GroundAction("place", ("mug", "table"))
OWN = frozenset({Spot("cup")})


@pytest.fixture
def scene(tabletop):
    return tabletop("cup mug jug pot", "crumb")


@pytest.fixture
def learned():
    return Learned(CATALOGUE)


def failed(action, *culprits, start=0, **options):
    """A failure with one sample for each set of culprits, numbered from `start`."""
    attempts = tuple(Blocked(start + i, "blocked", frozenset(names)) for i, names in enumerate(culprits))
    return RefinementFailure(action, "all samples are blocked", attempts, **options)


def spots(*names):
    return frozenset(map(Spot, names))


def after(scene, *moves):
    """The situation after actions that put the mug (or what is named first) 10 cm farther on, one after the other."""
    situation = Situation.now(scene)
    for action in moves:
        name = action.args[0]
        shift = SE3(np.eye(3), np.array([0.1, 0.0, 0.0]))
        situation = situation.after(
            action, situation.scene.moved(name, shift * situation.scene.poses[name]), frozenset()
        )
    return situation


def test_each_minimal_set_of_culprits_is_an_option_and_dominated_ones_are_not(learned, scene):
    learned.learn(failed(PICK, {"mug"}, {"jug", "pot"}, {"mug", "jug"}), Situation.now(scene), (), 20)
    assert learned.constraints() == {PICK: {spots("mug"), spots("jug", "pot"), OWN}}


def test_minimal_sets_have_no_others_among_their_subsets():
    a, b, c = Spot("a"), Spot("b"), Spot("c")
    sets = [frozenset({a}), frozenset({a, b}), frozenset({b, c}), frozenset({a, c}), frozenset({b, c})]
    assert minimal(sets) == {frozenset({a}), frozenset({b, c})}


def test_a_sample_without_culprits_is_no_option_beside_one_with(learned, scene):
    learned.learn(failed(PICK, set(), {"mug"}), Situation.now(scene), (), 20)
    assert learned.constraints() == {PICK: {spots("mug"), OWN}}


def test_no_culprits_at_all_mean_that_there_is_no_grasp(learned, scene):
    learned.learn(failed(PICK, set(), set()), Situation.now(scene), (), 20)
    assert learned.constraints() == {}
    assert learned.ungraspable(scene) == learned.stuck(scene) == {"cup"}
    assert learned.sentences() == ["cup cannot be grasped as it lies (all samples are blocked); drag may change that"]


def test_an_action_that_needs_no_grasp_and_has_no_culprits_needs_its_object_elsewhere(learned, scene):
    learned.learn(failed(WIPE, set()), Situation.now(scene), (), 20)
    assert learned.constraints() == {WIPE: {spots("crumb")}}
    assert learned.sentences() == [f"{WIPE} doesn't work as crumb lies: all samples are blocked"]


def test_hints_are_the_samples_whose_culprits_are_away(learned, scene):
    learned.learn(failed(PICK, {"mug"}, {"jug"}, set(), {"mug", "jug"}), Situation.now(scene), (), 20)
    hints, is_fresh = learned.hints(PICK, after(scene, PUT_MUG))
    assert (hints.first, hints.avoid, is_fresh) == ((0,), {1, 2, 3}, True)
    assert learned.hints(PICK, Situation.now(scene))[0].first == ()


def test_a_set_grows_when_its_sample_fails_again_and_only_that_one(learned, scene):
    learned.learn(failed(PICK, {"mug"}, {"jug"}), Situation.now(scene), (), 20)
    learned.learn(failed(PICK, {"pot"}), after(scene, PUT_MUG), (0,), 20)
    assert learned.constraints() == {PICK: {spots("mug", "pot"), spots("jug"), OWN}}


def test_a_hinted_sample_that_is_not_among_the_attempts_is_spent(learned, scene):
    learned.learn(failed(PICK, {"mug"}, {"jug"}), Situation.now(scene), (), 20)
    learned.learn(failed(PICK, set(), start=9), after(scene, PUT_MUG), (0,), 20)
    assert learned.constraints() == {PICK: {spots("jug"), OWN}}


def test_a_new_sample_is_known_to_work_only_with_the_other_known_obstacles_away_too(learned, scene):
    learned.learn(failed(PICK, {"mug"}), Situation.now(scene), (), 20)
    learned.learn(failed(PICK, {"pot"}, {"pot"}), after(scene, PUT_MUG), (0,), 20)
    assert learned.constraints() == {PICK: {spots("mug", "pot"), OWN}}


def test_an_action_that_failed_three_times_in_a_place_gets_no_new_samples(learned, scene):
    for count in range(3):
        assert learned.hints(PICK, Situation.now(scene))[1]
        learned.learn(failed(PICK, {"mug"}, start=count), Situation.now(scene), (), 20)
    assert not learned.hints(PICK, Situation.now(scene))[1]


def test_a_culprit_where_the_plan_put_it_is_another_spot_than_where_it_was_seen(learned, scene):
    learned.learn(failed(PICK, {"mug"}), Situation.now(scene), (), 20)
    learned.learn(failed(PICK, {"mug"}), after(scene, PUT_MUG), (0,), 20)
    put = Spot("mug", PUT_MUG)
    assert learned.constraints() == {PICK: {frozenset({Spot("mug"), put}), OWN}}
    assert learned.sentences() == [f"mug (even where {PUT_MUG} leaves it) obstructs {PICK}"]
    learned.forget_predicted()
    assert learned.constraints() == {PICK: {spots("mug"), OWN}}


def test_a_failure_at_a_pose_of_the_plan_alone_is_forgotten_with_it(learned, scene):
    drag = GroundAction("drag", ("cup", "table"))
    learned.learn(failed(PICK, {"mug"}), after(scene, drag), (), 20)
    assert learned.constraints() == {PICK: {spots("mug"), frozenset({Spot("cup", drag)})}}
    assert learned.sentences() == [f"mug obstructs {PICK} with cup (where {drag} leaves it)"]
    learned.forget_predicted()
    assert not learned


def test_failures_at_several_poses_of_the_object_must_all_be_avoided(learned, scene):
    drag = GroundAction("drag", ("cup", "table"))
    learned.learn(failed(PICK, {"mug"}), Situation.now(scene), (), 20)
    learned.learn(failed(PICK, {"jug"}), after(scene, drag), (), 20)
    here, there = frozenset({Spot("cup")}), frozenset({Spot("cup", drag)})
    assert learned.constraints() == {
        PICK: {spots("mug", "jug"), spots("mug") | there, spots("jug") | here, here | there}
    }


def displaced(scene, name, by=0.02, turn=0.0):
    R = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    X = scene.poses[name]
    return scene.moved(name, SE3(R @ X.rotation, X.translation + np.array([by, 0, 0])))


@pytest.mark.parametrize("name", ["mug", "cup"])
@pytest.mark.parametrize(("by", "turn", "is_void"), [(0.02, 0, True), (0.005, 0.05, False), (0, 0.1, True)])
def test_facts_are_void_when_a_culprit_or_the_object_is_seen_displaced(learned, scene, name, by, turn, is_void):
    learned.learn(failed(PICK, {"mug"}), Situation.now(scene), (), 20)
    moved = displaced(scene, name, by, turn)
    assert learned.in_the_way(moved) == {"mug", "cup"} - ({name} if is_void else set())
    assert learned.observe(moved) == ({name} if is_void else set())
    assert bool(learned) != is_void


def test_with_one_sample_void_the_action_is_open_again_but_the_others_stay_known(learned, scene):
    learned.learn(failed(PICK, {"mug"}, {"jug"}), Situation.now(scene), (), 20)
    moved = displaced(scene, "mug")
    learned.observe(moved)
    assert learned.constraints() == {}
    assert learned.hints(PICK, Situation.now(moved))[0].avoid == {1}


def test_a_sample_blocked_by_two_is_still_blocked_by_one_when_the_other_is_gone(learned, scene):
    learned.learn(failed(PICK, {"mug", "jug"}), Situation.now(scene), (), 20)
    moved = displaced(scene, "mug")
    learned.observe(moved)
    assert learned.constraints() == {PICK: {spots("jug"), OWN}}
    assert "jug" in learned.in_the_way(moved)
    learned.observe(displaced(moved, "jug"))
    assert learned.constraints() == {}


def test_a_body_taken_up_is_displaced(learned, scene):
    learned.learn(failed(PICK, {"mug"}), Situation.now(scene), (), 20)
    assert learned.observe(replace(scene, held=Held("mug", SE3.Identity()))) == {"mug"}


def test_a_failure_to_place_is_void_with_another_grasp(learned, scene):
    holding = replace(scene, held=Held("cup", SE3.Identity()))
    learned.learn(failed(PLACE, set()), Situation.now(holding), (), 20)
    assert learned.constraints() == {PLACE: {OWN}}
    learned.observe(replace(scene, held=Held("cup", SE3(np.eye(3), np.array([0, 0, 0.003])))))
    assert learned.constraints() == {PLACE: {OWN}}
    learned.observe(replace(scene, held=Held("cup", SE3(np.eye(3), np.array([0, 0, 0.03])))))
    assert not learned


def test_what_failed_without_culprits_while_a_tool_was_held_is_void_with_another_grasp_of_the_tool(learned, scene):
    holding = replace(scene, held=Held("sponge", SE3.Identity()))
    learned.learn(failed(WIPE, set()), Situation.now(holding), (), 20)
    learned.observe(replace(scene, held=Held("sponge", SE3(np.eye(3), np.array([0, 0, 0.03])))))
    assert not learned


def test_obstacles_stand_whatever_the_grasp_of_the_tool(learned, scene):
    holding = replace(scene, held=Held("sponge", SE3.Identity()))
    learned.learn(failed(WIPE, set(), {"mug"}), Situation.now(holding), (), 20)
    learned.observe(replace(scene, held=Held("sponge", SE3(np.eye(3), np.array([0, 0, 0.03])))))
    assert learned.constraints() == {WIPE: {spots("mug"), spots("crumb")}}


def test_a_wider_budget_retracts_what_was_found_with_a_smaller_one_but_no_proof(learned, scene):
    learned.learn(failed(PICK, {"mug"}), Situation.now(scene), (), 20)
    learned.learn(failed(WIPE, {"mug"}), Situation.now(scene), (), 40)
    learned.learn(failed(GroundAction("pick", ("jug", "table")), proof="here"), Situation.now(scene), (), 20)
    learned.learn(failed(GroundAction("pick", ("pot", "table")), proof="anywhere"), Situation.now(scene), (), 20)
    learned.retract(40)
    assert set(learned.constraints()) == {WIPE, GroundAction("pick", ("pot", "table"))}
    assert learned.ungraspable(scene) == {"jug"}
    assert learned.proofs().sentences() == [
        "pick(pot, table) is impossible: all samples are blocked",
        "pick(jug, table) is impossible as jug lies: all samples are blocked",
    ]


def test_a_proof_at_a_pose_that_the_plan_chose_is_only_evidence(learned, scene):
    drag = GroundAction("drag", ("cup", "table"))
    learned.learn(failed(PICK, proof="here"), after(scene, drag), (), 20)
    assert not learned.proofs()


def test_what_failed_in_execution_is_avoided_where_it_failed(learned, scene):
    assert not learned.learn_execution(GraspSlipped(PICK, "it slipped", 4), scene)
    hints, is_fresh = learned.hints(PICK, Situation.now(scene))
    assert (hints.avoid, is_fresh) == ({4}, True)
    assert not learned
    learned.observe(displaced(scene, "cup"))
    assert learned.hints(PICK, Situation.now(scene))[0].avoid == frozenset()


def test_after_three_samples_failed_in_execution_the_action_counts_as_failed(learned, scene):
    found = [learned.learn_execution(GraspSlipped(PICK, "it slipped", n), scene) for n in (1, 2, 2, 3)]
    assert found == [False, False, False, True]
    assert learned.ungraspable(scene) == {"cup"}
    learned.retract(1000)
    assert not learned
    assert learned.hints(PICK, Situation.now(scene))[0].avoid == {1, 2, 3}


def test_an_arm_that_was_stopped_says_nothing_about_what_it_was_to_grasp(learned, scene):
    for n in range(8):
        assert not learned.learn_execution(ArmStopped(PICK, "something pushed the arm", n), scene)
    assert learned.ungraspable(scene) == frozenset()
    hints, _ = learned.hints(PICK, Situation.now(scene))
    assert hints.avoid == set(range(8))
    assert hints.failed == ()


def test_a_tool_that_slips_time_and_again_may_be_held_otherwise(learned, scene):
    held = replace(scene, held=Held("mug", SE3.Identity()))
    for n in range(3):
        learned.learn_execution(GraspSlipped(WIPE, "mug slipped", n), held)
    assert frozenset({Spot("mug")}) in learned.constraints()[WIPE]
    assert learned.hints(WIPE, Situation.now(held))[0].failed == ()
    learned.observe(replace(scene, held=Held("mug", SE3(np.eye(3), np.array([0.0, 0.0, 0.04])))))
    assert WIPE not in learned.constraints()


def test_what_the_largest_budget_found_is_open_to_it_again_in_the_next_plan(learned, scene):
    learned.learn(failed(PICK, set()), Situation.now(scene), (), 40)
    learned.begin(scene)
    assert learned.ungraspable(scene) == {"cup"}
    learned.retract(40)
    assert learned.ungraspable(scene) == frozenset()


def test_what_failed_with_a_bin_is_void_once_that_stands_elsewhere(learned, scene):
    region = scene.scenario.regions["right_bin"]
    learned.learn(failed(PLACE, set()), Situation.now(scene), (), 20)
    learned.learn(failed(GroundAction("place", ("mug", "right_bin")), proof="anywhere"), Situation.now(scene), (), 20)
    learned.observe(scene)
    assert len(learned.constraints()) == 2
    X_WR = SE3(np.eye(3), region.X_WR.translation + np.array([0.05, 0.0, 0.0]))
    regions = {**scene.scenario.regions, "right_bin": replace(region, X_WR=X_WR)}
    learned.observe(replace(scene, scenario=replace(scene.scenario, regions=regions)))
    assert learned.constraints() == {}


def test_what_is_merely_surrounded_is_stuck_only_once_a_budget_was_widened(learned, scene):
    learned.learn(failed(PICK, {"mug"}), Situation.now(scene), (), 40)
    assert learned.stuck(scene) == frozenset()
    learned.retract(40)
    assert learned.stuck(scene) == {"cup"}
    learned.begin(scene)
    assert learned.stuck(scene) == frozenset()


def test_sentences_name_what_obstructs(learned, scene):
    learned.learn(failed(PICK, {"mug", "jug"}), Situation.now(scene), (), 20)
    learned.learn(failed(WIPE, {"mug"}, {"jug", "pot"}), Situation.now(scene), (), 20)
    assert learned.sentences() == [
        "jug and mug obstruct pick(cup, table)",
        "wipe(crumb, table, dustpan) needs mug or jug and pot out of the way",
    ]
    assert learned.culprits() == {"mug", "jug", "pot"}


def test_what_keeps_failing_in_execution_is_given_up_although_budgets_are_widened(learned, scene):
    possible = []
    for n in range(1, 9):
        if learned.learn_execution(GraspSlipped(PICK, "it slipped", n), scene):
            learned.retract(1000)
        possible.append(not learned.ungraspable(scene))
    assert possible == [True] * 5 + [False] * 3
