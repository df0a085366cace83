"""A motion planner that crashes now and then costs samples, not actions, and it is told."""

import numpy as np
import pytest

from bt_tamp.executive.build import build_planner
from bt_tamp.executive.seams import Seams
from bt_tamp.options import RunOptions
from bt_tamp.report.events import Event
from bt_tamp.report.sentences import sentence
from bt_tamp.report.story import story
from planner.motion.motion_planner import MotionPlanner
from planner.search_then_sample import NoPlan, Solution
from scenarios.load import load_scenario
from sim.robot import RobotModel
from sim.scene import SceneState

SCENE = load_scenario("fig3")
ROBOT = RobotModel(SCENE.robot.model, SCENE.robot.X_WB)


def crashing(every: int, method: str) -> type[MotionPlanner]:
    """A motion planner that crashes whenever it is asked for so many times once more."""

    class Crashing(MotionPlanner):
        asked = 0

    def answer(self, *args, **kwargs):
        self.asked += 1
        if self.asked % every == 0:
            raise RuntimeError("on purpose")
        return getattr(MotionPlanner, method)(self, *args, **kwargs)

    setattr(Crashing, method, answer)
    return Crashing


def planned(motion: type[MotionPlanner], tries: int | None = None):
    """What comes of planning, and the events told meanwhile."""
    heard = []
    options = RunOptions(seed=0, tries=tries)
    thinker = build_planner(
        SCENE, options, ROBOT, lambda kind, **data: heard.append(Event(kind, 0.0, data)), Seams(motion=motion)
    )
    start = SceneState.initial(SCENE, ROBOT.gripper.stroke)
    rng, work = np.random.default_rng(0), thinker.planner.thinking.work
    return thinker.planner.search.plan(start, thinker.goal, rng, work), heard


@pytest.mark.crashes
@pytest.mark.parametrize(("every", "method"), [(2, "move"), (3, "move"), (7, "timed_line"), (3, "legs")])
def test_a_plan_is_found_although_queries_crash_and_the_story_tells_of_it(every, method):
    outcome, heard = planned(crashing(every, method))
    assert isinstance(outcome, Solution)
    (first, *_) = [event for event in heard if event.kind == "planner_crashed"]
    assert "crashed: RuntimeError in answer (test_crashing_planners.py:" in (sentence(first) or "")
    told = " ".join(story([first], None).split())
    assert "The program crashed in working out" in told
    assert "on purpose" in told


@pytest.mark.crashes
def test_one_that_always_crashes_leads_to_no_plan_that_says_so():
    outcome, _ = planned(crashing(1, "move"), tries=3)
    assert isinstance(outcome, NoPlan)
    assert "working it out crashed, RuntimeError in answer" in outcome.reason
