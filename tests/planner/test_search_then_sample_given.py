"""The loop on hand-written PDDL."""

from pathlib import Path

import numpy as np
import pytest

import skills
from planner.refinement import Work
from planner.search_then_sample import NoPlan, PlanSettings, SearchThenSample, Solution
from planner.task.given import read_given
from planner.task.pddl_reader import read_domain, read_text
from planner.task.primitives import arities
from planner.task.pyperplan_ import PyperplanPlanner

PRIMITIVES = arities(read_domain(read_text(Path(skills.__file__).parent / "domain.pddl")))

DOMAIN = """(define (domain kitchen)
  (:types thing spot - object)
  (:predicates (in_bin ?x - thing ?y - spot) (hand_empty) (holding ?x - thing) (is_sponge ?x - thing)
    (clean ?y - spot) (wet ?x - thing) (small ?x - thing))
  (:action pick :parameters (?x - thing ?y - spot)
    :precondition (and (in_bin ?x ?y) (hand_empty))
    :effect (and (holding ?x) (not (in_bin ?x ?y)) (not (hand_empty))))
  (:action place :parameters (?x - thing ?y - spot)
    :precondition (holding ?x)
    :effect (and (in_bin ?x ?y) (hand_empty) (not (holding ?x))))
  (:action wipe--wet :parameters (?x - thing ?from - spot ?to - spot ?tool - thing)
    :precondition (and (small ?x) (in_bin ?x ?from) (holding ?tool) (is_sponge ?tool) (wet ?tool))
    :effect (and (in_bin ?x ?to) (clean ?from) (not (in_bin ?x ?from)))))
"""
PROBLEM = """(define (problem own)
  (:domain kitchen)
  (:objects crumb sponge {more} - thing table dustpan left_bin - spot)
  (:init (in_bin crumb table) (in_bin sponge dustpan) (hand_empty) (is_sponge sponge) (wet sponge) (small crumb))
  (:goal (and (clean table) (in_bin crumb dustpan))))
"""


@pytest.fixture
def outcome(tabletop, stand_in, is_at_start, tmp_path):
    """Plans the kitchen problem with further objects named in it; the mug obstructs the stroke."""

    def plan(more):
        files = tmp_path / "domain.pddl", tmp_path / "problem.pddl"
        files[0].write_text(DOMAIN)
        files[1].write_text(PROBLEM.format(more=more))
        scene = tabletop("mug cup", "crumb")
        domain, given = read_given(*files, PRIMITIVES, scene)

        def blocking(action, sample, now):
            return {"mug"} if action.name == "wipe" and is_at_start(now, "mug") else None

        refiners = dict.fromkeys(PRIMITIVES, stand_in(blocking))
        loop = SearchThenSample(
            PyperplanPlanner(), refiners, domain, PlanSettings(tries=4, widenings=1), lambda *_: None, given
        )
        return loop, scene, loop.plan(scene, given.problem.goal, np.random.default_rng(0), Work())

    return plan


def test_learned_constraints_are_compiled_into_hand_written_pddl(outcome):
    _, _, solution = outcome("mug")
    assert isinstance(solution, Solution)
    assert str(solution.plan.actions[0]) == "pick(mug, table)"
    assert str(solution.plan.actions[-1]) == "wipe(crumb, table, dustpan)"


def test_the_steps_apply_to_the_facts_of_hand_written_pddl(outcome):
    loop, scene, solution = outcome("mug")
    facts = loop.facts(scene)
    for step in solution.plan.steps:
        assert step.applicable(facts)
        facts = step.apply(facts)
    assert solution.plan.goal <= facts


def test_what_hand_written_pddl_does_not_name_can_be_in_the_way_but_not_be_moved(outcome):
    _, _, found = outcome("cup")
    assert isinstance(found, NoPlan)
    assert (found.verdict, found.culprits) == ("budget", {"mug"})
