"""Keeps what befell a run, and how soon it answered to it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from bt_tamp.report.result import Befallen

ANSWERS = ("refined_again", "action_failed", "replan", "rebuilt")
"""Events with which a run answers to what befell it."""


class Ledger:
    """Told of every event of a run."""

    def __init__(self) -> None:
        self._found: list[Befallen] = []

    @property
    def found(self) -> tuple[Befallen, ...]:
        """Everything so far, in order of time."""
        return tuple(self._found)

    def hear(self, kind: str, t: float, data: Mapping[str, Any]) -> None:
        """An event at time t (s)."""
        if kind == "disturbed":
            self._found.append(Befallen(t, data["name"], data["sentence"], data["phase"]))
        elif kind in ANSWERS:
            self._found = [
                one if one.answer else replace(one, answer=kind, answered_after_s=t - one.t) for one in self._found
            ]
