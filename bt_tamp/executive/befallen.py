"""Keeps what befell a run, and how soon it answered to it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from bt_tamp.report.result import Befallen

ANSWERS = ("refined_again", "action_failed", "replan", "rebuilt")
"""Events with which a run answers to what befell it."""


class Ledger:
    """Told of every event of a run, and at every tick whether the arm stands still.

    An action that something befell has answered when it is worked out anew or fails, so it did matter; it has reacted
    when the arm stands still or sets out anew after that. What comes after the action's end answers to something else.
    """

    def __init__(self) -> None:
        self._found: list[Befallen] = []
        self._reacting: list[int] = []
        self._durations: list[float] = []
        self._started = 0.0

    @property
    def found(self) -> tuple[Befallen, ...]:
        """Everything so far, in order of time."""
        return tuple(self._found)

    @property
    def durations(self) -> tuple[float, ...]:
        """Seconds that each action took which was carried out to its end."""
        return tuple(self._durations)

    def hear(self, kind: str, t: float, data: Mapping[str, Any]) -> None:
        """An event at time t (s)."""
        match kind:
            case "disturbed":
                self._found.append(_befallen(t, data))
            case "mattered":
                self._found[data["number"]] = replace(self._found[data["number"]], mattered=True)
            case "action_started":
                self._started = t
                self._reacting.clear()
                self._calm()
            case "action_done":
                self._durations.append(t - self._started)
                self._calm()
            case "phase" | "lifting_off":
                self._react(t)
        if kind in ANSWERS:
            self._answer(kind, t)

    def look(self, t: float, is_still: bool) -> None:
        """At time t (s) the arm stands still, or not."""
        if is_still and self._reacting:
            self._react(t)

    def _answer(self, kind: str, t: float) -> None:
        for index, one in enumerate(self._found):
            if one.answer:
                continue
            mattered = one.mattered or one.is_urgent
            self._found[index] = replace(one, answer=kind, answered_after_s=t - one.t, mattered=mattered)
            if one.is_urgent:
                self._reacting.append(index)

    def _react(self, t: float) -> None:
        for index in self._reacting:
            self._found[index] = replace(self._found[index], reacted_after_s=t - self._found[index].t)
        self._reacting.clear()

    def _calm(self) -> None:
        """The action that it befell is over: nothing is urgent any more."""
        self._found = [one if one.answer else replace(one, is_urgent=False) for one in self._found]


def _befallen(t: float, data: Mapping[str, Any]) -> Befallen:
    return Befallen(
        t,
        data["name"],
        data["sentence"],
        data["phase"],
        action=data.get("action", ""),
        bodies=tuple(data.get("bodies", ())),
        mattered=data.get("mattered", True),
        is_urgent=data.get("is_urgent", False),
        hidden_s=data.get("hidden_s", 0.0),
    )
