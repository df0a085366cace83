"""What a person sees while a run goes on: a live line in a terminal, plain lines in a pipe.

Neither may slow the run down: the terminal is drawn at most ten times a second.
"""

import time
from typing import TYPE_CHECKING, TextIO

from bt_tamp.report.events import Event
from bt_tamp.report.recorder import Watcher
from bt_tamp.report.sentences import sentence

if TYPE_CHECKING:
    from rich.console import Console

REDRAW = 0.1
"""Seconds of real time between two drawings of the live line."""


def watcher(stream: TextIO) -> Watcher:
    """A live line if `stream` is a terminal that can be drawn on, else plain lines."""
    from rich.console import Console

    console = Console(file=stream, highlight=False)
    if console.is_terminal and not console.is_dumb_terminal:
        return LiveLine(console)
    return PlainLines(stream)


class PlainLines:
    """One line for each thing that happens, with its simulated time. A closed pipe silences it; the run goes on."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._is_closed = False

    def event(self, event: Event) -> None:
        """Write the event, if it says something."""
        said = sentence(event) or _step(event)
        if said is not None and not self._is_closed:
            try:
                print(f"{event.t:8.2f} s  {said}", file=self._stream, flush=True)
            except BrokenPipeError:
                self._is_closed = True

    def progress(self, t: float, force: float) -> None:
        """Plain lines tell events only."""

    def close(self) -> None:
        """Nothing to tidy up."""


class LiveLine:
    """The running action, phase, simulated time, contact force and real-time factor in a line that is redrawn;
    what happens scrolls away above it."""

    def __init__(self, console: "Console") -> None:
        from rich.live import Live

        self._console = console
        self._live = Live(console=console, auto_refresh=False, transient=True)
        self._live.start()
        self._doing, self._phase = "starting", ""
        self._done, self._planned = 0, 0
        self._t, self._force = 0.0, 0.0
        self._started = time.perf_counter()
        self._drawn = 0.0

    def event(self, event: Event) -> None:
        """Take in the event; scroll its sentence."""
        self._t = event.t
        self._follow(event)
        said = sentence(event)
        if said is not None:
            self._say(event.t, said, _STYLES.get(event.kind, ""))
        elif event.kind == "action_done":
            self._say(event.t, f"done: {event.data['action']}", "green")
        self._draw()

    def progress(self, t: float, force: float) -> None:
        """Simulated time in s and contact force in N now."""
        self._t, self._force = t, force
        self._draw()

    def close(self) -> None:
        """Take the line away."""
        self._live.stop()

    def _follow(self, event: Event) -> None:
        data = event.data
        match event.kind:
            case "round" | "refined" | "refinement_failed" | "replan":
                self._doing, self._phase = "planning", str(data.get("action", ""))
            case "plan_installed":
                self._done, self._planned = 0, len(data["actions"])
                self._doing, self._phase = "ready", ""
            case "action_started":
                self._doing, self._phase = data["action"], "refine"
            case "phase":
                self._phase = data["phase"]
            case "action_done":
                self._done += 1

    def _say(self, t: float, said: str, style: str) -> None:
        from rich.text import Text

        self._console.print(Text(f"{t:8.2f} s  ", style="dim").append(said, style=style or "default"))

    def _draw(self) -> None:
        now = time.perf_counter()
        if now - self._drawn < REDRAW:
            return
        self._drawn = now
        from rich.text import Text

        share = f"[{self._done}/{self._planned}] " if self._planned else ""
        line = Text.assemble(
            (f"{self._t:8.2f} s  ", "bold"),
            (f"{share}{self._doing}", "bold cyan"),
            f"  {self._phase}" if self._phase else "",
            (f"  {self._force:5.1f} N", "yellow" if self._force > 0.5 else "dim"),
            (f"  {self._t / max(now - self._started, 1e-9):4.2f}× real time", "dim"),
        )
        line.no_wrap, line.overflow = True, "ellipsis"
        self._live.update(line, refresh=True)


_STYLES = {
    "planner_crashed": "red",
    "refinement_failed": "yellow",
    "learned": "magenta",
    "plan_installed": "cyan",
    "action_failed": "red",
    "refined_again": "yellow",
    "replan": "bold yellow",
    "goal_reached": "bold green",
    "run_ended": "bold red",
}


def _step(event: Event) -> str | None:
    """The steps of an action, which the live line shows without a sentence."""
    match event.kind:
        case "phase":
            return f"{event.data['action']}: {event.data['phase']}"
        case "action_done":
            return f"{event.data['action']}: done"
    return None
