"""What the root tree means, with scripted skills and a scripted planner in the places of the real ones."""

from types import SimpleNamespace

import numpy as np
import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from bt_tamp.executive.agenda import Agenda
from bt_tamp.executive.mission import GOAL_TIME, mission
from bt_tamp.executive.validity import still_good_while
from planner.failure import ExecutionFailure
from planner.task.symbols import Fact, GroundAction, Step, TaskPlan, resume_at

TICK = 0.02
AT = {place: Fact("at", (place,)) for place in ("start", "a", "b", "c")}
EMPTY = SimpleNamespace(poses={}, scenario=SimpleNamespace(bodies={}))


def go(origin, place):
    """A step that moves from one place to the next."""
    return Step(
        GroundAction("go", (origin, place)), frozenset({AT[origin]}), frozenset({AT[place]}), frozenset({AT[origin]})
    )


ROUTE = TaskPlan((go("start", "a"), go("a", "b"), go("b", "c")), frozenset({AT["c"]}))


class Scripted(Behaviour):
    """Takes some ticks, then brings about its step's effects; fails when told to."""

    def __init__(self, world, step):
        super().__init__(str(step.action))
        self.world, self.step, self.left = world, step, 3

    def initialise(self):
        self.left = self.world.ticks
        self.world.log.append(f"begin {self.step.action.args[1]}")

    def update(self):
        self.left -= 1
        if self.world.fails and self.left < 2:
            self.world.context.fail(ExecutionFailure(self.step.action, "it broke"))
            return Status.FAILURE
        if self.left == self.world.retract:
            self.world.facts = self.step.apply(self.world.facts)
        if self.left > 0:
            return Status.RUNNING
        self.world.log.append(f"end {self.step.action.args[1]}")
        return Status.SUCCESS

    def terminate(self, new_status):
        if new_status == Status.INVALID and self.status == Status.RUNNING:
            self.world.log.append(f"stopped {self.step.action.args[1]}")


class Plans(Behaviour):
    """The planner node's place: adopts the route, or fails."""

    def __init__(self, world):
        super().__init__("plan")
        self.world = world

    def update(self):
        if self.world.thinks > 0:
            self.world.thinks -= 1
            return Status.RUNNING
        self.world.log.append("plan")
        if self.world.route is None:
            return Status.FAILURE
        self.world.agenda.drop()
        self.world.context.failure = None
        self.world.fails = False
        refinements = tuple(SimpleNamespace(action=step.action, sample=None) for step in self.world.route.steps)
        self.world.agenda.adopt(self.world.route, refinements, self.world.context, "planned")
        return Status.SUCCESS


class World:
    """Facts, time and the mission tree over them."""

    def __init__(self, facts=("start",)):
        self.facts = frozenset(AT[place] for place in facts)
        self.route, self.fails, self.ticks, self.retract, self.log = ROUTE, False, 3, 0, []
        self.speed, self.thinks = 0.0, 0
        context = SimpleNamespace(scene=EMPTY, failure=None, report=lambda *_, **__: None, observation=None)
        context.fail = lambda failure: setattr(context, "failure", context.failure or failure)
        self.context = context
        steps = {step.action: step for step in ROUTE.steps}
        skill = SimpleNamespace(subtree=lambda run, _: Scripted(self, steps[run.action]))
        self.worked = []
        self.agenda = Agenda(
            *(ROUTE.goal, {"go": skill}, lambda _: self.facts, lambda _: None),
            lambda refinement: self.worked.append(str(refinement.action)),
        )
        self.mission = mission(self.agenda, context, Plans(self))
        self.t = 0.0

    def tick(self, count=1):
        for _ in range(count):
            velocities = {"thing": np.array([self.speed, 0, 0, 0, 0, 0])}
            self.context.observation = SimpleNamespace(t=self.t, velocities=velocities)
            self.mission.root.tick_once()
            self.t += TICK
        return self

    def reports(self):
        """What is reported from now on."""
        told = []
        self.context.report = lambda kind, **data: told.append((kind, data))
        return told

    def until_done(self, limit=200):
        for _ in range(limit):
            if self.tick().mission.goal.status is Status.SUCCESS:
                return self
        raise AssertionError(f"the goal was not reported within {limit} ticks: {self.log}")


def test_the_plan_is_carried_out_step_by_step_and_the_goal_ends_the_mission():
    world = World().until_done()
    assert world.log == ["plan", "begin a", "end a", "begin b", "end b", "begin c", "end c"]
    assert [str(action) for action in world.agenda.executed] == ["go(start, a)", "go(a, b)", "go(b, c)"]


def test_the_end_of_the_plan_alone_never_ends_the_mission():
    world = World()
    world.retract = -1
    world.tick(100)
    assert world.mission.goal.status is Status.FAILURE
    assert world.mission.root.status is not Status.SUCCESS


def test_the_goal_counts_only_after_it_held_for_half_a_second_with_everything_at_rest():
    world = World(facts=("c",))
    world.speed = 0.2
    world.tick(60)
    assert world.mission.goal.status is Status.FAILURE
    world.speed, start = 0.0, world.t
    world.until_done()
    assert world.t - start >= GOAL_TIME


def test_a_failed_action_puts_the_plan_out_of_force_and_the_planner_runs_before_anything_acts_again():
    world = World()
    world.ticks = 10
    while "begin a" not in world.log:
        world.tick()
    world.fails = True
    world.tick(12)
    after = world.log[world.log.index("begin a") + 1 :]
    assert after[0] == "plan"
    assert world.log.count("plan") == 2


def test_without_a_plan_nothing_acts():
    world = World()
    world.route = None
    world.tick(5)
    assert set(world.log) == {"plan"}
    assert world.mission.root.status is Status.FAILURE


def test_what_somebody_else_has_done_is_skipped_without_a_new_plan():
    world = World()
    world.tick(2)
    while "end a" not in world.log:
        world.tick()
    world.facts = frozenset({AT["b"]})
    told = world.reports()
    world.until_done()
    assert "begin b" not in world.log
    assert world.log.count("plan") == 1
    assert ("skipped", {"actions": ["go(a, b)"]}) in told


def test_what_was_undone_is_done_again_without_a_new_plan():
    world = World()
    while "end b" not in world.log:
        world.tick()
    world.facts = frozenset({AT["start"]})
    told = world.reports()
    world.until_done()
    assert world.log.count("begin a") == 2
    assert world.log.count("plan") == 1
    assert ("redone", {"actions": ["go(start, a)", "go(a, b)"], "lacking": ["at(a)"]}) in told


def test_an_action_that_ends_without_its_effect_is_done_once_more_and_then_fails():
    world = World()
    world.retract = -1
    told = []
    world.context.fail = lambda failure: (told.append(failure), setattr(world.context, "failure", failure))
    while world.log.count("plan") < 2:
        world.tick()
    assert world.log.count("end a") == 2
    assert [str(failure.action) for failure in told] == ["go(start, a)"]
    assert told[0].kind == "EffectMissing"
    assert told[0].reason == "it came to its end, and without effect: at(a) missing"
    assert world.worked == []


def test_an_action_has_worked_once_its_effect_is_there():
    world = World()
    while "end b" not in world.log:
        world.tick()
    assert world.worked == ["go(start, a)"]
    world.until_done()
    assert world.worked == ["go(start, a)", "go(a, b)", "go(b, c)"]


def test_what_an_action_was_foreseen_to_do_to_others_is_not_missed():
    world = World()
    world.retract = -1
    first, *rest = ROUTE.steps
    elsewhere = Step(first.action, first.preconditions, frozenset({AT["c"]}), first.deletes)
    world.route = TaskPlan((elsewhere, *rest), ROUTE.goal)
    told = []
    world.context.fail = told.append
    world.tick(40)
    assert world.log.count("end a") > 2
    assert told == []


@pytest.mark.parametrize("literal", [Fact("hand_empty"), Fact("at", ("a",))])
def test_a_goal_that_gets_longer_replaces_the_plan_and_says_so(literal):
    world = World()
    while "begin a" not in world.log:
        world.tick()
    world.agenda.want(ROUTE.goal | {literal})
    reason = world.agenda.review(world.context)
    assert reason == ("something else is wanted now" if not literal.args else "a is wanted now, too")


def test_the_running_action_counts_as_done_while_its_own_facts_are_in_between():
    world = World()
    while "begin b" not in world.log:
        world.tick()
    world.facts = frozenset()
    world.tick()
    assert world.log.count("plan") == 1
    world.facts = frozenset({AT["a"]})
    world.until_done()


@pytest.mark.parametrize("until", ["begin b", "end b"])
def test_a_plan_that_was_found_wanting_stays_out_of_force_even_if_it_comes_good_again(until):
    world = World()
    while until not in world.log:
        world.tick()
    world.thinks = 3
    world.agenda.want(frozenset({AT["start"]}))
    world.tick()
    assert world.agenda.act.status is Status.INVALID
    world.agenda.want(ROUTE.goal)
    stopped = len(world.log)
    world.until_done()
    assert world.log[stopped] == "plan"


def test_what_only_a_blink_speaks_against_is_gone_on_with():
    world, needed = World(), Fact("needed")
    first, second, third = ROUTE.steps
    second = Step(second.action, second.preconditions | {needed}, second.adds, second.deletes)
    world.route = TaskPlan((first, second, third), ROUTE.goal)
    world.facts, world.ticks = world.facts | {needed}, 9
    while "begin a" not in world.log:
        world.tick()
    world.facts -= {needed}
    world.tick(2)
    world.facts |= {needed}
    world.until_done()
    assert world.log.count("plan") == 1
    assert "stopped a" not in world.log


def test_a_plan_whose_rest_no_longer_applies_is_replaced_and_the_old_tree_is_stopped_first():
    world = World()
    world.ticks = 20
    while "begin a" not in world.log:
        world.tick()
    never = Fact("never")
    step = world.agenda.plan.steps[1]
    broken = Step(step.action, step.preconditions | {never}, step.adds, step.deletes)
    world.agenda.plan = TaskPlan((world.agenda.plan.steps[0], broken, world.agenda.plan.steps[2]), ROUTE.goal)
    while world.log.count("plan") < 2:
        world.tick()
    assert world.log[-3:] == ["plan", "stopped a", "begin a"]


def test_a_reached_goal_does_not_cut_short_the_action_that_reached_it():
    world = World()
    world.ticks, world.retract = 60, 55
    while "begin c" not in world.log:
        world.tick()
    world.tick(50)
    assert ROUTE.goal <= world.facts
    assert world.mission.goal.status is Status.FAILURE
    world.until_done()
    assert world.log[-1] == "end c"


@pytest.mark.parametrize(("facts", "expected"), [(("start",), 0), (("a",), 1), (("b",), 2), (("c",), 3), ((), None)])
def test_a_plan_is_resumed_at_the_largest_step_from_which_it_reaches_the_goal(facts, expected):
    assert resume_at(ROUTE, frozenset(AT[place] for place in facts)) == expected


def test_the_rest_of_a_plan_is_judged_as_if_the_running_step_were_done():
    assert still_good_while(ROUTE, 0, frozenset({AT["start"]}))
    assert still_good_while(ROUTE, 0, frozenset())
    unreachable = TaskPlan(ROUTE.steps, frozenset({Fact("never")}))
    assert not still_good_while(unreachable, 0, frozenset({AT["start"]}))


def test_another_goal_replaces_the_plan_even_in_the_middle_of_an_action():
    world = World()
    while "begin a" not in world.log:
        world.tick()
    world.route = TaskPlan(ROUTE.steps[:2], frozenset({AT["b"]}))
    world.agenda.want(world.route.goal)
    world.until_done()
    assert world.log.count("plan") == 2
    assert "begin c" not in world.log


def test_what_comes_late_is_wanted_once_it_was_seen():
    world = World()
    agenda = Agenda(frozenset({AT["c"], AT["a"]}), {}, lambda _: frozenset(), str, str, frozenset({"a"}))
    scene = SimpleNamespace(poses={}, scenario=SimpleNamespace(bodies={"a": None, "c": None}))
    agenda.look_out(scene)
    assert agenda.goal == {AT["c"]}
    assert agenda.missing(scene) == ("c",)
    assert agenda.pursued(scene) == frozenset()
    scene.poses["a"] = scene.poses["c"] = "somewhere"
    agenda.look_out(scene)
    del scene.poses["a"]
    assert agenda.goal == {AT["c"], AT["a"]}
    assert agenda.missing(scene) == ("a",)
    assert agenda.pursued(scene) == {AT["c"]}
    assert world.agenda.goal == ROUTE.goal


def test_without_watching_nothing_is_skipped_or_done_again_and_a_failure_is_a_failure():
    world = World()
    world.agenda.is_watchful = False
    while "end a" not in world.log:
        world.tick()
    world.facts = frozenset({AT["b"]})
    world.tick(20)
    assert world.log.count("begin b") == 1
    assert world.agenda.is_over
    world.fails = True
    world.context.fail(ExecutionFailure(ROUTE.steps[2].action, "it broke"))
    assert world.agenda.review(world.context) == "it broke"
