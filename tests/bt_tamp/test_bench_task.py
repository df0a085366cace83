"""The courses of `bench task` are what they claim to be, and the searches beside the default one do what they say."""

from dataclasses import replace
from pathlib import Path

import pytest

import skills
from bt_tamp.bench.courses import Course, StandIn, random_course
from bt_tamp.bench.enumeration import first_that_works, plans
from bt_tamp.bench.fast_downward import is_there, prove
from bt_tamp.bench.plots import PLOTS
from bt_tamp.bench.task import TaskResult, acceptance, plan_course
from planner.refinement import Budget, Hints
from planner.task.facts import goal_facts
from planner.task.pddl_reader import read_domain, read_text
from planner.task.symbols import GroundAction

DOMAIN = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))
NOTHING = frozenset()


def course(solids, crumbs="", goal="(put_away a)", flat="", **needs):
    ways = {name: tuple(frozenset(way.split()) for way in text.split("|")) for name, text in needs.items()}
    return Course(0, tuple(solids.split()), tuple(crumbs.split()), ways, frozenset(flat.split()), goal)


@pytest.mark.parametrize(
    ("shortest", "made"),
    [
        (4, course("a")),
        (6, course("b a", a="b")),
        (8, course("c b a", a="b c | b c")),
        (6, course("c b a", a="b c | b")),
        (5, course("b a", a="b", flat="b")),
        (5, course("a", flat="a")),
        (5, course("a", "c", "(and (put_away a) (in_bin c dustpan))", c="a")),
        (8, course("c b a", a="b", b="c")),
    ],
)
def test_the_shortest_plan_is_that_of_the_whole_search(shortest, made):
    goal = made.goal[5:-1] if made.goal.startswith("(and") else made.goal
    made = replace(made, goal=f"(and {goal} (put_away sponge))")
    assert made.shortest() == shortest
    assert plan_course(DOMAIN, made, "astar-hmax").steps == shortest


@pytest.mark.parametrize("size", [2, 3, 6, 12])
def test_a_random_course_can_be_solved_and_no_plan_is_shorter_than_the_shortest(size):
    for seed in range(3 if size < 10 else 1):
        made = random_course(size, seed)
        assert made.size == size
        tally = plan_course(DOMAIN, made, "auto")
        assert tally.steps is not None
        assert tally.steps >= made.shortest()
        assert len(tally.calls) == tally.rounds
    assert random_course(size, 0) == random_course(size, 0)


def test_the_stand_in_names_what_is_in_the_way_until_it_lies_elsewhere():
    made = course("b a", a="b", flat="b")
    stand_in, scene = StandIn(made), made.scene()
    pick, drag = GroundAction("pick", ("a", "table")), GroundAction("drag", ("b", "table"))
    assert stand_in.blocking(pick, 0, scene) == {"b"}
    assert stand_in.blocking(GroundAction("pick", ("b", "table")), 0, scene) == NOTHING
    assert stand_in.blocking(GroundAction("drag", ("a", "table")), 0, scene) == NOTHING
    refined = stand_in.refine(drag, scene, None, Budget(), Hints())
    after = stand_in.predict(scene, refined)
    assert stand_in.blocking(pick, 0, after) is None


def test_plans_are_enumerated_the_shorter_first_and_each_once():
    made = course("a", goal="(and (put_away a) (put_away sponge))")
    found = list(plans(DOMAIN, made.scene(), goal_facts(made.goal), 300))
    lengths = [len(steps) for steps in found]
    assert lengths[0] == 4
    assert lengths == sorted(lengths)
    assert len(set(found)) == len(found) > 10


def test_without_learning_plans_are_tried_until_one_happens_to_work():
    made = course("b a", a="b", goal="(put_away a)")
    length, tried = first_that_works(DOMAIN, made, 20_000, Budget())
    assert length == 4
    assert tried > 1
    assert first_that_works(DOMAIN, made, 3, Budget()) == (None, 0)


def test_beyond_its_bound_a_search_is_given_up():
    tally = plan_course(DOMAIN, random_course(8, 0), "astar-hmax", max_expansions=50, widenings=0)
    assert tally.steps is None


FINE = TaskResult(30, 0, 50, 51, 9, (0.1, 0.2), None, None, None, None, None, None, False, None)


@pytest.mark.parametrize(
    ("bad", "missed"),
    [
        ({"steps": None}, ["courses with a plan", "30 objects: longer than the shortest plan by"]),
        ({"steps": 53}, ["30 objects: longer than the shortest plan by"]),
        ({"calls": (0.2, 0.4, 0.2)}, ["30 objects: CPU time of the longest call"]),
        ({}, []),
    ],
)
def test_each_figure_is_missed_by_one_bad_course(bad, missed):
    judged = acceptance([FINE, replace(FINE, **bad)])
    assert [check.figure for check in judged if not check.reached] == missed


def test_task_plots_are_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    made = PLOTS["task"](tmp_path, [FINE, replace(FINE, size=2, hmax_steps=4, hmax_cpu=0.1)])
    assert [path.name for path in made] == ["task.png"]


@pytest.mark.skipif(not is_there(), reason="needs the extra bench")
def test_fast_downward_proves_the_length_of_a_small_plan():
    made = random_course(3, 0)
    proof = prove(*plan_course(DOMAIN, made, "auto").last)
    assert proof.is_optimal
    assert proof.at_least <= made.shortest()
