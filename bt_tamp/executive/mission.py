"""The root tree: is the goal reached? If not: a plan in force, and the rest of it carried out.

    mission                     Selector, memory=False
    ├── goal reached?
    └── pursue goal             Sequence, memory=False
        ├── plan in force       Selector, memory=False
        │   ├── plan still good?
        │   └── plan            lift off if in contact, then plan
        └── act                 one subtree per remaining action

The outcome is judged by `goal reached?` alone; `act` coming to its end never ends the mission.
"""

from dataclasses import dataclass
from functools import lru_cache

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

from bt_tamp.executive.agenda import Agenda
from bt_tamp.executive.rest import moving
from planner.task.symbols import Fact
from skills.context import SkillContext
from skills.motions import sequence

GOAL_TIME = 0.5
"""Seconds for which the goal must hold, everything at rest."""

TOLD_AFTER = 1.0
"""Seconds of waiting, for rest or for what is nowhere to be seen, after which it is told what is waited for."""


@dataclass(frozen=True)
class Mission:
    """The tree's root, and the nodes that others look at."""

    root: Behaviour
    goal: "GoalReached"
    act: Sequence


def mission(agenda: Agenda, context: SkillContext, plan: Behaviour) -> Mission:
    """The root tree around a planner node."""
    goal = GoalReached(agenda, context)
    act = agenda.act
    in_force = Selector("plan in force", memory=False, children=[PlanStillGood(agenda, context), plan])
    pursue = Sequence("pursue goal", memory=False, children=[in_force, act])
    return Mission(Selector("mission", memory=False, children=[goal, pursue]), goal, act)


class GoalReached(Behaviour):
    """Do all goal literals hold, everything at rest, for half a second, the running action at its end?

    `restless`: since when (s) the literals hold and something moves, and what; None otherwise. `waits`: the same
    for all that can be worked on being done, and bodies that are nowhere to be seen.
    """

    def __init__(self, agenda: Agenda, context: SkillContext) -> None:
        super().__init__("goal reached?")
        self._agenda, self._context = agenda, context
        self._since: float | None = None
        self._told = self._told_missing = False
        self.restless: tuple[float, tuple[str, ...]] | None = None
        self.waits: tuple[float, tuple[str, ...]] | None = None

    def update(self) -> Status:
        context = self._context
        now = context.observation.t
        self._agenda.look_out(context.scene)
        facts = self._agenda.facts(context.scene)
        missing = self._agenda.goal - facts
        self._look_for_the_missing(now, missing, facts)
        if missing or not self._agenda.is_between_actions:
            self._since = self.restless = None
            self._told = False
            self.feedback_message = _still_missing(missing) if missing else ""
            return Status.FAILURE
        restless = tuple(moving(context.observation))
        if restless:
            self._since = None
            self.restless = (self.restless[0] if self.restless else now, restless)
            if not self._told and now - self.restless[0] > TOLD_AFTER:
                self._told = True
                context.report("waiting", bodies=list(restless))
            self.feedback_message = f"waiting for {', '.join(restless)} to come to rest"
            return Status.FAILURE
        self.restless = None
        self.feedback_message = ""
        if self._since is None:
            self._since = now
        return Status.SUCCESS if now - self._since >= GOAL_TIME else Status.FAILURE

    def _look_for_the_missing(self, now: float, missing: frozenset[Fact], facts: frozenset[Fact]) -> None:
        scene = self._context.scene
        if not missing or not self._agenda.pursued(scene) <= facts:
            self.waits = None
            self._told_missing = False
            return
        since = self.waits[0] if self.waits else now
        self.waits = (since, self._agenda.missing(scene))
        if self.waits[1] and not self._told_missing and now - since > TOLD_AFTER:
            self._told_missing = True
            self._context.report("missing", bodies=list(self.waits[1]))


class PlanStillGood(Behaviour):
    """Does the rest of the plan still lead to the goal from what is observed? If so, go on from the right step."""

    def __init__(self, agenda: Agenda, context: SkillContext) -> None:
        super().__init__("plan still good?")
        self._agenda, self._context = agenda, context

    def update(self) -> Status:
        reason = self._agenda.review(self._context)
        self.feedback_message = reason or ""
        return Status.SUCCESS if reason is None else Status.FAILURE


def planning(lift_off: Behaviour, plan: Behaviour) -> Behaviour:
    """Leave contact first, then plan."""
    return sequence("plan", lift_off, plan)


@lru_cache(maxsize=64)
def _still_missing(missing: frozenset[Fact]) -> str:
    return "missing: " + ", ".join(str(fact) for fact in sorted(missing))
