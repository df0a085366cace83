"""Planners that crash or talk nonsense, wired in where the real ones are: failures, never a dying run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import skills
from planner.refinement import Work
from planner.search_then_sample import NoPlan, PlanSettings, SearchThenSample, Solution
from planner.task.facts import goal_facts
from planner.task.pddl_reader import read_domain, read_text
from planner.task.pyperplan_ import PyperplanPlanner
from planner.task.symbols import TaskPlan

DOMAIN = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))
GOAL = goal_facts("(in_bin cup right_bin)")


class Faulty:
    """Pyperplan, of whose first answers so many are spoiled."""

    def __init__(self, spoil, times):
        self.real, self.spoil, self.left = PyperplanPlanner(), spoil, times

    def solve(self, domain_text, problem_text, max_expansions):
        found = self.real.solve(domain_text, problem_text, max_expansions)
        if self.left == 0:
            return found
        self.left -= 1
        return self.spoil(found)


def crash(_):
    raise MemoryError("out of memory on purpose")


def without_its_first_step(found):
    return replace(found, steps=found.steps[1:]) if isinstance(found, TaskPlan) else found


def planned(task_planner, skill, scene, heard=None):
    loop = SearchThenSample(
        task_planner,
        dict.fromkeys(("pick", "place", "wipe", *(a.name.split("--")[0] for a in DOMAIN.actions)), skill),
        DOMAIN,
        PlanSettings(tries=5),
        lambda kind, data: None if heard is None else heard.append((kind, data)),
    )
    return loop.plan(scene, GOAL, np.random.default_rng(0), Work())


def nothing_at_all(_):
    return None


def steps_that_are_none(found):
    return replace(found, steps=(None,)) if isinstance(found, TaskPlan) else found


def work_that_is_no_number(found):
    return replace(found, expansions=None)


@pytest.mark.parametrize(
    "spoil", [crash, without_its_first_step, nothing_at_all, steps_that_are_none, work_that_is_no_number]
)
def test_a_task_planner_that_fails_once_is_asked_again(spoil, tabletop, stand_in):
    outcome = planned(Faulty(spoil, 1), stand_in(lambda *_: None), tabletop("cup"))
    assert isinstance(outcome, Solution)
    assert [str(action) for action in outcome.plan.actions] == ["pick(cup, table)", "place(cup, right_bin)"]


class EverySecond(Faulty):
    """Pyperplan, of whose answers every second one is spoiled."""

    def solve(self, domain_text, problem_text, max_expansions):
        self.left = self.left + 1 if self.left < 1 else 0
        found = self.real.solve(domain_text, problem_text, max_expansions)
        return self.spoil(found) if self.left else found


def test_a_task_planner_that_fails_every_second_time_is_asked_until_all_is_learned(tabletop, stand_in, is_at_start):
    def blocking(action, _, scene):
        return {"mug"} if action.args[0] == "cup" and action.name == "pick" and is_at_start(scene, "mug") else None

    outcome = planned(EverySecond(crash, 0), stand_in(blocking), tabletop("cup mug"))
    assert isinstance(outcome, Solution)
    assert outcome.rounds == 4


def test_a_task_planner_that_always_crashes_leads_to_no_plan_that_says_so(tabletop, stand_in):
    outcome = planned(Faulty(crash, -1), stand_in(lambda *_: None), tabletop("cup"))
    assert isinstance(outcome, NoPlan)
    assert outcome.verdict == "budget"
    assert "the task planner failed (MemoryError: out of memory on purpose)" in outcome.reason


def test_a_plan_that_does_not_work_is_not_taken(tabletop, stand_in):
    outcome = planned(Faulty(without_its_first_step, -1), stand_in(lambda *_: None), tabletop("cup"))
    assert isinstance(outcome, NoPlan)
    assert "its plan does not work: step 1, place(cup, right_bin), needs holding(cup)" in outcome.reason


@pytest.mark.crashes
def test_a_refiner_that_crashes_fails_its_action_and_no_more(tabletop, stand_in):
    def broken(action, *_):
        if action.args[-1] == "right_bin":
            raise ZeroDivisionError("on purpose")

    outcome = planned(PyperplanPlanner(), stand_in(broken), tabletop("cup"))
    assert isinstance(outcome, NoPlan)
    assert "working it out crashed, ZeroDivisionError in broken (test_faulty_planners.py:" in outcome.reason
    assert "on purpose" in outcome.reason


@pytest.mark.crashes
@pytest.mark.parametrize("spoilt", [1, 1000])
def test_foreseeing_that_crashes_fails_the_sample_and_is_told(spoilt, tabletop, stand_in):
    class ShortSighted(stand_in):
        def predict(self, scene, refinement):
            if refinement.action.name == "pick" and refinement.sample < spoilt:
                raise KeyError("on purpose")
            return super().predict(scene, refinement)

    heard = []
    outcome = planned(PyperplanPlanner(), ShortSighted(lambda *_: None), tabletop("cup"), heard)
    told = [data for kind, data in heard if kind == "planner_crashed"]
    assert told[0]["action"] == "pick(cup, table)"
    assert "KeyError in predict (test_faulty_planners.py:" in told[0]["crashes"][0]
    if spoilt == 1:
        assert isinstance(outcome, Solution)
        assert outcome.refinements[0].sample == 1
    else:
        assert isinstance(outcome, NoPlan)
        assert "foreseeing its outcome crashed, KeyError" in outcome.reason
