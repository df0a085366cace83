"""What a film of a run says and when: the running action, its phase, and sentences at turning points."""

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass

from bt_tamp.report.events import Event
from bt_tamp.report.sentences import sentence

TOLD = frozenset(
    {
        "disturbed",
        "planner_crashed",
        "refinement_failed",
        "learned",
        "action_failed",
        "refined_again",
        "put_off",
        "replan",
        "goal_reached",
        "run_ended",
    }
)
"""Events at which the film stands still so that their sentences can be read."""

MOST_TOLD = 4


@dataclass(frozen=True)
class Caption:
    """The running action ("" for none), its phase, and which of how many it is (0 of 0 without a plan)."""

    action: str = ""
    phase: str = ""
    step: int = 0
    steps: int = 0


@dataclass(frozen=True)
class Note:
    """Sentences about what happened at `t` (s)."""

    t: float
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Timeline:
    """Captions by the time from which they hold, and notes; both in order of time."""

    times: tuple[float, ...]
    captions: tuple[Caption, ...]
    notes: tuple[Note, ...]

    @staticmethod
    def of(events: Iterable[Event]) -> "Timeline":
        """Read a run's events, oldest first."""
        times, captions = [0.0], [Caption(action="planning")]
        told: dict[float, list[str]] = {}
        for event in events:
            now = _after(captions[-1], event)
            if now != captions[-1]:
                times.append(event.t)
                captions.append(now)
            words = sentence(event) if event.kind in TOLD else None
            if words is not None:
                told.setdefault(event.t, []).append(words)
        notes = (Note(t, _fewer(sentences)) for t, sentences in sorted(told.items()))
        return Timeline(tuple(times), tuple(captions), tuple(notes))

    @property
    def end(self) -> float:
        """Time in seconds of the last thing that is told."""
        return max([self.times[-1], *(note.t for note in self.notes)])

    def caption(self, t: float) -> Caption:
        """The caption at time t (s)."""
        return self.captions[max(0, bisect_right(self.times, t) - 1)]

    def told_between(self, after: float, until: float) -> tuple[str, ...]:
        """Sentences about what happened later than `after` and not later than `until` (s)."""
        return _fewer([words for note in self.notes if after < note.t <= until for words in note.sentences])


def _after(caption: Caption, event: Event) -> Caption:
    data = event.data
    match event.kind:
        case "plan_installed":
            return Caption(action="planning", steps=len(data["actions"]))
        case "action_started":
            return Caption(str(data["action"]), "", caption.step + 1, max(caption.steps, caption.step + 1))
        case "phase":
            return Caption(str(data["action"]), str(data["phase"]), caption.step, caption.steps)
        case "replan" | "action_failed":
            return Caption(action="planning again")
        case "goal_reached":
            return Caption(action="done", step=caption.step, steps=caption.steps)
    return caption


def _fewer(sentences: list[str]) -> tuple[str, ...]:
    """At most MOST_TOLD sentences, each said once; the last ones count most."""
    once = list(dict.fromkeys(sentences))
    if len(once) <= MOST_TOLD:
        return tuple(once)
    return (f"({len(once) - MOST_TOLD + 1} earlier findings)", *once[1 - MOST_TOLD :])
