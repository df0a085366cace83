"""The loop between task planner and refinement, with a stand-in for the skills and the real Pyperplan."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from pinocchio import SE3

import skills
from planner.failure import GraspMissed, RefinementFailure
from planner.refinement import Refinement, Work
from planner.search_then_sample import NoPlan, PlanSettings, SearchThenSample, Solution
from planner.task.facts import goal_facts, place_of
from planner.task.pddl_reader import read_domain, read_text
from planner.task.pyperplan_ import PyperplanPlanner
from planner.task.sexpr import PddlError
from planner.task.situation import Spot
from planner.task.symbols import Fact, GroundAction
from scenarios.load import load_scenario
from sim.scene import Held, SceneState

DOMAIN = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))
PRIMITIVES = ("pick", "place", "wipe", "drag", "drag_aside")


class Run:
    """One loop with what it reported."""

    def __init__(self, skill, **settings):
        self.events = []
        self.loop = SearchThenSample(
            PyperplanPlanner(),
            dict.fromkeys(PRIMITIVES, skill),
            DOMAIN,
            PlanSettings(**{"tries": 5, **settings}),
            lambda kind, data: self.events.append((kind, dict(data))),
        )
        self.work = Work()

    def plan(self, scene, goal):
        return self.loop.plan(scene, goal_facts(goal), np.random.default_rng(0), self.work)

    def of(self, kind):
        return [data for name, data in self.events if name == kind]

    @property
    def rounds(self):
        """The task plans in turn."""
        return [event["plan"] for event in self.of("round")]

    @property
    def learned(self):
        return [event["sentence"] for event in self.of("learned")]


def never(sample, scene):
    """No sample works, and nothing movable is to blame."""
    return set()


def labels(solution):
    assert isinstance(solution, Solution), solution
    return [str(action) for action in solution.plan.actions]


def reached(solution, goal):
    """Does the last predicted scene fulfil every in_bin literal of the goal?"""
    literals = [fact for fact in goal_facts(goal) if fact.predicate == "in_bin"]
    return all(place_of(solution.scenes[-1], fact.args[0]) == fact.args[1] for fact in literals)


WIPE_CARROT, WIPE_TOMATO = "wipe(carrot, table, dustpan)", "wipe(tomato, table, dustpan)"


@pytest.fixture
def paper(is_at_start):
    """What the paper says of its Fig. 1; `until` tells how long the book stands over the tomato."""

    def blocking(until):
        def answer(action, sample, scene):
            if action.name == "wipe":
                book = is_at_start(scene, "book") if until == "dragged" else place_of(scene, "book") == "table"
                found = {"box"} if is_at_start(scene, "box") else set()
                found |= {"book"} if book and action.args[0] == "tomato" else set()
                return found or None
            return set() if action.name == "pick" and action.args[0] == "book" and is_at_start(scene, "book") else None

        return answer

    return blocking


def test_fig1_wipe_begins_with_the_naive_four_actions_and_learns_what_obstructs_them(paper, stand_in):
    scene = SceneState.initial(load_scenario("fig1_wipe"), 0.1)
    run = Run(stand_in(paper("dragged")))
    solution = run.plan(scene, scene.scenario.goal)
    naive = run.rounds[0]
    assert (naive[0], sorted(naive[1:3]), naive[3]) == (
        "pick(sponge, dustpan)",
        [WIPE_CARROT, WIPE_TOMATO],
        "place(sponge, left_bin)",
    )
    assert not run.of("backtracked"), "what was seen in the way is no matter of how the sponge is held"
    assert set(run.learned) >= {f"box obstructs {WIPE_CARROT}", f"book and box obstruct {WIPE_TOMATO}"}
    assert reached(solution, scene.scenario.goal)


@pytest.mark.parametrize("until", ["dragged", "off the table"])
def test_fig1_ends_in_a_nine_action_plan(paper, stand_in, until):
    scene = SceneState.initial(load_scenario("fig1"), 0.1)
    run = Run(stand_in(paper(until)))
    solution = run.plan(scene, scene.scenario.goal)
    assert sorted(labels(solution)) == sorted(
        [
            "drag(book, table)",
            "pick(book, table)",
            "place(book, right_bin)",
            "pick(box, table)",
            "place(box, right_bin)",
            "pick(sponge, dustpan)",
            WIPE_CARROT,
            WIPE_TOMATO,
            "place(sponge, left_bin)",
        ]
    )
    assert "book cannot be grasped as it lies (every sample is blocked); drag may change that" in run.learned
    assert reached(solution, scene.scenario.goal)


PICK_CUP = GroundAction("pick", ("cup", "table"))
CUP_AWAY = "(in_bin cup right_bin)"


def rule(**blocked):
    """What blocks samples, by the action's label up to its first comma; everything else works."""

    def blocking(action, sample, scene):
        found = blocked.get(f"{action.name}_{action.args[0]}")
        return found(sample, scene) if found else None

    return blocking


def taken(solution):
    """The objects picked, in order."""
    return [action.args[0] for action in solution.plan.actions if action.name == "pick"]


def test_culprits_of_different_samples_are_alternatives(tabletop, stand_in, is_at_start):
    def pick_cup(sample, scene):
        culprit = ("mug", "jug")[sample % 2]
        return {culprit} if is_at_start(scene, culprit) else None

    run = Run(stand_in(rule(pick_cup=pick_cup)))
    solution = run.plan(tabletop("cup mug jug"), CUP_AWAY)
    assert len(taken(solution)) == 2
    assert run.learned == ["pick(cup, table) needs jug or mug out of the way"]
    assert len(run.rounds) == 2


def test_culprits_are_not_pooled_for_ever(tabletop, stand_in, is_at_start):
    def pick_cup(sample, scene):
        return next(({name} for name in ("mug", "jug", "pot") if is_at_start(scene, name)), None)

    run = Run(stand_in(rule(pick_cup=pick_cup)))
    solution = run.plan(tabletop("cup mug jug pot"), CUP_AWAY)
    assert sorted(taken(solution)) == ["cup", "jug", "mug", "pot"]
    assert len(run.rounds) == 4
    assert len({tuple(plan) for plan in run.rounds}) == 4
    assert run.learned[-1] == "jug and mug and pot obstruct pick(cup, table)"


def test_a_sample_that_fails_again_with_its_culprit_away_gets_a_larger_set_of_its_own(tabletop, stand_in, is_at_start):
    def pick_cup(sample, scene):
        if sample >= 5:
            return set()
        if is_at_start(scene, "mug"):
            return {"mug"}
        return {"jug"} if sample != 0 and is_at_start(scene, "jug") else set() if sample == 0 else None

    skill = stand_in(rule(pick_cup=pick_cup))
    run = Run(skill)
    solution = run.plan(tabletop("cup mug jug"), CUP_AWAY)
    assert isinstance(solution, Solution)
    needs = frozenset({Spot("mug"), Spot("jug")})
    assert run.loop.learned.constraints()[PICK_CUP] == {needs, frozenset({Spot("cup")})}
    tried = [samples for action, samples, _ in skill.calls if action == "pick(cup, table)"]
    assert tried[1] == [*range(10)], "what was blocked by something now away comes first, then as many new ones"
    avoided = [avoid for action, _, avoid in skill.calls if action == "pick(cup, table)"]
    assert avoided[0] == frozenset()
    assert 0 in avoided[-1], "what fails whatever is away isn't tried again"


def test_a_chain_of_obstacles_is_cleared_from_its_end(tabletop, stand_in, is_at_start):
    chain = {"pick_cup": "mug", "pick_mug": "jug", "pick_jug": "pot"}
    rules = {
        action: lambda sample, scene, culprit=culprit: {culprit} if is_at_start(scene, culprit) else None
        for action, culprit in chain.items()
    }
    run = Run(stand_in(rule(**rules)))
    solution = run.plan(tabletop("cup mug jug pot"), CUP_AWAY)
    assert taken(solution) == ["pot", "jug", "mug", "cup"]


def test_a_culprit_that_the_plan_itself_put_there_is_first_put_elsewhere(tabletop, stand_in, is_at_start):
    def pick_cup(sample, scene):
        p_WO = scene.poses["mug"].translation
        return {"mug"} if is_at_start(scene, "mug") or p_WO[0] < 0.1 else None

    run = Run(stand_in(rule(pick_cup=pick_cup)))
    solution = run.plan(tabletop("cup mug", bins=("right_bin",)), f"(and {CUP_AWAY} (in_bin mug table))")
    assert run.of("backtracked")
    assert all(event["to"].startswith("place(mug, ") for event in run.of("backtracked"))
    placing = next(r for r in solution.refinements if r.action.args[0] == "mug" and r.action.name == "place")
    assert placing.sample >= 3
    assert len(run.rounds) == 2


def test_going_back_farther_opens_the_later_choices_again(tabletop, stand_in, is_at_start):
    def only(*samples):
        return lambda sample, scene: None if sample in samples else set()

    def pick_cup(sample, scene):
        found = {name for name in ("mug", "jug") if is_at_start(scene, name)}
        x = {name: round(float(scene.poses[name].translation[0]), 2) for name in ("mug", "jug")}
        return found or (None if (x["mug"], x["jug"]) in ((0.07, 0.05), (0.05, 0.07)) else {"mug", "jug"})

    def put(action, sample, scene):
        if action.name == "pick" and action.args[0] == "cup":
            return pick_cup(sample, scene)
        first = next((name for name in ("jug", "mug") if not is_at_start(scene, name)), action.args[0])
        if action.name == "place" and action.args[0] in ("mug", "jug"):
            return only(0, 1)(sample, scene) if action.args[0] == first else only(0)(sample, scene)
        return None

    run = Run(stand_in(put))
    goal = f"(and {CUP_AWAY} (in_bin mug table) (in_bin jug table))"
    solution = run.plan(tabletop("cup mug jug", bins=("right_bin",)), goal)
    assert isinstance(solution, Solution)
    assert len(run.of("backtracked")) >= 2
    assert len(run.rounds) == 2


def test_a_grasp_that_the_rest_can_not_use_is_exchanged(tabletop, stand_in):
    def wipe_crumb(sample, scene):
        return set() if scene.held.X_GO.translation[2] < 0.0015 else None

    run = Run(stand_in(rule(wipe_crumb=wipe_crumb)))
    solution = run.plan(tabletop("", "crumb"), "(in_bin crumb dustpan)")
    assert [event["to"] for event in run.of("backtracked")] == ["pick(sponge, dustpan)"] * 2
    assert solution.refinements[0].sample == 2
    assert len(run.rounds) == 1


class Stubborn:
    """A task planner that gives the same plan whatever was learned."""

    def __init__(self):
        self.plan = None

    def solve(self, domain_text, problem_text, max_expansions):
        self.plan = self.plan or PyperplanPlanner().solve(domain_text, problem_text, max_expansions)
        return self.plan


class Counting:
    """A task planner that tells its expansions in its own way."""

    def __init__(self, told):
        self.told = told

    def solve(self, domain_text, problem_text, max_expansions):
        found = PyperplanPlanner().solve(domain_text, problem_text, max_expansions)
        return replace(found, expansions=self.told)


@pytest.mark.parametrize(("told", "is_believed"), [(np.int64(7), True), (2.5, False), ("many", False)])
def test_a_task_planner_may_count_with_any_whole_number(tabletop, stand_in, told, is_believed):
    heard = []
    loop = SearchThenSample(
        Counting(told),
        dict.fromkeys(PRIMITIVES, stand_in(rule())),
        DOMAIN,
        PlanSettings(tries=5, widenings=0),
        lambda kind, data: heard.append(data),
    )
    outcome = loop.plan(tabletop("cup"), goal_facts(CUP_AWAY), np.random.default_rng(0), Work())
    assert isinstance(outcome, Solution) is is_believed
    assert any(f"its expansions are {told!r}, expected" in data.get("failure", "") for data in heard) is not is_believed


def test_a_failing_plan_is_not_repeated_without_end(tabletop, stand_in):
    skill = stand_in(rule(pick_cup=lambda sample, scene: {"mug"}))
    loop = SearchThenSample(
        Stubborn(), dict.fromkeys(PRIMITIVES, skill), DOMAIN, PlanSettings(tries=5, widenings=1), lambda *_: None
    )
    outcome = loop.plan(tabletop("cup mug"), goal_facts(CUP_AWAY), np.random.default_rng(0), Work())
    assert isinstance(outcome, NoPlan)
    assert outcome.rounds == 4


def test_where_no_choice_puts_the_culprit_out_of_the_way_another_place_is_found(tabletop, stand_in, is_at_start):
    def pick_cup(sample, scene):
        return {"mug"} if place_of(scene, "mug") in ("table", "a_bin", "dustpan") else None

    run = Run(stand_in(rule(pick_cup=pick_cup)))
    solution = run.plan(tabletop("cup mug", bins=("a_bin", "z_bin")), "(put_away cup)")
    assert "place(mug, z_bin)" in labels(solution)
    assert len({tuple(plan) for plan in run.rounds}) == len(run.rounds)
    assert len(run.of("backtracked")) == 4 * (len(run.rounds) - 2)


def test_what_was_learned_of_poses_of_the_plan_is_forgotten_with_it(tabletop, stand_in, is_at_start):
    def pick_cup(sample, scene):
        return {"mug"} if place_of(scene, "mug") in ("table", "a_bin", "dustpan") else None

    run = Run(stand_in(rule(pick_cup=pick_cup)))
    run.plan(tabletop("cup mug", bins=("a_bin", "z_bin")), "(put_away cup)")
    assert f"mug (even where place(mug, a_bin) leaves it) obstructs {PICK_CUP}" in run.learned
    options = run.loop.learned.constraints()[PICK_CUP]
    assert options == {frozenset({Spot("mug")}), frozenset({Spot("cup")})}


def test_the_steps_of_a_solution_speak_the_language_of_the_domain_alone(tabletop, stand_in, is_at_start):
    def pick_cup(sample, scene):
        return {"mug"} if place_of(scene, "mug") in ("table", "a_bin", "dustpan") else None

    run = Run(stand_in(rule(pick_cup=pick_cup)))
    scene = tabletop("cup mug", bins=("a_bin", "z_bin"))
    solution = run.plan(scene, "(put_away cup)")
    facts = run.loop.facts(scene)
    for step in solution.plan.steps:
        assert step.applicable(facts)
        facts = step.apply(facts)
        assert {fact.predicate for fact in facts} <= set(DOMAIN.predicates)
    assert Fact("away", ("mug",)) in next(s.preconditions for s in solution.plan.steps if s.action == PICK_CUP)


def shifted(scene, name, by):
    return scene.moved(name, SE3(np.eye(3), np.array([by, 0.0, 0.0])) * scene.poses[name])


@pytest.mark.parametrize(("shift", "stands"), [(0.004, True), (0.05, False)])
@pytest.mark.parametrize("name", ["mug", "cup"])
def test_what_was_learned_is_void_once_the_body_is_seen_displaced(tabletop, stand_in, is_at_start, name, shift, stands):
    def pick_cup(sample, scene):
        return {"mug"} if is_at_start(scene, "mug") else None

    run = Run(stand_in(rule(pick_cup=pick_cup)))
    scene = tabletop("cup mug")
    run.plan(scene, CUP_AWAY)
    moved = shifted(scene, name, shift)
    run.plan(moved, CUP_AWAY)
    before_second = next(index for index, (kind, _) in enumerate(run.events) if kind == "solved")
    first_of_second = next(data for kind, data in run.events[before_second:] if kind == "round")
    assert ("pick(mug, table)" in first_of_second["plan"]) == stands


def test_a_body_back_where_it_was_in_the_way_is_not_away(tabletop, stand_in, is_at_start):
    def pick_cup(sample, scene):
        return {"mug"} if is_at_start(scene, "mug") else None

    run = Run(stand_in(rule(pick_cup=pick_cup)))
    scene = tabletop("cup mug")
    run.plan(scene, CUP_AWAY)
    away = Fact("away", ("mug",))
    assert away not in run.loop.facts(scene)
    assert away in run.loop.facts(shifted(scene, "mug", 0.2))
    assert away not in run.loop.facts(scene)


def test_without_any_way_the_budget_is_widened_and_then_the_search_ends(tabletop, stand_in):
    run = Run(stand_in(rule(pick_cup=never, drag_cup=never)), widenings=2)
    outcome = run.plan(tabletop("cup mug"), CUP_AWAY)
    assert isinstance(outcome, NoPlan)
    assert (outcome.verdict, outcome.culprits) == ("budget", {"cup"})
    assert [event["tries"] for event in run.of("widened")] == [10, 20]
    assert outcome.reason.startswith("no plan found, with 20 samples for each action: cup cannot be grasped as it lies")


def test_obstacles_in_each_others_way_end_in_no_plan_that_names_them(tabletop, stand_in, is_at_start):
    run = Run(
        stand_in(
            rule(
                pick_cup=lambda sample, scene: {"mug"} if is_at_start(scene, "mug") else None,
                pick_mug=lambda sample, scene: {"cup"} if is_at_start(scene, "cup") else None,
                drag_cup=never,
                drag_mug=never,
                drag_aside_cup=never,
                drag_aside_mug=never,
            )
        )
    )
    outcome = run.plan(tabletop("cup mug"), CUP_AWAY)
    assert isinstance(outcome, NoPlan)
    assert outcome.verdict == "budget"
    assert outcome.culprits >= {"cup", "mug"}
    assert "mug obstructs pick(cup, table)" in outcome.reason


def test_what_stands_in_the_way_and_can_neither_be_grasped_nor_dragged_to_a_grasp_is_dragged_aside(
    tabletop, stand_in, is_at_start
):
    run = Run(
        stand_in(
            rule(
                wipe_carrot=lambda sample, scene: {"mug"} if is_at_start(scene, "mug") else None,
                pick_mug=never,
                drag_mug=never,
            )
        )
    )
    solution = run.plan(tabletop("mug", "carrot"), "(in_bin carrot dustpan)")
    assert labels(solution) == ["drag_aside(mug, table)", "pick(sponge, dustpan)", WIPE_CARROT]
    assert "mug obstructs wipe(carrot, table, dustpan)" in run.learned


def test_what_was_dragged_aside_is_no_easier_to_grasp_there(tabletop, stand_in):
    run = Run(stand_in(rule(pick_cup=never, drag_cup=never)))
    outcome = run.plan(tabletop("cup"), CUP_AWAY)
    assert isinstance(outcome, NoPlan)
    plans = [plan for plan in run.rounds if plan and "drag_aside(cup, table)" in plan]
    assert all(plan.index("drag(cup, table)") > plan.index("drag_aside(cup, table)") for plan in plans)


def test_obstacles_in_each_others_way_are_dragged_apart(tabletop, stand_in, is_at_start):
    run = Run(
        stand_in(
            rule(
                pick_cup=lambda sample, scene: {"mug"} if is_at_start(scene, "mug") else None,
                pick_mug=lambda sample, scene: {"cup"} if is_at_start(scene, "cup") else None,
            )
        )
    )
    solution = run.plan(tabletop("cup mug"), CUP_AWAY)
    assert any(action.name == "drag" for action in solution.plan.actions)
    assert len(run.of("widened")) == 1, "what is graspable is dragged only where nothing else helps"


def test_a_wider_budget_retracts_what_was_only_sampled(tabletop, stand_in):
    run = Run(
        stand_in(rule(pick_cup=lambda n, scene: None if n == 15 else set(), drag_cup=lambda n, scene: set())),
        widenings=2,
    )
    solution = run.plan(tabletop("cup"), CUP_AWAY)
    assert isinstance(solution, Solution)
    assert solution.refinements[0].sample == 15
    assert len(run.of("widened")) == 2


def test_a_bound_on_rounds_ends_the_search(tabletop, stand_in, is_at_start):
    def pick_cup(sample, scene):
        return next(({name} for name in ("mug", "jug", "pot") if is_at_start(scene, name)), None)

    outcome = Run(stand_in(rule(pick_cup=pick_cup)), max_rounds=2).plan(tabletop("cup mug jug pot"), CUP_AWAY)
    assert isinstance(outcome, NoPlan)
    assert (outcome.verdict, outcome.rounds) == ("budget", 2)
    assert outcome.reason.startswith("no plan within 2 rounds")


def test_a_bound_on_expansions_is_no_proof(tabletop, stand_in):
    outcome = Run(stand_in(rule()), max_expansions=1, widenings=0).plan(tabletop("cup"), CUP_AWAY)
    assert isinstance(outcome, NoPlan)
    assert outcome.verdict == "budget"
    assert "no task plan within 1 expansions" in outcome.reason


def test_what_lies_on_the_floor_is_proven_out_of_reach_of_any_plan(tabletop, stand_in):
    scene = tabletop("", "crumb")
    fallen = scene.moved("crumb", SE3(np.eye(3), np.array([0.0, -0.7, -0.6])))
    run = Run(stand_in(rule()))
    outcome = run.plan(fallen, "(in_bin crumb dustpan)")
    assert isinstance(outcome, NoPlan)
    assert (outcome.verdict, outcome.culprits) == ("proven", {"crumb"})
    assert outcome.reason == (
        "no sequence of actions leads to in_bin(crumb, dustpan): crumb lies neither on the table nor in a region"
    )
    assert not run.of("widened")


def test_what_leans_somewhere_is_no_proof(tabletop, stand_in):
    scene = tabletop("", "crumb")
    leaning = scene.moved("crumb", SE3(np.eye(3), np.array([0.0, -0.7, 0.3])))
    outcome = Run(stand_in(rule())).plan(leaning, "(in_bin crumb dustpan)")
    assert isinstance(outcome, NoPlan)
    assert outcome.verdict == "budget"
    assert "crumb lies neither on the table nor in a region" in outcome.reason


def test_a_tool_on_the_floor_is_named_where_it_is_needed(stand_in):
    start = SceneState.initial(load_scenario("fig1"), 0.1)
    fallen = start.moved("sponge", SE3(np.eye(3), np.array([0.0, -1.7, -0.6])))
    outcome = Run(stand_in(rule())).plan(fallen, "(in_bin carrot dustpan)")
    assert isinstance(outcome, NoPlan)
    assert outcome.reason == (
        "no sequence of actions leads to in_bin(carrot, dustpan): sponge lies neither on the table nor in a region"
    )


class Refusing:
    """A skill that proves that it can't."""

    def __init__(self, proof):
        self.proof = proof

    def refine(self, action, scene, rng, budget, hints):
        return RefinementFailure(action, "it weighs 80 kg", (), self.proof)

    def predict(self, scene, refinement):
        raise AssertionError


@pytest.mark.parametrize("proof", ["here", "anywhere", None])
def test_only_proofs_make_a_problem_infeasible(tabletop, proof):
    run = Run(Refusing(proof))
    outcome = run.plan(tabletop("cup"), CUP_AWAY)
    assert isinstance(outcome, NoPlan)
    assert outcome.verdict == ("budget" if proof is None else "proven")
    assert "it weighs 80 kg" in outcome.reason or proof is None
    assert bool(run.of("widened")) == (proof is None)


def test_a_proof_about_a_pose_falls_with_the_pose(tabletop, stand_in):
    scene = tabletop("cup")
    run = Run(Refusing("here"))
    run.plan(scene, CUP_AWAY)
    assert run.loop.learned
    run.plan(shifted(scene, "cup", 0.05), CUP_AWAY)
    actions = [event["plan"] for event in run.of("round") if event["plan"]]
    assert actions.count(["pick(cup, table)", "place(cup, right_bin)"]) == 2


def test_an_action_is_refined_again_with_the_samples_of_the_plan_first(tabletop, stand_in):
    skill = stand_in(rule(pick_cup=lambda sample, scene: None if sample >= 3 else set()))
    run = Run(skill)
    scene = tabletop("cup")
    run.plan(scene, CUP_AWAY)
    skill.calls.clear()
    again = run.loop.refine(PICK_CUP, shifted(scene, "cup", 0.002), np.random.default_rng(0), Work())
    assert isinstance(again, Refinement)
    assert again.sample == 3
    assert skill.calls[0][1] == [3]


PLACE_CUP = GroundAction("place", ("cup", "right_bin"))
PICK_CUP_AGAIN = GroundAction("pick", ("cup", "right_bin"))


def in_hand(scene, name):
    """The body taken up."""
    return replace(scene, held=Held(name, SE3.Identity()))


@pytest.mark.parametrize(
    ("obstacles", "chosen"),
    [(set(), 3), ({"mug"}, 2)],
    ids=["what nothing helps is avoided", "what is only in the way may go in between"],
)
def test_an_action_refined_otherwise_than_planned_leaves_its_object_so_that_the_plan_can_go_on(
    tabletop, stand_in, obstacles, chosen
):
    def pick_cup(sample, scene):
        # The stand-in lays things side by side: from the fourth spot on the cup can be taken up again.
        return None if scene.poses["cup"].translation[0] > 0.0 else obstacles

    skill = stand_in(rule(place_cup=lambda sample, scene: None if sample >= 2 else set(), pick_cup=pick_cup))
    run = Run(skill)
    outcome = run.loop.refine(
        PLACE_CUP, in_hand(tabletop("cup mug"), "cup"), np.random.default_rng(0), Work(), rest=(PICK_CUP_AGAIN,)
    )
    assert outcome.sample == chosen


def test_where_nothing_lets_the_plan_go_on_the_first_that_can_be_done_is_taken(tabletop, stand_in):
    skill = stand_in(rule(place_cup=lambda sample, scene: None if sample >= 2 else set(), pick_cup=never))
    run = Run(skill)
    outcome = run.loop.refine(
        PLACE_CUP, in_hand(tabletop("cup mug"), "cup"), np.random.default_rng(0), Work(), rest=(PICK_CUP_AGAIN,)
    )
    assert outcome.sample == 2


def test_when_planned_again_what_worked_is_tried_first(tabletop, stand_in):
    skill = stand_in(rule(pick_cup=lambda sample, scene: None if sample >= 3 else set()))
    run = Run(skill)
    scene = tabletop("cup mug")
    run.plan(scene, CUP_AWAY)
    skill.calls.clear()
    run.plan(shifted(scene, "mug", 0.1), CUP_AWAY)
    assert skill.calls[0][:2] == ("pick(cup, table)", [3])


def test_a_sample_that_failed_in_execution_is_avoided_and_after_three_the_action_counts_as_failed(tabletop, stand_in):
    skill = stand_in(rule())
    run = Run(skill)
    scene = tabletop("cup")
    for _ in range(3):
        solution = run.plan(scene, CUP_AWAY)
        assert labels(solution)[0] == "pick(cup, table)"
        run.loop.learn(GraspMissed(PICK_CUP, "nothing between the fingers", solution.refinements[0].sample), scene)
    assert labels(run.plan(scene, CUP_AWAY))[0] == "drag(cup, table)"
    samples = [call[1] for call in skill.calls if call[0] == "pick(cup, table)"]
    assert samples[:3] == [[0], [1], [2]]
    assert run.learned == ["cup cannot be grasped as it lies (nothing between the fingers); drag may change that"]


def test_a_failure_met_when_an_action_starts_is_learned_from(tabletop, stand_in, is_at_start):
    skill = stand_in(rule())
    run = Run(skill)
    scene = tabletop("cup mug")
    run.plan(scene, CUP_AWAY)
    skill.blocking = rule(pick_cup=lambda sample, now: {"mug"} if is_at_start(now, "mug") else None)
    changed = shifted(scene, "cup", 0.001)
    failure = run.loop.refine(PICK_CUP, changed, np.random.default_rng(0), Work())
    assert isinstance(failure, RefinementFailure)
    run.loop.learn(failure, changed)
    assert run.learned == ["mug obstructs pick(cup, table)"]
    assert taken(run.plan(changed, CUP_AWAY)) == ["mug", "cup"]


def test_an_action_that_a_stroke_makes_needless_is_left_out(tabletop, stand_in):
    class Broom(stand_in):
        def predict(self, scene, refinement):
            after = super().predict(scene, refinement)
            if refinement.action.name != "wipe":
                return after
            return self._put(self._put(after, "crumb", "dustpan", 1), "grain", "dustpan", 2)

    solution = Run(Broom(rule())).plan(
        tabletop("", "crumb grain"), "(and (in_bin crumb dustpan) (in_bin grain dustpan))"
    )
    assert [action.name for action in solution.plan.actions] == ["pick", "wipe"]


def test_a_sample_that_would_spoil_the_rest_of_the_plan_is_not_chosen(tabletop, stand_in):
    class Careless(stand_in):
        def predict(self, scene, refinement):
            after = super().predict(scene, refinement)
            if refinement.action.args[0] == "crumb" and refinement.sample < 2:
                return after.moved("grain", SE3(np.eye(3), np.array([0.0, 0.0, -0.7])))
            return after

    solution = Run(Careless(rule())).plan(
        tabletop("", "crumb grain"), "(and (in_bin crumb dustpan) (in_bin grain dustpan))"
    )
    wiped = {r.action.args[0]: r.sample for r in solution.refinements if r.action.name == "wipe"}
    assert wiped == {"crumb": 2, "grain": 0}


def test_planning_goes_on_from_what_the_hand_holds(tabletop, stand_in):
    run = Run(stand_in(rule()))
    scene = tabletop("cup", "crumb")
    solution = run.plan(scene, "(in_bin crumb dustpan)")
    holding = solution.scenes[0]
    assert labels(run.plan(holding, "(in_bin crumb dustpan)")) == ["wipe(crumb, table, dustpan)"]
    assert labels(run.plan(holding, CUP_AWAY))[0].startswith("place(sponge, ")


def test_what_is_held_so_that_nothing_can_be_done_with_it_is_put_down_and_taken_up_anew(tabletop, stand_in):
    askew = SE3(pin.rpy.rpyToMatrix(0.0, 0.3, 0.0), np.zeros(3))
    skill = stand_in(rule(wipe_crumb=lambda n, scene: set() if scene.held.X_GO.isApprox(askew) else None))
    scene = replace(tabletop("cup", "crumb"), held=Held("sponge", askew))
    found = labels(Run(skill).plan(scene, "(in_bin crumb dustpan)"))
    assert found[0].startswith("place(sponge, ")
    assert found[1].startswith("pick(sponge, ")
    assert found[2:] == ["wipe(crumb, table, dustpan)"]


def test_what_is_refined_once_is_not_refined_again_in_the_same_scene(tabletop, stand_in, is_at_start):
    def wipe_crumb(sample, scene):
        return {"mug"} if is_at_start(scene, "mug") else None

    skill = stand_in(
        rule(wipe_crumb=wipe_crumb, pick_mug=lambda n, scene: {"jug"} if is_at_start(scene, "jug") else None)
    )
    Run(skill).plan(tabletop("cup mug jug", "crumb"), f"(and {CUP_AWAY} (in_bin crumb dustpan))")
    worked = [(action, len(samples)) for action, samples, _ in skill.calls]
    assert worked.count(("pick(cup, table)", 1)) <= 2


def test_a_domain_with_an_action_that_no_skill_knows_is_refused(stand_in):
    with pytest.raises(PddlError, match="action 'drag' is no primitive, expected one of pick"):
        SearchThenSample(
            PyperplanPlanner(),
            {"pick": stand_in(rule()), "place": stand_in(rule()), "wipe": stand_in(rule())},
            DOMAIN,
            PlanSettings(),
            print,
        )


def test_where_bodies_are_in_the_way_the_grasp_on_what_is_held_is_exchanged_once_a_round(
    tabletop, stand_in, is_at_start
):
    def place_cup(sample, scene):
        return {"mug"} if is_at_start(scene, "mug") else None

    skill = stand_in(rule(place_cup=place_cup))
    run = Run(skill)
    solution = run.plan(tabletop("cup mug"), CUP_AWAY)
    assert taken(solution)[-2:] == ["mug", "cup"]
    assert {event["to"] for event in run.of("backtracked")} <= {str(PICK_CUP), "pick(cup, dustpan)"}
    assert len(run.of("backtracked")) == len(run.rounds) - 1
