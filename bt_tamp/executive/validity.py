"""Does what is left of a plan still lead from the observed facts to the goal?"""

from planner.task.symbols import Fact, TaskPlan


def resume_at(plan: TaskPlan, facts: frozenset[Fact], first: int = 0) -> int | None:
    """The largest k ≥ `first` such that the steps from k on are applicable one after the other and reach the goal.

    len(plan.steps) when the goal holds already; None when no such k exists. Skips what is already
    done and goes back to what was undone, without a new plan.
    """
    for k in range(len(plan.steps), first - 1, -1):
        if _leads_to_goal(plan, facts, k):
            return k
    return None


def still_good_while(plan: TaskPlan, running: int, facts: frozenset[Fact]) -> bool:
    """Does the rest of the plan work out if the running step counts as done?

    Its own guards watch it: in the middle of a pick, the pick's preconditions are false, and that is right.
    """
    return resume_at(plan, plan.steps[running].apply(facts), running + 1) is not None


def _leads_to_goal(plan: TaskPlan, facts: frozenset[Fact], k: int) -> bool:
    for step in plan.steps[k:]:
        if not step.applicable(facts):
            return False
        facts = step.apply(facts)
    return plan.goal <= facts
