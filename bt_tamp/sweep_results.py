"""What sweeps found, by scene and class of disturbance: success and how sure that is, time lost, why runs failed."""

import math
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from bt_tamp.disturb.names import CLASSES
from bt_tamp.report.result import RunResult
from bt_tamp.sweep_store import Stored

Z95 = 1.959964
"""Standard deviations within which 95 % of a normal distribution lie."""

UNDISTURBED = "none"

RIGHT_VERDICTS = ("proven_infeasible", "no_plan")
"""How a run should end whose goal can't be reached."""


@dataclass(frozen=True)
class Run:
    """A stored run: `disturb` its classes ("none" for none), `replan` False for the open-loop baseline, `command` that
    replays it. `succeeded`: the goal was reached, or the right verdict given where it can't be."""

    scene: str
    seed: int
    disturb: str
    replan: bool
    outcome: str
    reason: str
    result: RunResult | None
    command: str
    options: str

    @property
    def is_reachable(self) -> bool:
        """Can the goal still be reached, by what was declared before the run?"""
        return self.disturb == UNDISTURBED or all(CLASSES[name].is_reachable for name in self.disturb.split(","))

    @property
    def was_disturbed(self) -> bool:
        """Did anything befall it? What is software's failing befalls every run."""
        return self.result is not None and bool(self.result.disturbances)

    @property
    def succeeded(self) -> bool:
        if self.is_reachable or not self.was_disturbed:
            return self.outcome == "goal_reached"
        return self.outcome in RIGHT_VERDICTS


@dataclass(frozen=True)
class Line:
    """The runs of one scene and class. interval: 95 % of the success rate, by Wilson. lost_s: median of robot time
    beyond that of the undisturbed run of the same scene and seed, both having succeeded. answered_s: median time from
    a disturbance to the first answer without a new plan. unmet: runs that nothing befell."""

    scene: str
    disturb: str
    replan: bool
    runs: int
    succeeded: int
    interval: tuple[float, float]
    replans: float | None
    lost_s: float | None
    answered_s: float | None
    peak_n: float | None
    torque_violations: int
    crashes: int
    unmet: int
    reasons: tuple[tuple[str, int], ...]


def runs_of(stored: Iterable[Stored]) -> list[Run]:
    """The stored runs."""
    return [_run(row) for row in stored]


def _run(row: Stored) -> Run:
    options = dict(row.options)
    disturb = ",".join(options.pop("disturb", ())) or UNDISTURBED
    replan = bool(options.pop("replan", True))
    result = None if row.result is None else RunResult.from_json(row.result)
    command = replay_command(row.scene, row.seed, row.options)
    rest = repr(sorted(options.items(), key=str))
    return Run(row.scene, row.seed, disturb, replan, row.outcome, row.reason, result, command, rest)


def replay_command(scene: str, seed: int, options: Mapping[str, Any]) -> str:
    """The command line that runs the same once more."""
    words = ["bt-tamp", "run", scene, "--seed", str(seed)]
    for name, usual in _USUAL.items():
        value = options.get(name, usual)
        if name == "disturb" and value:
            words += ["--disturb", ",".join(value)]
        elif name == "replan" and not value:
            words.append("--no-replan")
        elif name not in ("disturb", "replan") and value != usual:
            words += [f"--{name.replace('_', '-')}", f"{value:g}" if isinstance(value, float) else str(value)]
    return shlex.join(words)


_USUAL: dict[str, Any] = {
    "disturb": (),
    "replan": True,
    "contact": "hybrid",
    "preset": "default",
    "search": None,
    "tries": None,
    "motion_planner": None,
    "domain": None,
    "problem": None,
    "max_sim_time": 900.0,
}


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


def lines(runs: Sequence[Run]) -> list[Line]:
    """One line for each scene, class and way (watching or open loop), undisturbed runs first."""
    groups: dict[tuple[str, str, bool], list[Run]] = {}
    for run in runs:
        groups.setdefault((run.scene, run.disturb, run.replan), []).append(run)
    order = {name: number for number, name in enumerate((UNDISTURBED, *CLASSES))}
    keys = sorted(groups, key=lambda key: (key[0], order.get(key[1], len(order)), key[1], not key[2]))
    usual = {(r.scene, r.seed, r.options, r.replan): r for r in runs if r.disturb == UNDISTURBED and r.succeeded}
    return [_line(key, groups[key], usual) for key in keys]


def _line(key: tuple[str, str, bool], runs: Sequence[Run], usual: Mapping[tuple, Run]) -> Line:
    results = [run.result for run in runs if run.result is not None]
    succeeded = sum(run.succeeded for run in runs)
    lost = []
    for run in runs:
        plain = usual.get((run.scene, run.seed, run.options, run.replan))
        if run.succeeded and run.is_reachable and plain is not None and run.result and plain.result:
            lost.append(run.result.robot_s - plain.result.robot_s)
    answers = [
        one.answered_after_s
        for result in results
        for one in result.disturbances
        if one.answer in ("refined_again", "rebuilt") and one.phase != "planning" and one.answered_after_s is not None
    ]
    failed = Counter(_why(run) for run in runs if not run.succeeded)
    return Line(
        *key,
        runs=len(runs),
        succeeded=succeeded,
        interval=wilson(succeeded, len(runs)),
        replans=_median([result.replans for result in results]),
        lost_s=_median(lost),
        answered_s=_median(answers),
        peak_n=max((result.peak_contact_force_n for result in results), default=None),
        torque_violations=sum(result.torque_limit_violations for result in results),
        crashes=sum(run.outcome in ("crashed", "killed") for run in runs),
        unmet=0 if key[1] == UNDISTURBED else sum(not run.was_disturbed for run in runs),
        reasons=tuple(failed.most_common()),
    )


def _why(run: Run) -> str:
    reason = run.reason if len(run.reason) <= 120 else run.reason[:119] + "…"
    return f"{run.outcome.replace('_', ' ')}: {reason}" if reason else run.outcome.replace("_", " ")


def _median(values: Sequence[float]) -> float | None:
    return median(values) if values else None


def scene_name(scene: str) -> str:
    """A scene as it is shown in tables."""
    return Path(scene).stem
