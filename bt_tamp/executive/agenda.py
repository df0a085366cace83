"""The plan in force: its steps, which one runs, and the tree `act` that carries out the rest."""

from collections import Counter
from collections.abc import Callable, Mapping

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Sequence

from bt_tamp.executive.validity import still_good_while
from planner.failure import EffectMissing
from planner.refinement import Refinement
from planner.task.symbols import Fact, GroundAction, TaskPlan, resume_at
from sim.scene import SceneState
from skills.context import ActionRun, SkillContext
from skills.motions import sequence
from skills.skill import Skill

MAX_UNDONE = 1
"""How often, at most, an action whose effect isn't there right after it is simply done again."""

DOUBT = 0.06
"""Seconds for which facts must speak against a plan in the middle of an action: noise of what moves isn't averaged."""


class Agenda:
    """What is to be done, and how far it has come.

    `goal` is what is wanted; `late` bodies are not counted before they were seen (`order` is all that was asked for,
    `unseen` those of them that are still to come). What there is no way to can be `put_off` until the rest is done
    (`has_put_off`: some was, once); `has_begun`: a plan has been in force. Without `is_watchful` the first plan is
    carried out whatever is seen, and nothing is skipped or done again. `facts` states a believed scene
    in the planner's predicates. `rebuilt` is called whenever `act` has new children, `done`
    with what was carried out to its effect.
    """

    def __init__(
        self,
        goal: frozenset[Fact],
        skills: Mapping[str, Skill],
        facts: Callable[[SceneState], frozenset[Fact]],
        rebuilt: Callable[[str], None],
        done: Callable[[Refinement], None],
        late: frozenset[str] = frozenset(),
        is_watchful: bool = True,
    ) -> None:
        self.is_watchful = is_watchful
        self.facts = facts
        self.act = Sequence("act", memory=True, children=[Waiting()])
        self.plan: TaskPlan | None = None
        self.executed: list[GroundAction] = []
        self.is_between_actions = True
        self._skills = skills
        self._rebuilt = rebuilt
        self._done = done
        self.order, self.unseen = goal, late
        self.put_off: frozenset[Fact] = frozenset()
        self.has_begun = self.has_put_off = False
        self._released: frozenset[Fact] = frozenset()
        self._refinements: tuple[Refinement, ...] = ()
        self._running = 0
        self._sound: tuple[int, bool, frozenset[Fact]] | None = None
        self._broken: str | None = None
        self._doubted_since: float | None = None
        self._just_done: tuple[int, ActionRun] | None = None
        self._undone: Counter[GroundAction] = Counter()

    @property
    def goal(self) -> frozenset[Fact]:
        """What is wanted now."""
        return frozenset(fact for fact in self.order if self.unseen.isdisjoint(fact.args))

    def want(self, goal: frozenset[Fact]) -> None:
        """Somebody wants something else from now on."""
        self.order = goal

    def look_out(self, scene: SceneState) -> None:
        """What comes late is asked for as soon as it is there, and what was put off once the rest is done."""
        self.unseen = self.unseen - scene.poses.keys()
        if self.put_off and self.is_between_actions and self.pursued(scene) <= self.facts(scene):
            self.put_off, self._released = frozenset(), self.put_off

    def pursued(self, scene: SceneState) -> frozenset[Fact]:
        """The part of the goal that is worked on: what it is about is to be seen, and it isn't put off."""
        wanted, bodies = self.goal - self.put_off, scene.scenario.bodies
        return frozenset(f for f in wanted if all(arg in scene.poses for arg in f.args if arg in bodies))

    def missing(self, scene: SceneState) -> tuple[str, ...]:
        """Bodies that should be there and are nowhere to be seen."""
        return tuple(name for name in scene.scenario.bodies if name not in scene.poses and name not in self.unseen)

    @property
    def refinements(self) -> tuple[Refinement, ...]:
        """How the steps of the plan in force were to be done, when it was made."""
        return self._refinements

    @property
    def is_over(self) -> bool:
        """Is every step of the plan in force done?"""
        return self.plan is not None and self._running >= len(self.plan.steps)

    @property
    def left(self) -> tuple[GroundAction, ...]:
        """What is left of the plan, the running action first."""
        return () if self.plan is None else self.plan.actions[self._running :]

    @property
    def running(self) -> GroundAction | None:
        """The action that is being carried out, None between actions and without a plan."""
        if self.plan is None or self.is_between_actions or self._running >= len(self.plan.steps):
            return None
        return self.plan.steps[self._running].action

    def adopt(self, plan: TaskPlan, refinements: tuple[Refinement, ...], context: SkillContext, why: str) -> None:
        """Put a new plan in force: the old tree is stopped, then replaced."""
        self.plan, self._refinements, self._sound, self._broken = plan, refinements, None, None
        self._doubted_since = None
        self.has_begun, self._released = True, frozenset()
        self._build_from(0, context, why)

    def drop(self) -> None:
        """Put the plan out of force and stop what runs."""
        self.plan = self._broken = None
        self.act.stop(Status.INVALID)
        self.is_between_actions, self._just_done = True, None

    def review(self, context: SkillContext) -> str | None:
        """Why the plan is no longer in force, or None; skips and redoes steps as the observed facts ask.

        A plan that was found wanting stays so, for the tree that carries it out was stopped then.
        """
        if context.failure is not None:
            return context.failure.reason
        if self.plan is None:
            return "there is no plan yet"
        if self.is_watchful and self._broken is None:
            self._broken = self._look_at(self.plan, context)
        return self._broken

    def _look_at(self, plan: TaskPlan, context: SkillContext) -> str | None:
        if plan.goal != self.pursued(context.scene):
            return self._what_changed(context.scene)
        facts = self.facts(context.scene)
        if (self._running, self.is_between_actions, facts) == self._sound:
            self._doubted_since = None
            return None
        if not self.is_between_actions:
            if still_good_while(plan, self._running, facts):
                self._sound, self._doubted_since = (self._running, False, facts), None
                return None
            now = context.observation.t
            self._doubted_since = now if self._doubted_since is None else self._doubted_since
            is_certain = now - self._doubted_since >= DOUBT
            return f"after {self.running} the rest of the plan would no longer apply" if is_certain else None
        self._doubted_since = None
        k = resume_at(plan, facts)
        missing = self._missing_effect(plan, k, facts)
        if missing is not None:
            context.fail(missing)
            return missing.reason
        if k is None:
            return "what is left of the plan no longer leads to the goal"
        if k > self._running:
            self._tell(context, "skipped", plan.actions[self._running : k])
            self._build_from(k, context, "skipped")
        elif k < self._running:
            lacking = sorted(plan.steps[k].adds - facts)
            self._tell(context, "redone", plan.actions[k : self._running], lacking=[str(fact) for fact in lacking])
            self._build_from(k, context, "redone")
        self._sound = self._running, True, facts
        return None

    def _tell(self, context: SkillContext, kind: str, actions: tuple[GroundAction, ...], **more: list[str]) -> None:
        context.report(kind, actions=[str(action) for action in actions], **more)

    def _missing_effect(self, plan: TaskPlan, k: int | None, facts: frozenset[Fact]) -> EffectMissing | None:
        """That what was just done doesn't have the effect that the plan rests on, again. k: where the plan would go
        on.

        Once it may have been undone at that very moment. A skill whose own end and whose effect in PDDL differ would
        be done again for ever.
        """
        just_done, self._just_done = self._just_done, None
        if just_done is None:
            return None
        index, run = just_done
        # What a step does to others is a side effect, foreseen but not promised.
        lacking = sorted(fact for fact in plan.steps[index].adds - facts if {*fact.args} <= {*run.action.args})
        if not lacking and run.refinement is not None:
            self._done(run.refinement)
        if not lacking or (k is not None and k > index):
            self._undone.pop(run.action, None)
            return None
        self._undone[run.action] += 1
        if self._undone[run.action] <= MAX_UNDONE:
            return None
        del self._undone[run.action]
        told = f"it came to its end, and without effect: {', '.join(map(str, lacking))} missing"
        return EffectMissing(run.action, told, run.refinement.sample if run.refinement else None)

    def _what_changed(self, scene: SceneState) -> str:
        """Why the plan in force is for something else than what is wanted now."""
        assert self.plan is not None
        gone = _about(self.plan.goal & self.goal - self.pursued(scene))
        if gone:
            return f"{', '.join(gone)} can't be seen any more"
        if not self.plan.goal <= self.goal:
            return "something else is wanted now"
        more = self.pursued(scene) - self.plan.goal
        come = _about(more)
        if more <= self._released:
            return f"with the rest done, a way for {' and '.join(come) or 'it'} is looked for once more"
        if not come:
            return "something else is wanted now"
        return f"{', '.join(come)} {'is' if len(come) == 1 else 'are'} wanted now, too"

    def begin(self) -> None:
        """An action of the plan has started."""
        self.is_between_actions = False

    def complete(self, run: ActionRun) -> None:
        """The running action is done."""
        if self.plan is not None:
            self.executed.append(self.plan.steps[self._running].action)
            self._just_done = self._running, run
        self._running += 1
        self.is_between_actions = True

    def _build_from(self, k: int, context: SkillContext, why: str) -> None:
        assert self.plan is not None
        self.act.stop(Status.INVALID)
        self.act.remove_all_children()
        self._running = k
        self.is_between_actions = True
        for index in range(k, len(self.plan.steps)):
            action = self.plan.steps[index].action
            run = ActionRun(action, self._refinements[index])
            subtree = self._skills[action.name].subtree(run, context)
            name, subtree.name = subtree.name, "do"
            self.act.add_child(sequence(name, Begin(self, action, context), subtree, Complete(self, run, context)))
        self.act.add_child(Waiting())
        self._rebuilt(why)


def _about(literals: frozenset[Fact]) -> list[str]:
    """What literals are about: their first arguments."""
    return sorted({name for fact in literals for name in fact.args[:1]})


class Begin(Behaviour):
    """Marks the start of an action."""

    def __init__(self, agenda: Agenda, action: GroundAction, context: SkillContext) -> None:
        super().__init__("begin")
        self._agenda, self._action, self._context = agenda, action, context

    def update(self) -> Status:
        self._agenda.begin()
        self._context.report("action_started", action=str(self._action))
        return Status.SUCCESS


class Complete(Behaviour):
    """Marks the end of an action, and lets a tick pass so that the rest of the plan is looked at before it goes on."""

    def __init__(self, agenda: Agenda, run: ActionRun, context: SkillContext) -> None:
        super().__init__("complete")
        self._agenda, self._run, self._context = agenda, run, context
        self._marked = False

    def initialise(self) -> None:
        self._marked = False

    def update(self) -> Status:
        if self._marked:
            return Status.SUCCESS
        self._marked = True
        self._agenda.complete(self._run)
        self._context.report("action_done", action=str(self._run.action))
        return Status.RUNNING


class Waiting(Behaviour):
    """Nothing left to do: the arm holds while the goal is looked at."""

    def __init__(self) -> None:
        super().__init__("wait")

    def update(self) -> Status:
        return Status.RUNNING
