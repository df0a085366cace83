"""Laws of the loop over made-up obstacle courses: it ends, it is right, and it finds what there is."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import skills
from planner.refinement import Work
from planner.search_then_sample import NoPlan, PlanSettings, SearchThenSample, Solution
from planner.task.facts import goal_facts, observed_facts
from planner.task.pddl_reader import read_domain, read_text
from planner.task.pyperplan_ import PyperplanPlanner

ROOT = Path(skills.__file__).parents[1]
DOMAIN = read_domain(read_text(ROOT / "skills" / "domain.pddl"))
NAMES = ("jug", "mug", "pot", "cup")
PRIMITIVES = ("pick", "place", "wipe", "drag", "drag_aside")


class Course:
    """Who has to be away before whom can be taken: for every object, one set a sample, drawn by hypothesis."""

    def __init__(self, needs, reveals, is_at_start):
        self.needs, self.reveals, self.is_at_start = needs, reveals, is_at_start

    def __call__(self, action, sample, scene):
        if action.name in ("drag", "drag_aside"):
            return set()
        if action.name != "pick" or action.args[0] not in self.needs or sample >= 3:
            return set() if action.name == "pick" and sample >= 3 else None
        there = sorted(n for n in self.needs[action.args[0]][sample] if self.is_at_start(scene, n))
        return set(there[: self.reveals]) or None


def search(skill, events, **options):
    report = lambda kind, data: events.append((kind, data))  # noqa: E731
    settings_ = PlanSettings(**{"tries": 3, "widenings": 1, "max_rounds": 60, **options})
    return SearchThenSample(PyperplanPlanner("wastar-hff"), dict.fromkeys(PRIMITIVES, skill), DOMAIN, settings_, report)


def replayed(scene, solution, course):
    """Do the steps apply one after the other, is every sample free in its scene, and is the goal reached?"""
    scenes = (scene, *solution.scenes)
    for step, refinement, before in zip(solution.plan.steps, solution.refinements, scenes, strict=False):
        observed = {f for f in step.preconditions if f.predicate in ("in_bin", "holding", "hand_empty")}
        assert observed <= observed_facts(before)
        assert course(step.action, refinement.sample, before) is None
    assert solution.plan.goal <= observed_facts(scenes[-1])


def feasible(needs):
    """Can the cup be taken in the end, taking away whatever can be taken?"""
    gone: set[str] = set()
    while True:
        free = {name for name in NAMES if name not in gone and any(s <= gone for s in needs[name])}
        if not free:
            return False
        if "cup" in free:
            return True
        gone |= free


needs_of = {
    name: st.lists(st.frozensets(st.sampled_from([n for n in NAMES if n != name])), min_size=3, max_size=3)
    for name in NAMES
}


@settings(max_examples=25, derandomize=True, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(needs=st.fixed_dictionaries(needs_of), reveals=st.sampled_from([1, 9]))
def test_a_plan_is_found_exactly_if_there_is_one(tabletop, stand_in, is_at_start, needs, reveals):
    course = Course(needs, reveals, is_at_start)
    scene, events = tabletop("jug mug pot cup"), []
    outcome = search(stand_in(course), events).plan(
        scene, goal_facts("(in_bin cup right_bin)"), np.random.default_rng(0), Work()
    )
    if feasible(needs):
        assert isinstance(outcome, Solution), outcome
        replayed(scene, outcome, course)
    else:
        assert isinstance(outcome, NoPlan)
        assert outcome.verdict == "budget"


def told(tabletop, stand_in, is_at_start):
    """Everything that the loop reports of one obstacle course."""
    needs = {
        "cup": [{"jug", "mug"}, {"pot", "mug"}, {"jug", "pot"}],
        "mug": [{"pot"}] * 3,
        "pot": [set()] * 3,
        "jug": [{"mug"}, {"pot"}, {"pot"}],
    }
    events = []
    loop = search(stand_in(Course(needs, 1, is_at_start)), events)
    goal = goal_facts("(and (in_bin cup right_bin) (in_bin crumb dustpan))")
    loop.plan(tabletop("jug mug pot cup", "crumb"), goal, np.random.default_rng(0), Work())
    return events


SCRIPT = """
import sys
sys.path[:0] = sys.argv[1:]
import conftest
import test_search_then_sample_laws as laws
print(laws.told(conftest.tabletop_scene, conftest.StandIn, conftest.lies_at_start))
"""


def test_events_and_texts_do_not_depend_on_the_hash_seed():
    command = [sys.executable, "-c", SCRIPT, str(ROOT), str(Path(__file__).parent)]
    processes = [
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONHASHSEED": seed})
        for seed in ("0", "77")
    ]
    texts = {process.communicate()[0] for process in processes}
    assert len(texts) == 1
    assert "solved" in texts.pop()
