"""The loop between task planner and refinement, with a stand-in for the skills and the real Pyperplan."""

from pathlib import Path

import numpy as np
import pytest

import skills
from planner.refinement import Work
from planner.search_then_sample import PlanSettings, SearchThenSample, Solution
from planner.task.facts import goal_facts, place_of
from planner.task.pddl_reader import read_domain, read_text
from planner.task.pyperplan_ import PyperplanPlanner
from scenarios.load import load_scenario
from sim.scene import SceneState

DOMAIN = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))
PRIMITIVES = ("pick", "place", "wipe", "drag")


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
        return [event["plan"] for event in self.of("round") if not event["proofs_only"]]

    @property
    def learned(self):
        return [event["sentence"] for event in self.of("learned")]


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
    assert "book cannot be grasped as it lies: drag it first" in run.learned
    assert reached(solution, scene.scenario.goal)
