"""`bench wipe`: random crumbs, the dustpan on each side of the table in turn, wiped into it by whole runs."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from rich.console import Console
from rich.table import Table

from bt_tamp.bench.checks import Check, at_least
from bt_tamp.bench.crumbs import COUNT, GRAIN_COUNT, GRAINS, PAN, SPONGE, Layout, cubes, grains
from bt_tamp.bench.whole import whole_run
from bt_tamp.options import RunOptions
from bt_tamp.report.events import Event
from bt_tamp.report.recorder import RunRecorder

WHAT = "layouts"
QUICK, GRAIN_QUICK = 4, 1
"""Layouts of a first look."""

MAX_SIM_TIME = 400.0
CUBES_WANTED, GRAINS_WANTED = 98.0, 95.0
"""Percent of all crumbs that are to lie in the dustpan."""

REAL_TIME_WANTED = 3.0


def planned(quick: bool) -> list[Layout]:
    """The layouts of cubes, then those of grains."""
    return [*cubes(QUICK if quick else COUNT), *grains(GRAIN_QUICK if quick else GRAIN_COUNT)]


def measure(layouts: Sequence[Layout]) -> Iterator["WipeResult"]:
    """Run them one after the other."""
    for layout in layouts:
        yield run_layout(layout)


@dataclass(frozen=True)
class WipeResult:
    """What became of one layout: how many crumbs there were, which don't lie in the dustpan, how many strokes it took.

    pressed_s: simulated seconds from touchdown's beginning to the end of the strokes, pressed_cpu_s the CPU seconds
    that took. peak_n: largest measured contact force. reason: why not all are in the dustpan, empty if they are.
    """

    layout: Layout
    crumbs: int
    missed: tuple[str, ...]
    strokes: int
    robot_s: float
    wall_s: float
    pressed_s: float
    pressed_cpu_s: float
    replans: int
    peak_n: float
    failures: tuple[str, ...]
    reason: str

    @property
    def inside(self) -> int:
        """How many crumbs lie in the dustpan."""
        return self.crumbs - len(self.missed)

    @property
    def are_grains(self) -> bool:
        return self.crumbs == GRAINS

    @property
    def factor(self) -> float:
        """Simulated seconds by seconds of CPU while wiping; 0 without a stroke."""
        return self.pressed_s / self.pressed_cpu_s if self.pressed_cpu_s else 0.0


@dataclass
class _Witness:
    """Listens to a run's events and takes the time of its strokes."""

    strokes: int = 0
    pressed_s: float = 0.0
    pressed_cpu_s: float = 0.0
    failures: list[str] = field(default_factory=list)
    _since: tuple[float, float] | None = None

    def event(self, event: Event) -> None:
        data: Mapping = event.data
        if self._since is not None and event.kind in ("phase", "action_failed", "run_ended") and not _presses(data):
            self.pressed_s += event.t - self._since[0]
            self.pressed_cpu_s += time.process_time() - self._since[1]
            self._since = None
        if event.kind == "phase" and data["phase"] == "descend" and data["action"].startswith("wipe"):
            self._since = event.t, time.process_time()
            self.strokes += 1
        if event.kind == "action_failed":
            self.failures.append(f"{data['failure']} of {data['action']}: {data['reason']}")

    def progress(self, t: float, force: float) -> None:
        """Nothing to show."""

    def close(self) -> None:
        """Nothing to close."""


def _presses(data: Mapping) -> bool:
    return data.get("phase") in ("descend", "stroke")


def run_layout(layout: Layout, seed: int = 0) -> WipeResult:
    """One whole run: nothing is told to the executive but the scene and the goal."""
    witness = _Witness()
    recorder = RunRecorder(layout.scenario(), None, witness)
    result = whole_run(recorder, RunOptions(seed=seed, max_sim_time=MAX_SIM_TIME))
    missed = tuple(name for name, place in result.places.items() if place != PAN and name != SPONGE)
    return WipeResult(
        layout,
        len(layout.edges),
        missed,
        witness.strokes,
        result.robot_s,
        result.wall_s,
        witness.pressed_s,
        witness.pressed_cpu_s,
        result.replans,
        result.peak_contact_force_n,
        tuple(witness.failures),
        result.reason if missed else "",
    )


def said(result: WipeResult) -> str:
    """A layout in a line."""
    return f"dustpan at {result.layout.side}: {result.inside} of {result.crumbs}"


def records(results: Sequence[WipeResult]) -> list[dict[str, Any]]:
    """For JSON."""
    return [asdict(result) for result in results]


def print_results(console: Console, results: Sequence[WipeResult]) -> None:
    """One row a layout."""
    table = Table(title="crumbs wiped into the dustpan", title_justify="left")
    for heading in (
        "dustpan at",
        "crumbs",
        "inside",
        "strokes",
        "robot s",
        "replans",
        "peak N",
        "real-time factor",
        "why",
    ):
        table.add_column(heading, justify="left" if heading in ("dustpan at", "why") else "right")
    for r in results:
        figures = (r.crumbs, r.inside, r.strokes, f"{r.robot_s:.0f}", r.replans, f"{r.peak_n:.0f}", f"{r.factor:.2f}")
        table.add_row(r.layout.side, *map(str, figures), r.reason)
    console.print(table)


def acceptance(results: Sequence[WipeResult]) -> list[Check]:
    """The share of crumbs in the dustpan, and the real-time factor while wiping cubes."""
    kinds = {"cubes": [r for r in results if not r.are_grains], "grains": [r for r in results if r.are_grains]}
    wanted = {"cubes": CUBES_WANTED, "grains": GRAINS_WANTED}
    checks = [
        at_least(f"{kind} in the dustpan", [_share(kinds[kind])], wanted[kind], "%") for kind in kinds if kinds[kind]
    ]
    factors = [_factor(kinds[kind]) for kind in kinds if kind == "cubes" and kinds[kind]]
    return [*checks, at_least("real-time factor, wiping cubes, on average", factors, REAL_TIME_WANTED, "")]


def _share(results: Sequence[WipeResult]) -> float:
    return 100.0 * sum(r.inside for r in results) / sum(r.crumbs for r in results)


def _factor(results: Sequence[WipeResult]) -> float:
    wall = sum(r.pressed_cpu_s for r in results)
    return sum(r.pressed_s for r in results) / wall if wall else float("nan")
