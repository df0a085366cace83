"""What the world refused, as values. Errors (wrong input) are exceptions; these are not."""

from dataclasses import dataclass
from typing import Any, Literal

from planner.task.symbols import GroundAction


@dataclass(frozen=True)
class Blocked:
    """Why one sample of an action could not be refined.

    `sample` is the skill's own plain value (a grasp, a stroke …), kept so that it can be tried
    first once its culprits are away. `culprits` are the movable bodies that were in the way:
    without them the sample works. Empty culprits: the sample fails whatever is moved aside.
    """

    sample: Any
    reason: str
    culprits: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Failure:
    """An action that can't be refined, or failed while running.

    `reason` is one sentence for people.
    """

    action: GroundAction
    reason: str

    @property
    def kind(self) -> str:
        return type(self).__name__


@dataclass(frozen=True)
class RefinementFailure(Failure):
    """No sample within the budget works: one record a sample that was tried.

    `proof` says that no sample can work, whatever the budget: "here" as long as the action's object
    lies where it lies (out of reach), "anywhere" wherever things lie (too heavy, region too small).
    `crashes`: errors met on the way, each as a phrase.
    """

    attempts: tuple[Blocked, ...] = ()
    proof: Literal["here", "anywhere"] | None = None
    crashes: tuple[str, ...] = ()

    @property
    def culprit_sets(self) -> frozenset[frozenset[str]]:
        """The distinct non-empty culprit sets of the samples."""
        return frozenset(a.culprits for a in self.attempts if a.culprits)


@dataclass(frozen=True)
class ExecutionFailure(Failure):
    """Something went wrong while acting; `sample` is what was being executed."""

    sample: Any = None


@dataclass(frozen=True)
class MotionFailure:
    """No motion was found: why, and the bodies in the way (empty: the scene itself or the arm's reach)."""

    reason: str
    culprits: frozenset[str] = frozenset()


class GraspMissed(ExecutionFailure):
    """The hand closed on nothing."""


class GraspSlipped(ExecutionFailure):
    """The held object left the hand or moved in it."""


class DragSlipped(ExecutionFailure):
    """What is dragged lagged behind the hand, however hard it was pressed."""


class ContactLost(ExecutionFailure):
    """Contact that the motion needs was lost, or never found."""


class PathBlocked(ExecutionFailure):
    """Something stands in the remaining path."""


class SceneChanged(ExecutionFailure):
    """Something moved that the motion relied on. Nothing is learned from it: what it means is seen."""


class EffectMissing(ExecutionFailure):
    """The motion ended, but what it was for isn't true."""


class ForceExceeded(ExecutionFailure):
    """A contact force passed its limit."""


class ArmStopped(ExecutionFailure):
    """The controller stopped the arm for safety: a limit was about to be passed, or something unexpected pushed it."""
