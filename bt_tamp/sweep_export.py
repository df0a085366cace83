"""Results of sweeps as CSV files and PNG plots."""

import csv
from collections.abc import Sequence
from pathlib import Path

from bt_tamp.sweep_results import Line, Run, scene_name

RUN_COLUMNS = (
    "scene seed disturb replan outcome met succeeded robot_s replans peak_force_n disturbance action phase mattered "
    "answer answered_after_s reacted_after_s hidden_s reason command"
).split()


def write_csv(folder: Path, runs: Sequence[Run], lines: Sequence[Line]) -> list[Path]:
    """`runs.csv`, a line a run, and `table.csv`, a line for each scene and class."""
    with (folder / "runs.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(RUN_COLUMNS)
        writer.writerows(_row(run) for run in runs)
    with (folder / "table.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = [name for name in Line.__dataclass_fields__ if name not in ("interval", "reasons")]
        writer.writerow([*names, "low", "high", "reasons"])
        for line in lines:
            reasons = "; ".join(f"{count}× {why}" for why, count in line.reasons)
            interval = line.interval if line.runs else ("", "")
            writer.writerow([*(getattr(line, name) for name in names), *interval, reasons])
    return [folder / "runs.csv", folder / "table.csv"]


def _row(run: Run) -> list[object]:
    result = run.result
    befell = result.disturbances if result is not None else ()
    first = next((one for one in befell if one.mattered), befell[0] if befell else None)
    figures = [None] * 3 if result is None else [result.robot_s, result.replans, result.peak_force_n]
    names = ("sentence", "action", "phase", "mattered", "answer", "answered_after_s", "reacted_after_s", "hidden_s")
    told = [None if first is None else getattr(first, name) for name in names]
    known = [run.scene, run.seed, run.disturb, run.replan, run.outcome, run.is_met, run.succeeded]
    return [*known, *figures, *told, run.reason, run.command]


def plot(folder: Path, lines: Sequence[Line]) -> list[Path]:
    """Success rates with their intervals, and time lost, a file a scene. Raises ImportError without matplotlib."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    made = []
    for scene in dict.fromkeys(line.scene for line in lines):
        mine = [line for line in lines if line.scene == scene]
        names = list(dict.fromkeys(line.befell for line in mine))
        figure, (left, right) = plt.subplots(1, 2, figsize=(11, 1.5 + 0.28 * len(names)), sharey=True)
        for replan, colour, shift in ((True, "C0", 0.15), (False, "C3", -0.15)):
            for line in (line for line in mine if line.replan == replan and line.runs):
                y, rate = names.index(line.befell) + shift, line.succeeded / line.runs
                low, high = line.interval
                left.plot([low, high], [y, y], color=colour, linewidth=1.5)
                left.plot([rate], [y], "o", color=colour, markersize=4)
                if line.lost_s is not None:
                    right.barh([y], [line.lost_s], height=0.28, color=colour)
        left.set_yticks(range(len(names)), names)
        left.set_ylim(len(names) - 0.4, -0.6)
        for axes in (left, right):
            axes.grid(axis="x", color="0.9")
            axes.set_axisbelow(True)
        left.set_xlim(-0.02, 1.02)
        left.set_xlabel("success rate, 95 % interval")
        ways = {True: "watching (blue)", False: "open loop (red)"}
        told = ", ".join(way for replan, way in ways.items() if any(line.replan == replan for line in mine))
        left.set_title(f"{scene_name(scene)}: {told}")
        right.set_xlabel("median robot time lost, s")
        path = folder / f"{scene_name(scene)}.png"
        figure.tight_layout()
        figure.savefig(path, dpi=120)
        plt.close(figure)
        made.append(path)
    return made
