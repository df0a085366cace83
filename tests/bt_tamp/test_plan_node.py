"""When the planner node plans, and when what it found counts, with a scripted planner in the place of the real one."""

from types import SimpleNamespace

import numpy as np
import pytest
from pinocchio import SE3
from py_trees.common import Status

from bt_tamp.executive.plan_node import PATIENCE, SECOND_LOOK, PlanNode, Thinking
from planner.refinement import Work
from planner.search_then_sample import NoPlan
from planner.task.symbols import Fact

TICK = 0.02
GOAL = frozenset({Fact("in_bin", ("can", "crate"))})


class World:
    """A can somewhere, fingers that may move, and a planner that finds nothing; `plans`: when it was asked."""

    def __init__(self, has_begun):
        self.t, self.x, self.fingers, self.plans = 0.0, 0.5, 0.0, []
        self.context = SimpleNamespace(failure=None, report=lambda *_, **__: None)
        self.agenda = SimpleNamespace(
            has_begun=has_begun,
            has_put_off=False,
            put_off=frozenset(),
            plan=None,
            pursued=lambda _: GOAL,
            facts=lambda _: frozenset(),
            missing=lambda _: (),
            review=lambda _: "there is no plan yet",
            drop=lambda: None,
        )
        self.planner = SimpleNamespace(thinking=Thinking(Work()), plan=self._plan)
        self._look()
        self.node = PlanNode(self.planner, self.agenda, self.context)

    def _plan(self, scene, agenda):
        self.plans.append(round(self.t, 3))
        return NoPlan("budget", "nothing was found", frozenset(), 1)

    def _look(self):
        here = SE3(np.eye(3), np.array([self.x, 0.0, 0.1]))
        self.context.scene = SimpleNamespace(
            poses={"can": here}, held=None, scenario=SimpleNamespace(regions={}, bodies={"can": None})
        )
        self.context.observation = SimpleNamespace(
            t=self.t, velocities={"can": np.zeros(6)}, opening_velocity=self.fingers
        )

    def tick(self, seconds=TICK):
        for _ in range(round(seconds / TICK)):
            self._look()
            self.node.tick_once()
            self.t += TICK
        return self.node.status


def test_before_anything_has_moved_no_plan_is_a_verdict_at_once():
    world = World(has_begun=False)
    assert world.tick() is Status.FAILURE
    assert world.planner.thinking.verdict.reason == "nothing was found"


def test_at_work_no_plan_is_a_verdict_once_nothing_has_changed_for_a_moment():
    world = World(has_begun=True)
    assert world.tick(SECOND_LOOK - TICK) is Status.RUNNING
    assert world.planner.thinking.verdict is None
    assert world.tick(2 * TICK) is Status.FAILURE
    assert len(world.plans) == 1


def test_what_shifts_before_the_verdict_is_given_is_planned_for_anew():
    world = World(has_begun=True)
    world.tick(SECOND_LOOK / 2)
    world.x += 0.05
    assert world.tick(SECOND_LOOK - TICK) is Status.RUNNING
    assert len(world.plans) == 2
    assert world.planner.thinking.verdict is None
    world.tick(4 * TICK)
    assert world.planner.thinking.verdict is not None


@pytest.mark.parametrize("speed", [0.03, -0.03])
def test_while_the_fingers_move_nothing_is_planned(speed):
    world = World(has_begun=False)
    world.fingers = speed
    assert world.tick(0.5) is Status.RUNNING
    assert world.plans == []
    world.fingers = 0.0
    world.tick()
    assert len(world.plans) == 1


def test_fingers_that_never_come_to_rest_are_not_waited_for_for_ever():
    world = World(has_begun=False)
    world.fingers = 0.03
    world.tick(PATIENCE + 2 * TICK)
    assert len(world.plans) == 1
