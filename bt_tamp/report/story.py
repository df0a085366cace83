"""The story of a run in plain English, from its events: plans, what failed, why, what was learned, how it ended."""

import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

from bt_tamp.replay import words
from bt_tamp.report.events import Event
from bt_tamp.report.result import RunResult
from bt_tamp.report.sentences import GONE_ON, counted, in_the_way, planner_failed

WIDTH = 100


def story(events: Iterable[Event], result: RunResult | None) -> str:
    """The whole story, lines of at most `WIDTH` characters. Without a result it says that the run was cut off.

    Raises ValueError for an event that lacks what its kind has.
    """
    teller = _Teller()
    for event in events:
        teller.hear(event)
    teller.end(result)
    return "\n".join(teller.lines)


class _Teller:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self._plans, self._has_begun = 0, False
        self._proposed: list[str] | None = None
        self._is_planning = False
        self._started: dict[str, float] = {}
        self._phases: list[str] = []
        self._running: str | None = None
        self._last_failure = ""
        self._unmet: list[str] = []
        self._waits_since: float | None = None

    def hear(self, event: Event) -> None:
        tell = getattr(self, f"_{event.kind}", None)
        try:
            if tell is not None:
                tell(event, event.data)
        except KeyError as key:
            raise ValueError(f"event {event.kind!r} at {event.t:g} s: lacks {key}") from None

    def _run_started(self, event: Event, data: Any) -> None:
        noise = "the nominal scene" if data["seed"] == 0 else "with that seed's noise"
        if data.get("resumed"):
            noise = GONE_ON
        told = "".join(f", {word}" for word in [" ".join(words(data.get("choices", {})))] if word)
        self._heading(f"{data['scene']}, seed {data['seed']} ({noise}){told}")

    def _round(self, event: Event, data: Any) -> None:
        self._waits_since = None
        if not self._is_planning:
            self._proposed = None
            self._begin_planning(event.t)
        plan = data["plan"]
        lead, failed = f"Round {data['round']}: ", planner_failed(event)
        if failed:
            self._say(f"{lead}{failed}.")
        elif plan is None:
            self._say(f"{lead}with what had been learned, no sequence of actions led to the goal.")
        else:
            self._say(f"{lead}{_proposal(plan, self._proposed)}")
            self._proposed = plan

    def _begin_planning(self, t: float) -> None:
        self._is_planning = True
        self._heading(f"Planning, at {t:.1f} s" if self._has_begun else "Planning before anything is done")

    def _proof_sought(self, event: Event, data: Any) -> None:
        failed = planner_failed(event)
        self._say(f"By proofs alone: {failed}." if failed else _by_proofs(data["plan"]), "  - ")

    def _refinement_failed(self, event: Event, data: Any) -> None:
        self._say(f"{data['action']} could not be worked out: {data['reason']}{in_the_way(event)}.", "  - ")

    def _planner_crashed(self, event: Event, data: Any) -> None:
        crashes = "; ".join(data["crashes"])
        self._say(f"The program crashed in {data['doing']} {data['action']}, which cost samples: {crashes}.", "  - ")

    def _backtracked(self, event: Event, data: Any) -> None:
        self._say(f"So another choice was made for {data['to']}.", "  - ")

    def _learned(self, event: Event, data: Any) -> None:
        self._say(f"Learned: {data['sentence']}.", "  - ")

    def _widened(self, event: Event, data: Any) -> None:
        self._say(
            f"Nothing was left to try within the budget, so it was widened to {data['tries']} samples for each action,"
            " and what rested on fewer samples was taken back.",
            "  - ",
        )

    def _solved(self, event: Event, data: Any) -> None:
        if not data["plan"]:
            return
        steps, fewer = counted(len(data["plan"]), "action"), len(data["plan"]) < len(self._proposed or ())
        along = ", what else was proposed comes along" if fewer else ""
        self._say(f"A way was found to do all of it: {steps}{along}; {counted(data['rounds'], 'round')}.", "  - ")

    def _plan_installed(self, event: Event, data: Any) -> None:
        self._is_planning, self._has_begun, self._waits_since = False, True, None
        if not data["actions"]:
            self._heading("What was done")
            return
        self._plans += 1
        self._heading(f"Plan {self._plans}, in force from {event.t:.1f} s")
        for number, action in enumerate(data["actions"], start=1):
            self._say(action, f"  {number:2}. ")
        self._heading("What was done")

    def _action_started(self, event: Event, data: Any) -> None:
        self._running, self._phases = data["action"], []
        self._started[data["action"]] = event.t

    def _phase(self, event: Event, data: Any) -> None:
        self._phases.append(data["phase"])

    def _action_done(self, event: Event, data: Any) -> None:
        self._running = None
        start = self._started.get(data["action"], event.t)
        self._say(f"{data['action']}: {', '.join(self._phases)}.", f"{start:7.1f} – {event.t:5.1f} s  ")
        self._phases = []

    def _action_failed(self, event: Event, data: Any) -> None:
        where = f" in its phase {self._phases[-1]!r}" if self._phases else ""
        self._running, self._last_failure = None, data["reason"]
        self._say(f"{data['action']} failed{where}: {data['reason']}.", f"{event.t:7.1f} s          ")

    def _refined_again(self, event: Event, data: Any) -> None:
        self._say(f"{data['action']} was worked out anew: {data['reason']}.", f"{event.t:7.1f} s          ")

    def _lifting_off(self, event: Event, data: Any) -> None:
        self._say("The arm rose out of contact before it planned.", f"{event.t:7.1f} s          ")

    def _skipped(self, event: Event, data: Any) -> None:
        self._say(f"Skipped, as it was done already: {', '.join(data['actions'])}.", f"{event.t:7.1f} s          ")

    def _redone(self, event: Event, data: Any) -> None:
        lacking = f", as {', '.join(data['lacking'])} did not hold" if data["lacking"] else ""
        self._say(f"To be done again{lacking}: {', '.join(data['actions'])}.", f"{event.t:7.1f} s          ")

    def _replan(self, event: Event, data: Any) -> None:
        if self._running is not None:
            where = f" in its phase {self._phases[-1]!r}" if self._phases else ""
            self._say(f"{self._running} was broken off{where}.", f"{event.t:7.1f} s          ")
            self._running = None
        self._waits_since = None
        reason = "" if data["reason"] == self._last_failure else f": {data['reason']}"
        self._say(f"The plan was dropped{reason}. A new one was sought from what was observed then.")

    def _put_off(self, event: Event, data: Any) -> None:
        self._is_planning = False
        self._say(f"There was no way to {', '.join(data['goal'])}: {data['reason']}. The rest was to be done first.")

    def _disturbed(self, event: Event, data: Any) -> None:
        during = f"{data['action']} in its phase {data['phase']!r}" if data.get("action") else repr(data["phase"])
        if not self._has_begun and not self._is_planning:
            self._begin_planning(event.t)
        meanwhile = ", while planning" if data["phase"] == "planning" else f", during {during}"
        self._say(f"DISTURBANCE{meanwhile}: {data['sentence']}.", f"{event.t:7.1f} s          ")

    def _never_came(self, event: Event, data: Any) -> None:
        self._unmet.append(data["sentence"])

    def _missing(self, event: Event, data: Any) -> None:
        names = ", ".join(data["bodies"])
        self._waits_since = event.t if self._waits_since is None else self._waits_since
        self._say(f"The arm waited for {names} to turn up again.", f"{event.t:7.1f} s          ")

    def _waiting(self, event: Event, data: Any) -> None:
        self._say(
            f"Everything lay where it should; {', '.join(data['bodies'])} still moved.", f"{event.t:7.1f} s          "
        )

    def _goal_reached(self, event: Event, data: Any) -> None:
        self._say("The goal held, everything at rest.", f"{event.t:7.1f} s          ")

    def end(self, result: RunResult | None) -> None:
        if self._running is not None:
            where = f", in its phase {self._phases[-1]!r}" if self._phases else ""
            self._say(f"{self._running} was under way{where}.", f"{self._started[self._running]:7.1f} s          ")
        self._heading("How it ended")
        if result is None:
            self._say("The run was cut off: it left no result.")
            return
        if self._waits_since is not None:
            self._say(f"The arm had waited in vain since {self._waits_since:.1f} s.")
        self._say(_ENDINGS[result.outcome].format(reason=result.reason))
        missing = [literal for literal, holds in result.goal.items() if not holds]
        if missing:
            self._say(f"Of the goal, {', '.join(missing)} did not hold.")
        for sentence in self._unmet:
            self._say(sentence[0].upper() + sentence[1:] + ".")
        felt = f"{result.peak_contact_force_n:.1f} N as felt along what was pressed"
        self._say(
            f"Robot time {result.robot_s:.1f} s, real time {result.wall_s:.1f} s, of which planning took"
            f" {result.planning_wall_s:.1f} s ({result.planning_cpu_s:.1f} s of CPU,"
            f" {counted(result.rounds, 'round')}, {counted(result.replans, 'replan')}). Contact force truly"
            f" reached {result.peak_force_n:.1f} N ({felt});"
            f" {counted(len(result.unintended_contacts), 'unintended contact')}."
        )
        for motion in result.pressed:
            self._say(
                f"{motion.action} pressed with {motion.mean_n:.2f} N, {motion.target_n:.4g} N wanted: off by"
                f" {motion.rms_error_n / motion.target_n:.1%} (RMS), peak {motion.peak_n:.1f} N",
                "  - ",
            )
        for touch in result.unintended_contacts:
            doing = " ".join(part for part in (touch.action, touch.phase) if part)
            self._say(f"{touch.first} and {touch.second} at {touch.t:.1f} s, {touch.force_n:.1f} N ({doing})", "  - ")

    def _heading(self, text: str) -> None:
        self.lines += [""] * bool(self.lines) + [text]

    def _say(self, text: str, lead: str = "  ") -> None:
        self.lines += textwrap.wrap(text, WIDTH, initial_indent=lead, subsequent_indent=" " * len(lead)) or [lead]


_ENDINGS = {
    "goal_reached": "The goal was reached.",
    "planned": "A plan was found.",
    "proven_infeasible": "The goal was proven out of reach: {reason}.",
    "no_plan": "There was no plan: {reason}.",
    "gave_up": "The run gave up: {reason}.",
    "crashed": "The run ended with an error in the program ({reason}); crash.txt in its folder tells where.",
    "interrupted": "Before its end {reason}.",
}


def _by_proofs(plan: Sequence[str] | None) -> str:
    if plan is None:
        return "Even if all were possible that isn't proven impossible, nothing would lead to the goal."
    return "By proofs alone the goal isn't out of reach: the obstacles found so far rest on samples."


def _proposal(plan: Sequence[str], before: Sequence[str] | None) -> str:
    """The proposed plan: whole when it is the first, else what is new in it."""
    if not plan:
        return "nothing was left to do."
    if before is None:
        return f"the task planner proposed {', '.join(plan)}."
    new = [action for action in plan if action not in before]
    gone = [action for action in before if action not in plan]
    if not new and not gone:
        return f"the same actions again, {'in the same order' if list(plan) == list(before) else 'in another order'}."
    parts = [f"with {', '.join(new)}"] * bool(new) + [f"without {', '.join(gone)}"] * bool(gone)
    return f"a plan of {counted(len(plan), 'action')}, now {' and '.join(parts)}."
