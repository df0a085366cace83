"""What sweeps found, by scene and class of disturbance: success and how sure that is, time lost, why runs failed."""

import math
import re
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from bt_tamp.disturb.names import CLASSES, can_be_reached, chosen
from bt_tamp.replay import replay_command, words
from bt_tamp.report.result import RunResult
from bt_tamp.sweep_store import UNFINISHED, Stored

Z95 = 1.959964
"""Standard deviations within which 95 % of a normal distribution lie."""

UNDISTURBED = "none"

TOGETHER = "all"
"""Scene of lines that are about the runs of all."""

WITHOUT_A_PLAN = ("refined_again", "rebuilt")
"""Answers that take no new task plan."""

RIGHT_VERDICTS = ("proven_infeasible", "no_plan")
"""How a run should end whose goal can't be reached, if it also says what put it out of reach."""


@dataclass(frozen=True)
class Run:
    """A stored run: `disturb` its classes ("none" for none), `replan` False for the open-loop baseline, `command` that
    replays it. `succeeded`: the goal was reached, or the right verdict given where it can't be: one that names the
    body that was taken or thrown away. choices: what else was chosen, as on the command line; digest: of the scene's
    file, "" where that wasn't kept."""

    scene: str
    seed: int
    disturb: str
    replan: bool
    outcome: str
    reason: str
    result: RunResult | None
    command: str
    choices: str = ""
    digest: str = ""

    @property
    def is_reachable(self) -> bool:
        """Can the goal still be reached, by what was declared before the run?"""
        return can_be_reached(chosen(self.disturb))

    @property
    def is_met(self) -> bool:
        """Did what was to befall it befall it, and matter? A run that failed counts as one, whatever made it fail."""
        if self.disturb == UNDISTURBED or self.result is None or self.outcome != "goal_reached":
            return True
        return any(one.mattered for one in self.result.disturbances)

    @property
    def succeeded(self) -> bool:
        if self.is_reachable or not self.is_met:
            return self.outcome == "goal_reached"
        return self.outcome in RIGHT_VERDICTS and any(map(self._names, self._lost))

    @property
    def _lost(self) -> list[str]:
        """The bodies without which the goal can't be reached any more."""
        befell = self.result.disturbances if self.result is not None else ()
        hopeless = [one for one in befell if one.name in CLASSES and not can_be_reached([one.name])]
        return [name for one in hopeless for name in one.bodies]

    def _names(self, body: str) -> bool:
        return naming([body]).search(self.reason) is not None


@dataclass(frozen=True)
class Line:
    """The runs of one scene, class and way, and of the same other choices (`variant`): `runs` and everything else are
    of those that were met, `unmet` counts the rest; but no run may break a limit: peak_n and violations are of all.

    interval: 95 % of the success rate, by Wilson. lost_s: median of robot time beyond that of the undisturbed run of
    the same scene and seed, both having succeeded; lost_actions: the same as a multiple of the action that was undone.
    reacted_s, slow_reacted_s: median and 95 % of the time, from when the sensors could show it, until an action that
    was disturbed stood still or set out anew, where that took no new plan; reactions: how many. peak_n: the largest
    true force. violations: torques beyond their limit or NaN."""

    scene: str
    disturb: str
    replan: bool
    variant: str
    runs: int
    succeeded: int
    interval: tuple[float, float]
    replans: float | None
    lost_s: float | None
    lost_actions: float | None
    reacted_s: float | None
    slow_reacted_s: float | None
    reactions: int
    peak_n: float | None
    violations: int
    crashes: int
    unmet: int
    reasons: tuple[tuple[str, int], ...]

    @property
    def befell(self) -> str:
        """Class and variant."""
        return ", ".join(part for part in (self.disturb, self.variant) if part)


def runs_of(stored: Iterable[Stored]) -> list[Run]:
    """The stored runs."""
    return [run_of(row) for row in stored]


def run_of(row: Stored) -> Run:
    """A stored run."""
    disturb = ",".join(row.options.get("disturb", ())) or UNDISTURBED
    result = None if row.result is None else RunResult.from_json(row.result)
    return Run(
        *(row.scene, row.seed, disturb, bool(row.options.get("replan", True)), row.outcome, row.reason, result),
        command=replay_command(row.scene, row.seed, row.options),
        choices=shlex.join(words(row.options, leaving=("disturb", "replan"))),
        digest=str(row.options.get("digest", "")),
    )


def naming(bodies: Iterable[str]) -> re.Pattern[str]:
    """What finds the names of bodies in a sentence: not those that only hold such a name, nor "can't" for a can."""
    longest_first = sorted(bodies, key=len, reverse=True)
    return re.compile(rf"(?<![\w-])(?:{'|'.join(map(re.escape, longest_first))})(?![\w'-])")


def wilson(succeeded: int, runs: int) -> tuple[float, float]:
    """95 % interval of a success rate (Wilson 1927). Of no runs: anything."""
    if runs == 0:
        return 0.0, 1.0
    rate, z2 = succeeded / runs, Z95**2
    centre = (rate + z2 / (2 * runs)) / (1 + z2 / runs)
    half = Z95 / (1 + z2 / runs) * math.sqrt(rate * (1 - rate) / runs + z2 / (4 * runs**2))
    # Of none or all the bound is exactly 0 or 1, which rounding would miss.
    low = 0.0 if succeeded == 0 else max(0.0, centre - half)
    return low, 1.0 if succeeded == runs else min(1.0, centre + half)


def lines(runs: Sequence[Run], together: bool = False) -> list[Line]:
    """One line for each scene, class, way (watching or open loop) and variant, undisturbed runs first. together: all
    scenes' runs of a class, way and variant in one line."""
    files: dict[str, set[str]] = {}
    for run in runs:
        files.setdefault(run.scene, set()).add(run.digest)
    groups: dict[tuple[str, str, bool, str], list[Run]] = {}
    for run in runs:
        is_one_of_some = len(files[run.scene]) > 1 and not together
        variant = " ".join([run.choices] * bool(run.choices) + [f"file {run.digest[:6] or '?'}"] * is_one_of_some)
        groups.setdefault((TOGETHER if together else run.scene, run.disturb, run.replan, variant), []).append(run)
    order = {name: number for number, name in enumerate((UNDISTURBED, *CLASSES))}
    keys = sorted(groups, key=lambda key: (key[0], key[3], order.get(key[1], len(order)), key[1], not key[2]))
    usual = {_setting(run): run for run in runs if run.disturb == UNDISTURBED and run.succeeded}
    return [_line(key, groups[key], usual) for key in keys]


def _setting(run: Run) -> tuple[object, ...]:
    """What a disturbed run shares with the undisturbed one beside it."""
    return run.scene, run.seed, run.choices, run.digest, run.replan


def _line(key: tuple[str, str, bool, str], runs: Sequence[Run], usual: Mapping[tuple, Run]) -> Line:
    met = [run for run in runs if run.is_met]
    results = [run.result for run in met if run.result is not None]
    every = [run.result for run in runs if run.result is not None]
    succeeded = sum(run.succeeded for run in met)
    lost, shares = [], []
    for run in met:
        plain = usual.get(_setting(run))
        if run.succeeded and run.is_reachable and plain is not None and run.result and plain.result:
            lost.append(run.result.robot_s - plain.result.robot_s)
            undone = undone_s(run.result, plain.result)
            shares += [lost[-1] / undone] if undone else []
    reactions = reactions_of(results)
    failed = Counter(_why(run) for run in met if not run.succeeded)
    return Line(
        *key,
        runs=len(met),
        succeeded=succeeded,
        interval=wilson(succeeded, len(met)),
        replans=_median([result.replans for result in results]),
        lost_s=_median(lost),
        lost_actions=_median(shares),
        reacted_s=_median(reactions),
        slow_reacted_s=at_95(reactions),
        reactions=len(reactions),
        peak_n=max((max(result.peak_force_n, result.peak_contact_force_n) for result in every), default=None),
        violations=sum(result.torque_limit_violations + result.unlawful_commands for result in every),
        crashes=sum(run.outcome in UNFINISHED for run in met),
        unmet=len(runs) - len(met),
        reasons=tuple(failed.most_common()),
    )


def reactions_of(results: Iterable[RunResult]) -> list[float]:
    """Seconds until an action that was disturbed stood still or set out anew, where that took no new task plan: from
    when the sensors could show it."""
    return [
        one.reacted_s
        for result in results
        for one in result.disturbances
        if one.answer in WITHOUT_A_PLAN and one.reacted_s is not None
    ]


def undone_s(disturbed: RunResult, plain: RunResult) -> float | None:
    """How long the action took, in the undisturbed run, that the first disturbance undid which had to be answered: the
    one that was running, if it was about the same body, else the first that was. None if there was no such action."""
    told = [one for one in disturbed.disturbances if one.bodies and one.answer]
    if not told or len(plain.executed) != len(plain.executed_s):
        return None
    took = dict(zip(reversed(plain.executed), reversed(plain.executed_s), strict=True))
    name, running = told[0].bodies[0], told[0].action
    about = [action for action in plain.executed if name in action.partition("(")[2].rstrip(")").split(", ")]
    return took.get(running if running in about else next(iter(about), ""))


def at_95(values: Sequence[float]) -> float | None:
    """The value that 95 % do not exceed."""
    return sorted(values)[math.ceil(0.95 * len(values)) - 1] if values else None


def hits(runs: Iterable[Run]) -> Counter[str]:
    """How often each phase of each skill was disturbed, and planning."""
    return Counter(
        "planning" if one.phase == "planning" else f"{one.action.partition('(')[0]} {one.phase}".strip()
        for run in runs
        if run.result is not None and run.disturb != UNDISTURBED
        for one in run.result.disturbances
    )


def totals(runs: Sequence[Run]) -> list[str]:
    """What all disturbed runs come to, in one sentence for each way."""
    told = []
    for replan in (True, False):
        mine = [run for run in runs if run.replan == replan and run.disturb != UNDISTURBED]
        if not mine:
            continue
        met = [run for run in mine if run.is_met]
        results = [run.result for run in mine if run.result is not None]
        broken = sum(result.torque_limit_violations + result.unlawful_commands for result in results)
        peak = max((max(result.peak_force_n, result.peak_contact_force_n) for result in results), default=0.0)
        parts = [
            f"{_share(reachable)} {what}"
            for is_reachable, what in ((True, "reached a goal that can be"), (False, "told rightly that it can't be"))
            if (reachable := [run for run in met if run.is_reachable == is_reachable])
        ]
        parts.append(
            f"{sum(run.outcome in UNFINISHED for run in mine)} crashed or hung, {broken} torques broke a limit"
        )
        parts.append(f"peak {peak:.1f} N")
        way = "watching" if replan else "open loop"
        told.append(f"{way}: {len(met)} of {len(mine)} disturbed runs were met; {'; '.join(parts)}")
    return told


def _share(runs: Sequence[Run]) -> str:
    succeeded = sum(run.succeeded for run in runs)
    low, high = wilson(succeeded, len(runs))
    rate = f"{100 * succeeded / len(runs):.1f} %, {100 * low:.1f}–{100 * high:.1f}"
    return f"{succeeded} of {len(runs)} ({rate})"


def _why(run: Run) -> str:
    reason = run.reason if len(run.reason) <= 120 else run.reason[:119] + "…"
    return f"{run.outcome.replace('_', ' ')}: {reason}" if reason else run.outcome.replace("_", " ")


def _median(values: Sequence[float]) -> float | None:
    return median(values) if values else None


def scene_name(scene: str) -> str:
    """A scene as it is shown in tables."""
    return Path(scene).stem
