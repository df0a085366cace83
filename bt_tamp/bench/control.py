"""`bench control`: what one control tick costs, part by part, beside the bare physics that it drives."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean
from tempfile import TemporaryDirectory
from typing import Any

from rich.console import Console
from rich.table import Table

from bt_tamp.bench.checks import Check, at_least, at_most
from bt_tamp.bench.stopwatch import Stopwatch
from bt_tamp.executive.build import CONTROL_EVERY, TREE_EVERY, Machine, build
from bt_tamp.executive.loop import Audits, Tally, act, look
from bt_tamp.options import RunOptions
from bt_tamp.report.folder import RunFolder
from bt_tamp.report.recorder import RunRecorder
from scenarios.load import load_scenario

WHAT = "runs"
SEEDS = (0, 1, 2)
SCENE = "fig1_wipe"
WIPING = frozenset({"touch", "slide"})
FREE = frozenset({"move", "approach"})

CONTROL_PARTS = ("model", "state", "law", "QP build", "solve", "command")
PARTS = ("observe", *CONTROL_PARTS, "apply", "record", "tree", "drive", "physics")
"""record: signals taken down and true contacts judged. drive: torques and the fingers' gear given to the engine.
physics: the engine's bare step."""

THINKING = 0.005
"""CPU seconds beyond which a tick of the tree has planned or refined an action: left out, as that isn't control."""

LAPPED = 100
"""Control ticks with the watch at each part, then as many without it: looking at it costs as much as a part does."""

LONGEST = 120.0
ENOUGH = 3.0
"""Simulated seconds: in all, and of each regime."""


@dataclass(frozen=True)
class Cost:
    """One regime, "free" or "wiping". Per control tick, in microseconds of CPU time: the mean of each part, and the
    median of building and solving the QP. real_time: simulated seconds by seconds of CPU, everything included but
    planning, in the ticks whose parts are not timed. nodes: how many the tree had, on average."""

    regime: str
    seconds: float
    parts: dict[str, float]
    qp_median: float
    real_time: float
    nodes: float

    @property
    def control(self) -> float:
        """Control and tree, µs a tick."""
        return sum(self.parts[part] for part in (*CONTROL_PARTS, "tree"))

    @property
    def tree_tick(self) -> float:
        """Belief, tree and monitoring, µs a tick of the tree."""
        return TREE_EVERY * self.parts["tree"]

    @property
    def physics(self) -> float:
        """The bare physics that a tick drives, µs."""
        return self.parts["physics"]


Run = Sequence[Cost]


def planned(quick: bool) -> Sequence[int]:
    """Seeds of the runs."""
    return SEEDS[:1] if quick else SEEDS


def measure(seeds: Sequence[int]) -> Iterator[Run]:
    """Run them one after the other."""
    for seed in seeds:
        yield run(seed)


def said(costs: Run) -> str:
    """A run in a line."""
    return f"{SCENE}, real-time factor " + ", ".join(f"{cost.regime} {cost.real_time:.2f}" for cost in costs)


def records(runs: Sequence[Run]) -> list[dict[str, Any]]:
    """For JSON: what is printed."""
    return [asdict(cost) for cost in middle(runs)]


def run(seed: int) -> Run:
    """Clear SCENE's table, recorded like any run, until enough was seen of moving freely and of wiping.

    Raises ValueError if no stroke comes within LONGEST simulated seconds.
    """
    scenario = load_scenario(SCENE, seed)
    machine = build(scenario, RunOptions(seed=seed), _ignore, _ignore)
    audits, tally = Audits.of(machine), Tally()
    watches = {regime: Stopwatch(longest=THINKING) for regime in ("free", "wiping", "")}
    lapped = dict.fromkeys(watches, 0)
    spent = {regime: [0.0, 0.0] for regime in watches}
    nodes: dict[str, list[int]] = {regime: [] for regime in watches}
    n = 0
    with TemporaryDirectory() as folder, RunRecorder(scenario, RunFolder(Path(folder))) as recorder:
        while tally.t < LONGEST and min(spent[r][0] for r in ("free", "wiping")) < ENOUGH:
            regime, is_lapped = _regime(machine), n // LAPPED % 2 == 0
            watch = watches[regime]
            if n % LAPPED == 0:
                nodes[regime].append(sum(1 for _ in machine.mission.root.iterate()))
            machine.plant.lap = machine.context.controller.lap = watch.lap if is_lapped else _ignore
            before = time.thread_time()
            watch.start()
            look(machine, tally, n)
            looked = time.thread_time()
            act(machine, recorder, audits, tally, n)
            if is_lapped:
                lapped[regime] += 1
            else:
                spent[regime][0] += CONTROL_EVERY * machine.plant.timestep
                spent[regime][1] += time.thread_time() - (looked if looked - before > THINKING else before)
            n += 1
    machine.plant.close()
    if not spent["wiping"][0]:
        raise ValueError(f"{SCENE}, seed {seed}: no stroke within {LONGEST:g} simulated seconds")
    return [
        _cost(regime, watches[regime], lapped[regime], (spent[regime][0], spent[regime][1]), fmean(nodes[regime]))
        for regime in ("free", "wiping")
    ]


def _regime(machine: Machine) -> str:
    phase = machine.context.phase
    reference = machine.context.controller.reference
    if phase is None or reference is None:
        return ""
    return "wiping" if phase.kind in WIPING else "free" if phase.kind in FREE else ""


def _cost(regime: str, watch: Stopwatch, ticks: int, spent: tuple[float, float], nodes: float) -> Cost:
    parts = {part: 1e6 * watch.total(part) / ticks for part in PARTS}
    qp = watch.median("QP build") + watch.median("solve")
    simulated, real = spent
    return Cost(regime, simulated, parts, qp, simulated / real, nodes)


def middle(runs: Sequence[Run]) -> list[Cost]:
    """Of several runs, for each regime, the one in the middle by its real-time factor: other load comes and goes."""
    regimes = zip(*runs, strict=True)
    return [sorted(costs, key=lambda cost: cost.real_time)[len(costs) // 2] for costs in regimes]


def acceptance(runs: Sequence[Run]) -> list[Check]:
    """The figures to reach."""
    wiping = [cost for cost in middle(runs) if cost.regime == "wiping"]
    shares = [cost.control / cost.physics for cost in wiping]
    return [
        at_most("wiping: control and tree, as a share of the bare physics", shares, 1.0, "times"),
        at_least("wiping: real-time factor", [cost.real_time for cost in wiping], 3.0, "times"),
        at_most("wiping: QP, build and solve, median", [cost.qp_median for cost in wiping], 120.0, "µs"),
        at_most("tree and monitoring, a tick at 100 nodes", [_at_100_nodes(cost) for cost in middle(runs)], 1e3, "µs"),
    ]


def _at_100_nodes(cost: Cost) -> float:
    """µs that a tick of the tree would cost with 100 nodes, in proportion."""
    return cost.tree_tick * 100.0 / cost.nodes


def print_results(console: Console, runs: Sequence[Run]) -> None:
    """The table: one line a part."""
    costs = middle(runs)
    table = Table(
        caption=f"µs of CPU time a control tick (2 ms simulated: {CONTROL_EVERY} physics steps), mean over {SCENE}",
        caption_justify="left",
    )
    table.add_column("part")
    for cost in costs:
        table.add_column(f"{cost.regime}\n({cost.seconds:.0f} s)", justify="right")
    for part in PARTS:
        table.add_row(part, *(f"{cost.parts[part]:.0f}" for cost in costs))
    table.add_section()
    table.add_row("control and tree", *(f"{cost.control:.0f}" for cost in costs))
    table.add_row("bare physics", *(f"{cost.physics:.0f}" for cost in costs))
    table.add_row("a tick of the tree", *(f"{cost.tree_tick:.0f}" for cost in costs))
    table.add_row("its nodes", *(f"{cost.nodes:.0f}" for cost in costs))
    table.add_row("QP, median", *(f"{cost.qp_median:.0f}" for cost in costs))
    table.add_row("real-time factor", *(f"{cost.real_time:.2f}" for cost in costs))
    console.print(table)


def _ignore(*_: object, **__: object) -> None:
    """Drop an event."""
