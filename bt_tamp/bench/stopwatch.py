"""How long the parts of a repeated job take, in CPU time: what else the machine does is not counted."""

import math
import time

import numpy as np


class Stopwatch:
    """Times laps by name; `start` begins the first. A lap's own cost is under a microsecond.

    longest: seconds beyond which a lap is left out: something else than the repeated job was done in it.
    """

    def __init__(self, longest: float = math.inf) -> None:
        self._longest = longest
        self._since = time.thread_time()
        self._laps: dict[str, list[float]] = {}

    def start(self) -> None:
        """Begin a lap here."""
        self._since = time.thread_time()

    def lap(self, part: str) -> None:
        """The part that has just been done took until now, from the end of the lap before."""
        now = time.thread_time()
        if now - self._since <= self._longest:
            self._laps.setdefault(part, []).append(now - self._since)
        self._since = now

    def median(self, part: str) -> float:
        """Median in microseconds; NaN for a part that was never done."""
        return 1e6 * float(np.median(self._laps[part])) if part in self._laps else float("nan")

    def total(self, part: str) -> float:
        """All laps together, in seconds."""
        return sum(self._laps.get(part, ()))
