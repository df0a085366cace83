"""Pictures of what a benchmark measured. Matplotlib is an extra: without it there are none."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from bt_tamp.bench.control import PARTS, Cost, middle
from bt_tamp.bench.drag import DragResult
from bt_tamp.bench.motion import SceneResult, queries_of, rows
from bt_tamp.bench.slide import SlideResult
from bt_tamp.bench.tamp import CPU_WANTED, TampResult
from bt_tamp.bench.task import TaskResult, excess
from bt_tamp.bench.wipe import WipeResult
from sim.robot import GRAVITY


def plot_forces(folder: Path, results: Sequence[SlideResult]) -> list[Path]:
    """One PNG a target: the laws beside each other, and hybrid control under every disturbance."""
    made = []
    for target in sorted({r.target for r in results}):
        figure, (above, below) = _figure(2, sharex=True)
        mine = [r for r in results if r.target == target]
        known = [r for r in mine if r.case == mine[0].case]
        for result in known:
            above.plot(result.times, result.forces, label=result.law, linewidth=1.0)
        for result in (r for r in mine if r not in known):
            thick = result.case.startswith("all together")
            below.plot(result.times, result.forces, linewidth=1.4 if thick else 0.7, color="C3" if thick else "C0")
        above.set_title(f"{target:g} N, everything known")
        below.set_title("hybrid, each disturbance alone (blue) and all together (red)")
        for axes in (above, below):
            axes.axhline(target, color="black", linewidth=0.5, linestyle="--")
            axes.set_ylim(0.0, 2.0 * target)
            axes.set_ylabel("true normal force, N")
        above.legend(loc="lower right")
        below.set_xlabel("seconds since touchdown")
        made.append(_saved(figure, folder / f"force-{target:g}N.png"))
    return made


def plot_wipes(folder: Path, results: Sequence[WipeResult]) -> list[Path]:
    """Crumbs by layout, those in the dustpan and those missed, and how many strokes each layout took."""
    figure, (above, below) = _figure(2, sharex=True)
    places = range(1, len(results) + 1)
    inside = [r.inside for r in results]
    above.bar(places, inside, color="C2", label="in the dustpan")
    above.bar(places, [len(r.missed) for r in results], bottom=inside, color="C3", label="missed")
    above.set_ylabel("crumbs")
    above.legend(loc="upper left")
    below.bar(places, [r.strokes for r in results], color="C0")
    below.set_ylabel("strokes")
    below.set_xlabel("layout")
    return [_saved(figure, folder / "wipe.png")]


def plot_drags(folder: Path, results: Sequence[DragResult]) -> list[Path]:
    """The force asked for by what friction holds the box back with, N both; red: not held in the end."""
    figure, (axes,) = _figure(1)
    for held, color, label in ((True, "C2", "dragged and picked"), (False, "C3", "not held in the end")):
        mine = [r for r in results if r.is_held == held]
        weights = [GRAVITY * r.layout.mass * r.layout.friction for r in mine]
        axes.scatter(weights, [r.force for r in mine], color=color, label=label)
    axes.set_xlabel("friction of the box on the table, N")
    axes.set_ylabel("greatest force asked for, N")
    axes.legend()
    return [_saved(figure, folder / "drag.png")]


def plot_costs(folder: Path, runs: Sequence[Sequence[Cost]]) -> list[Path]:
    """What a control tick costs, part by part."""
    figure, (axes,) = _figure(1)
    costs = middle(runs)
    reached = [0.0] * len(costs)
    for index, part in enumerate(PARTS):
        shares = [cost.parts[part] for cost in costs]
        color = "0.6" if part == "physics" else f"C{index % 10}"
        axes.barh([cost.regime for cost in costs], shares, left=reached, label=part, color=color, edgecolor="white")
        reached = [before + share for before, share in zip(reached, shares, strict=True)]
    axes.set_xlabel("µs of CPU time a control tick of 2 ms")
    axes.legend(ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return [_saved(figure, folder / "control.png")]


def plot_tables(folder: Path, results: Sequence[TampResult]) -> list[Path]:
    """CPU of planning by the number of objects, and the plans' lengths by the shortest known."""
    figure, (above, below) = _figure(2, sharex=True)
    colors = {"fig1": "C0", "table": "C2", "larger": "C1", "unsolvable": "C3"}
    for part, color in colors.items():
        mine = [r for r in results if r.case.part == part]
        above.scatter([r.case.objects for r in mine], [r.cpu_s for r in mine], color=color, label=part, s=14)
        known = [r for r in mine if r.shortest]
        below.scatter([r.case.objects for r in known], [r.steps / r.shortest for r in known], color=color, s=14)
    above.axhline(CPU_WANTED, color="black", linewidth=0.5, linestyle="--")
    above.set_yscale("log")
    above.set_ylabel("CPU of planning, s")
    above.legend(loc="upper left")
    below.set_ylabel("steps by the shortest known")
    below.set_xlabel("objects")
    return [_saved(figure, folder / "tamp.png")]


def plot_planners(folder: Path, results: Sequence[SceneResult]) -> list[Path]:
    """CPU time by length of the path, as found and after shortcutting: one point a planner."""
    figure, (axes,) = _figure(1)
    for row in rows(queries_of(results)):
        line = axes.plot([row.median_ms] * 2, [row.length, row.short], linewidth=0.7)[0]
        axes.plot(row.median_ms, row.length, "o", color=line.get_color(), label=f"{row.planner}, {row.solved:.0%}")
        axes.plot(row.median_ms, row.short, "v", color=line.get_color())
    axes.set_xscale("log")
    axes.set_xlabel("CPU time of a query, ms (median)")
    axes.set_ylabel("length by the shortest known")
    axes.set_title("● as found, ▼ shortened", fontsize="medium")
    axes.legend()
    return [_saved(figure, folder / "motion.png")]


def plot_tasks(folder: Path, results: Sequence[TaskResult]) -> list[Path]:
    """CPU time by number of objects, and how much longer than the shortest the plans are."""
    figure, (above, below) = _figure(2, sharex=True)
    sizes = [r.size for r in results]
    above.semilogy(sizes, [median(r.calls) for r in results], "o", color="C0", label="a call")
    above.semilogy(sizes, [sum(r.calls) for r in results], "x", color="C0", label="all rounds")
    for color, label, cpu in (
        ("C1", "all rounds, A*+h^max", "hmax_cpu"),
        ("C3", "one after the other", "fallback_cpu"),
    ):
        asked = [(r.size, getattr(r, cpu)) for r in results if getattr(r, cpu) is not None]
        above.semilogy([size for size, _ in asked], [cpu for _, cpu in asked], "+", color=color, label=label)
    above.set_ylabel("CPU seconds")
    above.legend(loc="upper left")
    below.plot(sizes, [100 * excess(r) for r in results], "o", color="C2")
    below.set_ylabel("longer than the shortest plan, %")
    below.set_xlabel("objects")
    return [_saved(figure, folder / "task.png")]


PLOTS: Mapping[str, Callable[[Path, Sequence[Any]], list[Path]]] = {
    "force": plot_forces,
    "wipe": plot_wipes,
    "drag": plot_drags,
    "tamp": plot_tables,
    "motion": plot_planners,
    "control": plot_costs,
    "task": plot_tasks,
}
"""By benchmark. Each returns the PNG files it made, and raises ImportError without matplotlib."""


def _figure(rows: int, **options: Any) -> tuple[Any, Any]:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(rows, 1, figsize=(9, 4.5 * rows), layout="constrained", squeeze=False, **options)
    return figure, axes[:, 0]


def _saved(figure: Any, path: Path) -> Path:
    from matplotlib import pyplot as plt

    figure.savefig(path, dpi=120)
    plt.close(figure)
    return path
