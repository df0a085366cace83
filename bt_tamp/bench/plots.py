"""Pictures of what a benchmark measured. Matplotlib is an extra: without it there are none."""

from collections.abc import Sequence
from pathlib import Path

from bt_tamp.bench.slide import SlideResult


def plot_forces(folder: Path, results: Sequence[SlideResult]) -> list[Path]:
    """One PNG a target: the laws beside each other, and hybrid control under every disturbance. Returns the files.

    Raises ImportError without matplotlib.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    made = []
    for target in sorted({r.target for r in results}):
        figure, (above, below) = plt.subplots(2, 1, figsize=(9, 9), sharex=True, layout="constrained")
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
        path = folder / f"force-{target:g}N.png"
        figure.savefig(path, dpi=120)
        plt.close(figure)
        made.append(path)
    return made
