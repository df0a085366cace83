"""Does what is left of a plan still lead from the observed facts to the goal?"""

from planner.task.symbols import Fact, TaskPlan, resume_at


def still_good_while(plan: TaskPlan, running: int, facts: frozenset[Fact]) -> bool:
    """Does the rest of the plan work out if the running step counts as done?

    Its own guards watch it: in the middle of a pick, the pick's preconditions are false, and that is right.
    """
    return resume_at(plan, plan.steps[running].apply(facts), running + 1) is not None
