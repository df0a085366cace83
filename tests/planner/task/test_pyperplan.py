"""Task planning with the real Pyperplan: right, bounded, quiet, and the same in every process."""

import itertools
import json
import logging
import os
import subprocess
import sys
import tempfile
from collections import deque
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import skills
from planner.task.facts import goal_facts, objects_of, observed_facts
from planner.task.pddl import ActionSchema, Domain, Parameter, Problem, write_domain, write_problem
from planner.task.pddl_reader import read_domain, read_text
from planner.task.primitives import ground
from planner.task.pyperplan_ import SEARCHES, PyperplanPlanner
from planner.task.sexpr import PddlError
from planner.task.symbols import Fact, GroundAction, NoTaskPlan, TaskPlan

CATALOGUE = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))


@pytest.fixture
def texts(tabletop):
    """Domain and problem texts for a scene; everything is graspable."""

    def build(scene, goal):
        objects = objects_of(scene)
        graspable = {Fact("graspable", (name,)) for name, kind in objects.items() if kind in ("movable", "tool")}
        facts = observed_facts(scene) | graspable
        return write_domain(CATALOGUE), write_problem(Problem("p", CATALOGUE.name, objects, facts, goal_facts(goal)))

    return build


GOAL = "(and (in_bin cup right_bin) (in_bin crumb dustpan) (in_bin sponge left_bin))"


@pytest.mark.parametrize("search", SEARCHES)
def test_every_search_finds_the_shortest_plan_of_a_small_problem(search, tabletop, texts):
    plan = PyperplanPlanner(search).solve(*texts(tabletop("cup", "crumb"), GOAL), 5000)
    assert isinstance(plan, TaskPlan)
    assert sorted(map(str, plan.actions)) == [
        "pick(cup, table)",
        "pick(sponge, dustpan)",
        "place(cup, right_bin)",
        "place(sponge, left_bin)",
        "wipe(crumb, table, dustpan)",
    ]


def test_steps_carry_what_the_planner_grounded_and_labels_only_own_arguments(tabletop, texts):
    plan = PyperplanPlanner().solve(*texts(tabletop("cup", "crumb"), "(in_bin crumb dustpan)"), 5000)
    pick, wipe = plan.steps
    assert wipe.action == GroundAction("wipe", ("crumb", "table", "dustpan"))
    assert wipe.preconditions == {
        Fact("in_bin", ("crumb", "table")),
        Fact("holding", ("sponge",)),
        Fact("is_sponge", ("sponge",)),
    }
    assert wipe.adds == {Fact("in_bin", ("crumb", "dustpan")), Fact("away", ("crumb",))}
    assert wipe.deletes == {Fact("in_bin", ("crumb", "table"))}
    assert Fact("hand_empty") in pick.deletes


def test_a_variant_of_a_primitive_maps_back_to_it(tabletop, texts):
    plan = PyperplanPlanner().solve(*texts(tabletop("cup"), "(in_bin cup dustpan)"), 5000)
    assert plan.actions[-1] == GroundAction("place", ("cup", "dustpan"))


def test_a_goal_that_holds_needs_no_action(tabletop, texts):
    plan = PyperplanPlanner().solve(*texts(tabletop("cup"), "(in_bin cup table)"), 5000)
    assert plan.steps == ()


@pytest.mark.parametrize("search", SEARCHES)
def test_without_a_plan_the_space_is_exhausted(search, tabletop, texts):
    found = PyperplanPlanner(search).solve(*texts(tabletop("cup", "crumb"), "(in_bin crumb right_bin)"), 5000)
    assert isinstance(found, NoTaskPlan)
    assert found.exhausted


@pytest.mark.parametrize("search", SEARCHES)
def test_the_bound_on_expansions_holds_in_every_search(search, tabletop, texts):
    scene = tabletop("cup mug jug", "crumb")
    goal = GOAL[:-1] + " (in_bin mug left_bin) (in_bin jug right_bin))"
    found = PyperplanPlanner(search).solve(*texts(scene, goal), 4)
    assert found == NoTaskPlan(exhausted=False, expansions=4)


def test_many_objects_are_planned_for_within_few_expansions(tabletop, texts):
    solid = [f"thing{i}" for i in range(12)]
    crumbs = [f"crumb{i}" for i in range(5)]
    goal = "(and " + " ".join(f"(put_away {name})" for name in [*solid, "sponge"])
    goal += " ".join(f"(in_bin {name} dustpan)" for name in crumbs) + ")"
    plan = PyperplanPlanner().solve(*texts(tabletop(" ".join(solid), " ".join(crumbs)), goal), 200)
    assert isinstance(plan, TaskPlan)
    assert len(plan.steps) == 2 * 12 + 5 + 2


def test_an_unknown_search_is_refused():
    with pytest.raises(ValueError, match="unknown search 'magic', expected one of auto"):
        PyperplanPlanner("magic")


def test_a_faulty_text_is_refused_before_pyperplan_sees_it(tabletop, texts):
    domain, problem = texts(tabletop("cup"), "(in_bin cup right_bin)")
    with pytest.raises(PddlError, match=r"problem:.*unknown object 'mug'"):
        PyperplanPlanner().solve(domain, problem.replace("(in_bin cup right_bin)", "(in_bin mug right_bin)"), 100)


def test_planning_leaves_the_root_logger_and_the_temporary_folder_alone(tabletop, texts, capfd, monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    root = logging.getLogger()
    before = root.level, list(root.handlers)
    for handler in before[1]:
        root.removeHandler(handler)
    try:
        PyperplanPlanner().solve(*texts(tabletop("cup", "crumb"), GOAL), 5000)
        assert root.handlers == []
    finally:
        for handler in before[1]:
            root.addHandler(handler)
    assert root.level == before[0]
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []


SCRIPT = """
import json, sys
from planner.task.pyperplan_ import PyperplanPlanner
for search, (domain, problem) in json.load(sys.stdin):
    plan = PyperplanPlanner(search).solve(domain, problem, 2000)
    print(search, plan.expansions, *map(str, plan.actions), sep=";")
"""


def test_the_plan_does_not_depend_on_the_hash_seed(tabletop, texts):
    bins = ("left_bin", "right_bin", "third_bin")
    few = texts(tabletop("cup", "crumb grain", bins), "(and (put_away cup) (in_bin crumb dustpan) (put_away sponge))")
    goal = "(and (put_away cup) (put_away mug) (put_away pot) (in_bin crumb dustpan) (put_away sponge) (holding jug))"
    many = texts(tabletop("cup mug jug pot", "crumb grain", bins), goal)
    tasks = [("auto", few), ("astar-hmax", few), ("auto", many), ("wastar-hff", many), ("gbfs-hff", many)]
    root = Path(skills.__file__).parents[1]
    processes = []
    for seed in ("0", "1", "4321"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(root)}
        process = subprocess.Popen(
            [sys.executable, "-c", SCRIPT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )
        processes.append(process)
    outputs = {process.communicate(json.dumps(tasks))[0] for process in processes}
    assert len(outputs) == 1
    assert len(outputs.pop().splitlines()) == len(tasks)


@st.composite
def tasks(draw):
    """A small task: typed objects, up to three actions over a few predicates, constants among the arguments."""
    types = {"block": "object", "small": "block", "place": "object"}
    kinds = ["object", *types]
    names = ["a", "b", "c"]
    objects = {name: draw(st.sampled_from(kinds)) for name in names}
    constants = {"k": draw(st.sampled_from(kinds))}
    predicates = {
        name: tuple(Parameter(f"?p{i}", draw(st.sampled_from(kinds))) for i in range(count))
        for name, count in (("p", 1), ("q", 2), ("r", 0), ("s", 1))
    }
    frame = Domain("d", types, constants, predicates, ())
    actions = []
    for number in range(draw(st.integers(1, 3))):
        own = tuple(Parameter(f"?x{i}", draw(st.sampled_from(kinds))) for i in range(draw(st.integers(0, 2))))
        pool = statable(frame, {**constants, **{parameter.name: parameter.type for parameter in own}})
        parts = [tuple(draw(st.lists(st.sampled_from(pool), unique=True, max_size=2))) for _ in range(3)]
        actions.append(ActionSchema(f"act{number}", own, *parts))
    pool = statable(frame, {**constants, **objects})
    init, goal = (frozenset(draw(st.lists(st.sampled_from(pool), max_size=4))) for _ in range(2))
    domain = Domain("d", types, constants, predicates, tuple(actions))
    return domain, Problem("t", "d", objects, init, goal)


def statable(domain, terms):
    """Every literal that fits the types of the terms."""
    found = []
    for name, parameters in domain.predicates.items():
        fitting = [[term for term in terms if domain.is_kind(terms[term], p.type)] for p in parameters]
        found += [Fact(name, args) for args in itertools.product(*fitting)]
    return found


def shortest(domain, problem):
    """Length of the shortest plan by breadth-first search over all ground steps, None if there is none."""
    terms = {**domain.constants, **problem.objects}
    steps = []
    for schema in domain.actions:
        fitting = [[t for t in terms if domain.is_kind(terms[t], p.type)] for p in schema.parameters]
        steps += [ground(schema, args) for args in itertools.product(*fitting)]
    queue, seen = deque([(problem.init, 0)]), {problem.init}
    while queue:
        facts, length = queue.popleft()
        if problem.goal <= facts:
            return length
        for step in steps:
            after = step.apply(facts)
            if step.applicable(facts) and after not in seen:
                seen.add(after)
                queue.append((after, length + 1))
    return None


@settings(max_examples=80, derandomize=True, deadline=None)
@given(tasks())
def test_what_the_checker_lets_through_pyperplan_understands_as_meant(task):
    domain, problem = task
    expected = shortest(domain, problem)
    for search in ("astar-hmax", "gbfs-hff"):
        found = PyperplanPlanner(search).solve(write_domain(domain), write_problem(problem), 100_000)
        if expected is None:
            assert found == NoTaskPlan(True, found.expansions)
        else:
            assert isinstance(found, TaskPlan)
            assert len(found.steps) == expected if search == "astar-hmax" else len(found.steps) >= expected
