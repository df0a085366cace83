"""Which bins a plan fills."""

from collections import Counter
from pathlib import Path

import pytest

import skills
from planner.sharing import shared_out
from planner.task.compilation import with_constraints
from planner.task.facts import facts, goal_facts, objects_of
from planner.task.learned import Learned
from planner.task.pddl import Problem, write_domain, write_problem
from planner.task.pddl_reader import read_domain, read_text
from planner.task.primitives import with_away
from planner.task.pyperplan_ import PyperplanPlanner
from planner.task.situation import Spot
from planner.task.symbols import GroundAction, flaw

DOMAIN = with_away(read_domain(read_text(Path(skills.__file__).parent / "domain.pddl")))
SIX = "cup mug jug pot tin box"


@pytest.fixture
def shared(tabletop):
    """The task planner's plan for a table with six things and the one that is shared out, checked for flaws."""

    def plan(goal, constraints=None):
        scene = tabletop(SIX)
        stated = Problem("p", DOMAIN.name, objects_of(scene), facts(scene, Learned(DOMAIN)), goal_facts(goal))
        domain, problem = with_constraints(DOMAIN, stated, constraints or {})
        found = PyperplanPlanner().solve(write_domain(domain), write_problem(problem), 10_000)
        outcome = shared_out(found, domain, problem)
        assert flaw(outcome, problem.init, problem.goal) is None
        assert [(s.action.name, s.action.args[0]) for s in outcome.steps] == [
            (s.action.name, s.action.args[0]) for s in found.steps
        ]
        return outcome

    return plan


def places(plan):
    return {action.args[0]: action.args[1] for action in plan.actions if action.name == "place"}


def test_one_bin_is_filled_as_much_as_the_other(shared):
    found = places(shared(f"(and {' '.join(f'(put_away {name})' for name in SIX.split())})"))
    assert Counter(found.values()) == {"left_bin": 3, "right_bin": 3}


def test_what_belongs_somewhere_goes_there_and_the_rest_makes_up_for_it(shared):
    goal = "(and (in_bin cup left_bin) (in_bin mug left_bin) (put_away jug) (put_away pot))"
    found = places(shared(goal))
    assert found["cup"] == found["mug"] == "left_bin"
    assert Counter(found.values()) == {"left_bin": 2, "right_bin": 2}


def test_what_is_known_not_to_work_is_not_chosen(shared):
    never = {GroundAction("place", (name, "right_bin")): frozenset() for name in ("cup", "mug", "jug")}
    found = places(shared("(and (put_away cup) (put_away mug) (put_away jug) (put_away pot))", never))
    assert {found[name] for name in ("cup", "mug", "jug")} == {"left_bin"}
    assert found["pot"] == "right_bin"


def test_what_the_plan_itself_puts_in_the_way_elsewhere_counts(shared):
    placing = GroundAction("place", ("mug", "right_bin"))
    needs = frozenset({frozenset({Spot("mug", placing)})})
    found = places(shared("(and (put_away cup) (put_away mug))", {GroundAction("pick", ("cup", "table")): needs}))
    assert set(found) == {"cup", "mug"}


def test_crumbs_and_table_are_left_alone(tabletop):
    scene = tabletop("cup", "crumb")
    goal = goal_facts("(and (in_bin crumb dustpan) (in_bin cup table))")
    problem = Problem("p", DOMAIN.name, objects_of(scene), facts(scene, Learned(DOMAIN)), goal)
    found = PyperplanPlanner().solve(write_domain(DOMAIN), write_problem(problem), 10_000)
    assert shared_out(found, DOMAIN, problem) == found
