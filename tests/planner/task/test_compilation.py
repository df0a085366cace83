"""Learned constraints as PDDL, as Pyperplan understands them."""

from pathlib import Path

import pytest

import skills
from planner.task.compilation import with_constraints
from planner.task.facts import goal_facts, objects_of, observed_facts
from planner.task.pddl import Problem, write_domain, write_problem
from planner.task.pddl_reader import read_domain, read_problem, read_text
from planner.task.primitives import ground, own_parameters, primitive, with_away
from planner.task.pyperplan_ import PyperplanPlanner
from planner.task.situation import Spot
from planner.task.symbols import Fact, GroundAction, NoTaskPlan, TaskPlan

CATALOGUE = with_away(read_domain(read_text(Path(skills.__file__).parent / "domain.pddl")))
PICK_CUP = GroundAction("pick", ("cup", "table"))
DRAG_CUP = GroundAction("drag", ("cup", "table"))


@pytest.fixture
def problem(tabletop):
    """A problem in which everything is graspable; `in_the_way` isn't away at first, `stuck` may be dragged."""

    def build(solid, goal, in_the_way="", stuck=""):
        scene = tabletop(solid, "crumb")
        objects = objects_of(scene)
        things = {name for name, kind in objects.items() if kind in ("movable", "tool", "crumb")}
        facts = {Fact("graspable", (name,)) for name in things if objects[name] != "crumb"}
        facts |= {Fact("away", (name,)) for name in things - set(in_the_way.split())}
        facts |= {Fact("stuck", (name,)) for name in stuck.split()}
        return Problem("p", CATALOGUE.name, objects, observed_facts(scene) | facts, goal_facts(goal))

    return build


def planned(problem, constraints):
    domain, stated = with_constraints(CATALOGUE, problem, constraints)
    found = PyperplanPlanner().solve(write_domain(domain), write_problem(stated), 20_000)
    return [str(action) for action in found.actions] if isinstance(found, TaskPlan) else found


def options(*sets):
    return frozenset(frozenset(spot if isinstance(spot, Spot) else Spot(spot) for spot in s) for s in sets)


def test_without_constraints_nothing_changes(problem):
    stated = problem("cup", "(holding cup)")
    assert with_constraints(CATALOGUE, stated, {}) == (CATALOGUE, stated)


def test_a_constrained_action_waits_until_its_culprits_are_away(problem):
    plan = planned(problem("cup mug", "(holding cup)", "mug"), {PICK_CUP: options({"mug"})})
    assert plan[0] == "pick(mug, table)"
    assert plan[-1] == "pick(cup, table)"


def test_all_of_a_set_must_be_away(problem):
    plan = planned(problem("cup mug jug", "(holding cup)", "mug jug"), {PICK_CUP: options({"mug", "jug"})})
    assert {"pick(mug, table)", "pick(jug, table)"} <= set(plan)


def test_any_one_of_the_sets_is_enough(problem):
    plan = planned(
        problem("cup mug jug pot", "(holding cup)", "mug jug pot"), {PICK_CUP: options({"mug", "jug"}, {"pot"})}
    )
    assert plan[0] == "pick(pot, table)"
    assert len(plan) == 3


def test_every_minimal_set_gets_one_variant_with_the_parameters_of_its_schema(problem):
    stated = problem("cup mug jug", "(holding cup)", "mug jug")
    domain, _ = with_constraints(CATALOGUE, stated, {PICK_CUP: options({"mug"}, {"jug"})})
    picks = [schema for schema in domain.actions if primitive(schema.name) == "pick"]
    plain = picks[0]
    assert [schema.name for schema in picks] == ["pick", "pick--1", "pick--2"]
    assert all(schema.parameters == plain.parameters for schema in picks)
    assert {s.preconditions[-1] for s in picks[1:]} == {Fact("away", ("mug",)), Fact("away", ("jug",))}
    untouched = [schema for schema in domain.actions if primitive(schema.name) != "pick"]
    assert untouched == [schema for schema in CATALOGUE.actions if schema.name != "pick"]


def test_instances_with_the_same_needs_share_a_variant(problem):
    stated = problem("cup mug jug", "(holding cup)", "jug")
    both = {action: options({"jug"}) for action in (PICK_CUP, GroundAction("pick", ("mug", "table")))}
    domain, _ = with_constraints(CATALOGUE, stated, both)
    assert [schema.name for schema in domain.actions if primitive(schema.name) == "pick"] == ["pick", "pick--1"]


def test_other_instances_of_the_schema_stay_free(problem):
    stated = problem("cup mug", "(and (in_bin cup right_bin) (in_bin mug right_bin))", "mug")
    domain, compiled = with_constraints(CATALOGUE, stated, {PICK_CUP: frozenset()})
    assert isinstance(planned(stated, {PICK_CUP: frozenset()}), NoTaskPlan)
    plain = next(schema for schema in domain.actions if schema.name == "pick")
    allowed = {fact.args for fact in compiled.init if fact.predicate == "may--pick"}
    assert ("mug", "table") in allowed
    assert ("cup", "left_bin") in allowed
    assert ("cup", "table") not in allowed
    assert Fact("may--pick", tuple(p.name for p in own_parameters(plain))) in plain.preconditions


def test_a_place_is_left_by_every_action_that_moves_the_body_but_the_one_that_put_it_there(problem):
    constraints = {PICK_CUP: options({Spot("cup", DRAG_CUP)})}
    stated = problem("cup", "(holding cup)", stuck="cup")
    assert planned(stated, constraints) == ["pick(cup, table)"]
    dragged = problem("cup mug", "(holding cup)", in_the_way="cup", stuck="cup")
    both = {PICK_CUP: options({Spot("cup", DRAG_CUP), "cup"})}
    assert isinstance(planned(dragged, both), NoTaskPlan)


def test_a_body_put_somewhere_by_the_plan_may_still_be_put_elsewhere(problem):
    wipe = GroundAction("wipe", ("crumb", "table", "dustpan"))
    aside = [Spot("cup", GroundAction("place", ("cup", place))) for place in ("table", "left_bin", "dustpan")]
    stated = problem("cup", "(in_bin crumb dustpan)", in_the_way="cup")
    plan = planned(stated, {wipe: options({"cup", *aside})})
    assert "place(cup, right_bin)" in plan


def test_a_body_swept_along_by_an_action_is_stated_to_be_there(problem):
    wipe = GroundAction("wipe", ("crumb", "table", "dustpan"))
    place = GroundAction("place", ("sponge", "left_bin"))
    stated = problem("cup", "(and (in_bin crumb dustpan) (in_bin sponge left_bin))")
    assert isinstance(planned(stated, {place: options({Spot("cup", wipe)})}), TaskPlan | list)
    domain, _ = with_constraints(CATALOGUE, stated, {place: options({Spot("cup", wipe)})})
    variant = next(schema for schema in domain.actions if schema.name == "wipe--1")
    step = ground(variant, ("crumb", "table", "dustpan", "sponge"))
    assert Fact("left--0--wipe-crumb-table-dustpan", ("cup",)) in step.deletes


def test_a_culprit_that_the_problem_does_not_know_can_not_be_moved(problem):
    stated = problem("cup mug", "(holding cup)")
    assert isinstance(planned(stated, {PICK_CUP: options({"ghost"}, {"ghost", "mug"})}), NoTaskPlan)


def test_the_compiled_texts_are_read_as_they_were_meant(problem):
    stated = problem("cup mug", "(holding cup)", "mug")
    constraints = {PICK_CUP: options({"mug"}, {Spot("cup", DRAG_CUP), "cup"})}
    domain, compiled = with_constraints(CATALOGUE, stated, constraints)
    read = read_domain(write_domain(domain))
    assert read == domain
    assert read_problem(write_problem(compiled), read) == compiled
