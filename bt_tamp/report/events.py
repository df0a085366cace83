"""The events of a run: one JSON object a line, in the order in which they happened.

Two runs with the same scene and seed write the same events, so nothing measured in real time is
stored here; it is shown live and summed up in `result.json`.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MEASURED = frozenset({"cpu_s", "wall_s"})
"""Data that differ from run to run: shown, never stored."""


@dataclass(frozen=True)
class Event:
    """Something that happened at simulated time `t` in seconds: `kind` says what, `data` the rest."""

    kind: str
    t: float
    data: Mapping[str, Any]

    def to_line(self) -> str:
        """The event as one line of JSON, without what was measured in real time."""
        kept = {key: value for key, value in self.data.items() if key not in MEASURED}
        return json.dumps({"t": round(self.t, 6), "kind": self.kind, **kept}, ensure_ascii=False, default=_plain)

    @staticmethod
    def from_line(line: str) -> "Event":
        """Read one line. Raises ValueError when it isn't an event."""
        record = json.loads(line)
        if not isinstance(record, dict) or "kind" not in record or not isinstance(record.get("t"), (int, float)):
            raise ValueError(f"not an event: {line.strip()[:80]!r}")
        return Event(str(record.pop("kind")), float(record.pop("t")), record)


def read_events(path: Path) -> Iterator[Event]:
    """Events of a file, oldest first. A last line torn by a kill is left out.

    Raises ValueError naming file and line for a broken line before the end.
    """
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            yield Event.from_line(line)
        except ValueError as error:
            if number == len(lines):
                return
            raise ValueError(f"{path}, line {number}: expected an event as a JSON object ({error})") from None


def _plain(value: Any) -> Any:
    """What JSON has no type for: sets (sorted), arrays and their scalars, everything else as text."""
    if isinstance(value, (set, frozenset)):
        return sorted(value, key=str)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    return str(value)
