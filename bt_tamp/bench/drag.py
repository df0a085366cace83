"""`bench drag`: random flat boxes, each to be dragged to an edge of its table and picked there, by whole runs."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from rich.console import Console

from bt_tamp.bench.boxes import BOX, COUNT, TOP, Layout, layouts
from bt_tamp.bench.checks import Check
from bt_tamp.bench.whole import whole_run
from bt_tamp.options import RunOptions
from bt_tamp.report.events import Event
from bt_tamp.report.recorder import RunRecorder
from bt_tamp.report.signals import Reference
from scenarios.scenario import Table
from scenarios.shapes import Box
from sim.plant import Observation
from sim.scene import depth_below

WHAT = "boxes"
QUICK = 6
"""Boxes of a first look."""

WANTED = 0.96
"""Share of the boxes that are to be held in the air."""

MAX_SIM_TIME = 150.0
HELD_ABOVE = 0.03
"""Metres above the table's top at which a box truly hangs in the air."""


@dataclass(frozen=True)
class DragResult:
    """What became of one box. height: metres of its lowest point above the table's top in the end. edge: the table's
    edge to which it was dragged last. force: the greatest asked for, in N. peak_n: the greatest measured. failures: of
    actions while they were carried out. reason: why it isn't held, empty if it is."""

    layout: Layout
    is_held: bool
    height: float
    edge: str
    drags: int
    force: float
    peak_n: float
    robot_s: float
    wall_s: float
    replans: int
    failures: tuple[str, ...]
    reason: str


@dataclass
class _Witness:
    """Listens to a run's events."""

    drags: int = 0
    failures: list[str] = field(default_factory=list)

    def event(self, event: Event) -> None:
        data: Mapping = event.data
        if event.kind == "action_started" and data["action"].startswith("drag"):
            self.drags += 1
        if event.kind == "action_failed":
            self.failures.append(f"{data['failure']} of {data['action']}: {data['reason']}")

    def progress(self, t: float, force: float) -> None:
        """Nothing to show."""

    def close(self) -> None:
        """Nothing to close."""


class _Recorder(RunRecorder):
    """Keeps what was observed last, where the box was pressed on last, and the greatest force asked for."""

    def __init__(self, layout: Layout, witness: _Witness) -> None:
        super().__init__(layout.scenario(), None, witness)
        self.last: Observation | None = None
        self.dragged_to: np.ndarray | None = None
        self.force = 0.0

    def sample(self, observation: Observation, reference: Reference, force: float) -> None:
        super().sample(observation, reference, force)
        self.last = observation
        if reference.force:
            self.force = max(self.force, reference.force)
            self.dragged_to = observation.poses[BOX].translation.copy()


def planned(quick: bool) -> list[Layout]:
    """The layouts."""
    return list(layouts(QUICK if quick else COUNT))


def measure(boxes: Sequence[Layout]) -> Iterator[DragResult]:
    """Run them one after the other."""
    for layout in boxes:
        yield run_layout(layout)


def run_layout(layout: Layout, seed: int = 0) -> DragResult:
    """One whole run: nothing is told to the executive but the scene and the goal, the box in the hand."""
    witness = _Witness()
    recorder = _Recorder(layout, witness)
    result = whole_run(recorder, RunOptions(seed=seed, max_sim_time=MAX_SIM_TIME))
    height = _height(layout, recorder.last)
    is_held = result.places[BOX] == "hand" and height > HELD_ABOVE
    return DragResult(
        layout,
        is_held,
        height,
        _edge(recorder.scenario.table, recorder.dragged_to),
        witness.drags,
        recorder.force,
        result.peak_contact_force_n,
        result.robot_s,
        result.wall_s,
        result.replans,
        tuple(witness.failures),
        "" if is_held else result.reason,
    )


def _height(layout: Layout, observation: Observation | None) -> float:
    if observation is None:
        return 0.0
    X_WO = observation.poses[BOX]
    return float(X_WO.translation[2]) - depth_below(Box(layout.size), X_WO.rotation) - TOP


def _edge(table: Table, p_WO: np.ndarray | None) -> str:
    """The edge of the table nearest to where the box was last dragged."""
    if p_WO is None:
        return "none"
    p_T = table.X_WT.actInv(p_WO)
    gaps = {
        f"{sign}{axis}": table.size[i] / 2 - side * float(p_T[i])
        for i, axis in enumerate("xy")
        for sign, side in (("+", 1.0), ("-", -1.0))
    }
    return min(gaps, key=lambda name: gaps[name])


def said(result: DragResult) -> str:
    """A box in a line."""
    return f"to {result.edge}: {'held' if result.is_held else result.reason}"


def records(results: Sequence[DragResult]) -> list[dict[str, Any]]:
    """For JSON."""
    return [asdict(result) for result in results]


COLUMNS = (
    ("table at", 8, lambda r: f"{r.layout.azimuth}°"),
    ("size cm", 16, lambda r: "×".join(f"{100 * s:.1f}" for s in r.layout.size)),
    ("kg", 6, lambda r: f"{r.layout.mass:.2f}"),
    ("friction", 9, lambda r: f"{r.layout.friction:.2f}"),
    ("yaw", 7, lambda r: f"{np.degrees(r.layout.yaw):.0f}°"),
    ("edge", 5, lambda r: r.edge),
    ("drags", 6, lambda r: str(r.drags)),
    ("N", 4, lambda r: f"{r.force:.0f}"),
    ("peak N", 7, lambda r: f"{r.peak_n:.0f}"),
    ("held", 5, lambda r: "yes" if r.is_held else "NO"),
)
"""Heading, width and text of each column."""


def print_results(console: Console, results: Sequence[DragResult]) -> None:
    """One row a box, then why some aren't held and what went wrong on the way."""
    lines = ["    " + "".join(f"{name:>{width}}" for name, width, _ in COLUMNS)]
    for number, result in enumerate(results, 1):
        lines.append(f"{number:>3} " + "".join(f"{text(result):>{width}}" for _, width, text in COLUMNS))
    edges = Counter(result.edge for result in results)
    lines.append("edges: " + ", ".join(f"{edge} {count}" for edge, count in sorted(edges.items())))
    for title, said in (
        ("not held", [f"{number}: {r.reason}" for number, r in enumerate(results, 1) if not r.is_held]),
        ("failed on the way", [f"{number}: {text}" for number, r in enumerate(results, 1) for text in r.failures]),
    ):
        lines += [title, *said] if said else []
    console.print("\n".join(lines), highlight=False, markup=False, soft_wrap=True)


def acceptance(results: Sequence[DragResult]) -> list[Check]:
    """The share of boxes that hang in the air in the end."""
    held, total = sum(r.is_held for r in results), len(results)
    wanted = int(np.ceil(WANTED * total))
    return [Check("boxes dragged and then picked", f"≥ {wanted} of {total}", f"{held} of {total}", held >= wanted)]
