"""The validator that judges the plans of all tests: does it see the same task, and can it say no?"""

import warnings
from dataclasses import replace

import pytest
from unified_planning.io import PDDLReader

from planner.task.pddl_reader import read_domain, read_problem
from planner.task.pyperplan_ import PyperplanPlanner

DOMAIN = """(define (domain tidy)
  (:requirements :strips :typing)
  (:types thing spot - object box - spot)
  (:constants shelf - spot)
  (:predicates (at ?o - thing ?s - spot) (held ?o - thing) (free) (blocked ?o - thing))
  (:action take :parameters (?o - thing ?s - spot)
    :precondition (and (at ?o ?s) (free)) :effect (and (held ?o) (not (at ?o ?s)) (not (free))))
  (:action put :parameters (?o - thing ?s - box)
    :precondition (and (held ?o)) :effect (and (at ?o ?s) (free) (not (held ?o)))))
"""
PROBLEM = """(define (problem p) (:domain tidy) (:objects cup mug - thing crate - box)
  (:init (at cup shelf) (at mug shelf) (free)) (:goal (and (at cup crate) (at mug crate))))
"""


@pytest.fixture
def judge(pytestconfig, request):
    """The functions of the root's conftest."""
    return next(p for p in pytestconfig.pluginmanager.get_plugins() if hasattr(p, "assert_valid"))


def test_the_task_that_is_judged_is_the_one_that_unified_planning_reads(judge):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        read = PDDLReader().parse_problem_string(DOMAIN, PROBLEM)
    domain = read_domain(DOMAIN)
    mine = judge.restated(domain, read_problem(PROBLEM, domain))
    actions = [str(action).replace(" - object", "") for action in mine.actions]  # There, `object` is no type.
    assert sorted(actions) == sorted(map(str, read.actions))
    assert values(mine) == values(read)
    assert [set(map(str, goal.args)) for goal in mine.goals] == [set(map(str, goal.args)) for goal in read.goals]


def values(task):
    return {str(fluent): str(value) for fluent, value in task.initial_values.items()}


def test_a_plan_with_a_step_left_out_or_in_another_order_is_not_valid(judge):
    plan = PyperplanPlanner().solve(DOMAIN, PROBLEM, 100)
    judge.assert_valid(DOMAIN, PROBLEM, plan)
    steps = plan.steps
    for spoiled in (steps[:-1], steps[1:], (steps[1], steps[0], *steps[2:]), ()):
        with pytest.raises(AssertionError, match=r"take|INVALID"):
            judge.assert_valid(DOMAIN, PROBLEM, replace(plan, steps=spoiled))
