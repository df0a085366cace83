"""What the search-then-sample loop needs of a task planner."""

from typing import Protocol

from planner.task.symbols import NoTaskPlan, TaskPlan


class TaskPlanner(Protocol):
    """Finds a sequence of actions. Pyperplan is one; another planner fits here with nothing above changing."""

    def solve(self, domain_text: str, problem_text: str, max_expansions: int) -> TaskPlan | NoTaskPlan:
        """A plan for a problem in PDDL, expanding so many search nodes at most.

        Raises PddlError for a text that can't be used.
        """
        ...
