"""Takes down a run while it happens: events, signals, PDDL, plans, trees, and the result."""

from collections.abc import Sequence
from types import TracebackType
from typing import Any, Protocol, TextIO

import py_trees

from bt_tamp.export.snapshot import Results, TreeNode, snapshot
from bt_tamp.report.events import Event
from bt_tamp.report.folder import CRASH, EVENTS, PDDL, PLANS, RESULT, SCENARIO, SIGNALS, STATE, TREES, RunFolder
from bt_tamp.report.result import RunResult
from bt_tamp.report.signals import Contact, Reference, SignalTable
from bt_tamp.report.state import RunState
from scenarios.scenario import Scenario
from sim.plant import Observation


class Watcher(Protocol):
    """Someone who looks on: the terminal's live display."""

    def event(self, event: Event) -> None:
        """Something happened."""
        ...

    def progress(self, t: float, force: float) -> None:
        """Simulated time t (s) and contact force (N) now; called at the sampling rate."""
        ...

    def close(self) -> None:
        """The run is over: leave the terminal as it was found."""
        ...


class RunRecorder:
    """Records one run of `scenario` into `folder` (None: keeps nothing) and tells `watcher`.

    A context manager: on leaving it, whatever was recorded lies whole in the folder. `rate` and
    `contact_rate` are samples per simulated second; `sample` and `contacts` may be called more often.
    """

    def __init__(
        self,
        scenario: Scenario,
        folder: RunFolder | None = None,
        watcher: Watcher | None = None,
        rate: float = 100.0,
        contact_rate: float = 30.0,
    ) -> None:
        self.scenario = scenario
        self.folder = folder
        self.watcher = watcher
        self.result: RunResult | None = None
        self.last_tree: TreeNode | None = None
        self._events: TextIO | None = None
        self._signals = SignalTable(list(scenario.bodies)) if folder is not None else None
        self._period, self._next = 1.0 / rate, -1.0
        self._contact_period, self._contact_next = 1.0 / contact_rate, -1.0
        self._trees = 0

    def __enter__(self) -> "RunRecorder":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def event(self, kind: str, t: float, **data: Any) -> None:
        """Something happened at simulated time t (s). `cpu_s` and `wall_s` are shown, not stored."""
        happened = Event(kind, t, data)
        if self.folder is not None:
            if self._events is None:
                self._events = self._start(self.folder)
            self._events.write(happened.to_line() + "\n")
            self._events.flush()
        if self.watcher is not None:
            self.watcher.event(happened)

    def sample(self, observation: Observation, reference: Reference, force: float) -> None:
        """Call at every control tick: stored when due. `force` is the measured contact force in N."""
        t = observation.t
        if t < self._next:
            return
        self._next = t + self._period - 1e-6
        if self._signals is not None:
            self._signals.add(observation, reference, force)
        if self.watcher is not None:
            self.watcher.progress(t, force)

    def contacts_due(self, t: float) -> bool:
        """Is it time for `contacts` again? Spares the engine's query otherwise."""
        return self._signals is not None and t >= self._contact_next

    def contacts(self, t: float, contacts: Sequence[Contact]) -> None:
        """The contact points at t (s), for the arrows in the video."""
        if self._signals is not None and t >= self._contact_next:
            self._contact_next = t + self._contact_period - 1e-6
            self._signals.add_contacts(t, contacts)

    def tree(self, root: py_trees.behaviour.Behaviour, why: str, results: Results | None = None) -> None:
        """The tree as it stands: `why` is a word or two ("planned", "skipped", "end") for the file's name."""
        self.last_tree = snapshot(root, results)
        if self.folder is None:
            return
        from bt_tamp.export.svg import to_svg
        from bt_tamp.export.text import to_unicode

        stem = f"{TREES}/{self._trees:03d}-{_slug(why)}"
        self._trees += 1
        self.folder.write(f"{stem}.json", self.last_tree.to_json())
        self.folder.write(f"{stem}.txt", to_unicode(self.last_tree) + "\n")
        self.folder.write(f"{stem}.svg", to_svg(self.last_tree))

    def pddl(self, name: str, domain: str, problem: str) -> None:
        """The files handed to the task planner; `name` says in which round."""
        self._text(f"{PDDL}/{name}-domain.pddl", domain)
        self._text(f"{PDDL}/{name}-problem.pddl", problem)

    def plan(self, name: str, text: str) -> None:
        """The plan of a round as text, one action a line."""
        self._text(f"{PLANS}/{name}.txt", text if text.endswith("\n") else text + "\n")

    def crash(self, trace: str) -> None:
        """An error in our own code ended the run; `trace` is its traceback."""
        self._text(CRASH, trace)

    @property
    def is_kept(self) -> bool:
        """Is the run written into a folder?"""
        return self.folder is not None

    def state(self, state: RunState) -> None:
        """How things stand now: where another run can go on, should this one be killed."""
        self._text(STATE, state.to_json())

    def finish(self, result: RunResult, state: RunState) -> None:
        """The run has ended, things standing as in `state`: everything is written, `result.json` last."""
        self.result = result
        self._save_signals()
        self.state(state)
        self._text(RESULT, result.to_json())

    def close(self) -> None:
        """End the recording; also after an interruption, when `finish` was never called."""
        if self._events is not None:
            self._events.close()
            self._events = None
            if self.result is None:
                self._save_signals()
        if self.watcher is not None:
            self.watcher.close()

    def _start(self, folder: RunFolder) -> TextIO:
        from bt_tamp.report.scenario_json import scenario_to_json

        folder.write(SCENARIO, scenario_to_json(self.scenario))
        return (folder.path / EVENTS).open("w", encoding="utf-8")

    def _save_signals(self) -> None:
        if self.folder is not None and self._signals is not None and len(self._signals):
            with self.folder.writing(SIGNALS) as partial:
                self._signals.save(partial)

    def _text(self, name: str, text: str) -> None:
        if self.folder is not None:
            self.folder.write(name, text)


def _slug(why: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in why.lower()).strip("-") or "tree"
