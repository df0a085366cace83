"""What guards look for that end a motion in contact: it can't simply begin anew."""

from abc import abstractmethod

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from planner.failure import SceneChanged
from planner.refinement import Refinement
from skills.context import ActionRun, SkillContext


class ContactGuard(Behaviour):
    """Fails, and says why, once the scene no longer fits the refined action. Blind runs look for nothing."""

    def __init__(self, name: str, run: ActionRun, context: SkillContext) -> None:
        super().__init__(name)
        self._run, self._context = run, context

    @abstractmethod
    def what_changed(self, refinement: Refinement) -> str | None:
        """Why the rest of the motion no longer fits the scene, in a sentence; None while it does."""

    def update(self) -> Status:
        context, refinement = self._context, self._run.refinement
        changed = self.what_changed(refinement) if refinement is not None and context.is_watchful else None
        if refinement is None or changed is None:
            return Status.SUCCESS
        context.fail(SceneChanged(self._run.action, changed, refinement.sample))
        self.feedback_message = changed
        return Status.FAILURE
