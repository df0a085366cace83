"""`bench force`: slides on a table, by different laws and under disturbances, side by side."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from itertools import groupby, product
from typing import Any

import numpy as np
from rich.console import Console

from bt_tamp.bench.checks import Check, at_most
from bt_tamp.bench.scene import SPONGE, Truth, believed
from bt_tamp.bench.slide import Case, Law, SlideResult, run_slide
from sim.disturbance import Fault
from sim.robot import WSG50
from sim.robot_faults import JointFriction
from sim.sensor_faults import ForceBias, ForceDelay, ForceNoise

WHAT = "slides"
TARGETS = (5.0, 10.0, 20.0, 40.0)
LAWS: tuple[Law, ...] = ("hybrid", "open-loop PD hybrid", "impedance, paper's gains", "impedance, tuned")
KNOWN = "everything known"
TOGETHER = "all together"

SENSOR: tuple[Fault, ...] = (
    ForceNoise(0.3, 0.01),
    ForceBias((0.5, 0.5, 0.5), (0.02, 0.02, 0.02)),
    ForceDelay(0.004),
)
FRICTION = JointFriction((1.0,) * 7)
TILT = np.radians(2.0)

ALONE: dict[str, tuple[Truth, tuple[Fault, ...]]] = {
    "force noise 0.3 N": (Truth(), SENSOR[:1]),
    "force bias 0.5 N": (Truth(), SENSOR[1:2]),
    "sensor delay 4 ms": (Truth(), SENSOR[2:]),
    "table 5 mm higher": (Truth(table_height=0.005), ()),
    "table 5 mm lower": (Truth(table_height=-0.005), ()),
    "table tilted 2°": (Truth(tilt=TILT), ()),
    "friction +30 %": (Truth(friction=1.3), ()),
    "friction −30 %": (Truth(friction=0.7), ()),
    "sponge 5 times stiffer": (Truth(stiffness=5.0), ()),
    "sponge 5 times softer": (Truth(stiffness=0.2), ()),
    "masses +20 %": (Truth(masses=1.2), ()),
    "masses −20 %": (Truth(masses=0.8), ()),
    "joint friction 1 Nm": (Truth(), (FRICTION,)),
}

PRESSES = {
    "higher": (0.005, 5.0),
    "lower": (-0.005, 0.2),
}
"""Height and stiffness that go together: on a higher table a softer sponge would be pressed flat to the fingertips."""


def planned(quick: bool) -> list[Case]:
    """The slides to measure; a first look is at 10 N only."""
    return list(cases((10.0,) if quick else TARGETS, quick))


def cases(targets: Sequence[float], quick: bool) -> Iterator[Case]:
    """Every slide, laws first."""
    yield from (Case(KNOWN, law, target) for target in targets for law in LAWS)
    for name, (truth, faults) in ALONE.items():
        yield from (Case(name, "hybrid", target, truth, faults) for target in targets)
    together = list(_together())
    for name, truth in together[::3] if quick else together:
        faults = (*SENSOR, FRICTION)
        yield from (Case(name, "hybrid", target, truth, faults) for target in targets)


def _together() -> Iterator[tuple[str, Truth]]:
    """All disturbances at once, their signs in all combinations."""
    for (where, (height, stiffness)), friction, masses in product(PRESSES.items(), (1.3, 0.7), (1.2, 0.8)):
        signs = f"{where}, friction {friction:g}, stiffness {stiffness:g}, masses {masses:g}"
        yield f"{TOGETHER}: {signs}", Truth(height, TILT, friction, stiffness, masses)


def measure(slides: Sequence[Case]) -> Iterator[SlideResult]:
    """Run them one after the other."""
    for case in slides:
        yield run_slide(case)


def said(result: SlideResult) -> str:
    """A slide in a line."""
    return f"{result.case}, {result.law}, {result.target:g} N: {result.ended}"


def acceptance(results: Sequence[SlideResult]) -> list[Check]:
    """The figures to reach."""
    hybrid = [r for r in results if r.law == "hybrid"]
    known = [r for r in hybrid if r.case == KNOWN and r.target <= 20.0]
    together = [r for r in hybrid if r.case.startswith(TOGETHER)]
    judged = [r for r in together if r.target in (10.0, 20.0)]
    unfinished = [r for r in judged if r.ended != "done"]
    passed = [r for r in judged if r.violations > 0 or r.ended != "done"]
    return [
        at_most("everything known, 5–20 N: RMS", [100 * r.rms / r.target for r in known], 1.0, "%"),
        at_most("everything known, 5–20 N: overshoot", [100 * r.overshoot for r in known], 15.0, "%"),
        at_most("everything known, 5–20 N: path error", [1000 * r.path for r in known], 1.0, "mm"),
        at_most(
            "all together, 10 and 20 N: mean off by", [100 * abs(r.mean / r.target - 1.0) for r in judged], 5.0, "%"
        ),
        at_most("all together, 10 and 20 N: RMS", [100 * r.rms / r.target for r in judged], 10.0, "%"),
        at_most("all together, 10 and 20 N: without contact", [1000 * r.airborne for r in judged], 0.0, "ms"),
        at_most("all together, 10 and 20 N: path error", [1000 * r.path for r in judged], 5.0, "mm"),
        Check(
            "all together, 10 and 20 N: no limit passed",
            "none",
            "none" if not passed else f"{len(passed)} slides ({len(unfinished)} not finished)",
            bool(judged) and not passed,
        ),
        at_most(
            "QP, build and solve, median", [float(np.median([r.qp_us for r in hybrid]))] if hybrid else [], 120.0, "µs"
        ),
    ]


def records(results: Sequence[SlideResult]) -> list[dict[str, Any]]:
    """For JSON."""
    return [asdict(thinned(result)) for result in results]


def about_100_newtons() -> str:
    """Whether the paper's example can be had, by what friction bears."""
    friction = WSG50.pad_friction * believed().bodies[SPONGE].friction
    bears = 2.0 * friction * WSG50.max_force
    return (
        f"100 N, the paper's example, can't be had with this hand: two fingers at {WSG50.max_force:g} N and friction "
        f"{friction:g} bear {bears:.0f} N along the pads, with nothing left for friction on the table or an error of "
        f"it; with the reserve of these slides it is {bears / 2.0:.0f} N."
        if bears < 100.0
        else f"100 N, the paper's example, needs a grip of {100.0 / (2.0 * friction):.0f} N of {WSG50.max_force:g} N."
    )


COLUMNS = (
    ("target", "N", 6, lambda r: f"{r.target:.0f}"),
    ("mean", "%", 7, lambda r: f"{100 * (r.mean / r.target - 1):+.1f}"),
    ("RMS", "%", 6, lambda r: f"{100 * r.rms / r.target:.1f}"),
    ("peak", "N", 6, lambda r: f"{r.peak:.1f}"),
    ("overshoot", "%", 10, lambda r: f"{100 * r.overshoot:.0f}"),
    ("airborne", "ms", 9, lambda r: f"{1000 * r.airborne:.0f}"),
    ("path", "mm", 7, lambda r: f"{1000 * r.path:.2f}"),
    ("slip", "mm", 7, lambda r: f"{1000 * r.slip:.2f}"),
    ("QP", "µs", 5, lambda r: f"{r.qp_us:.0f}"),
    ("fallbacks", "", 10, lambda r: str(r.fallbacks)),
)
"""Heading, unit, width and text of each figure in the table."""


def print_results(console: Console, results: Sequence[SlideResult]) -> None:
    """The table, narrow enough for any terminal: a line for each target below what was slid with."""
    lines = ["".join(f"{name:>{width}}" for name, _, width, _ in COLUMNS)]
    lines.append("".join(f"{unit:>{width}}" for _, unit, width, _ in COLUMNS))
    for (case, law), slides in groupby(sorted(results, key=_group(results)), key=lambda r: (r.case, r.law)):
        lines.append(f"{case}, {law}")
        for r in slides:
            ended = "" if r.ended == "done" else f"  {r.ended}"
            lines.append("".join(f"{text(r):>{width}}" for _, _, width, text in COLUMNS) + ended)
    lines.append("mean (off by), RMS: true normal force from 0.5 s after touchdown to the command to lift")
    lines.append("overshoot: of the target, within those 0.5 s; airborne: time without contact since touchdown")
    console.print("\n".join(lines), highlight=False, markup=False, soft_wrap=True)
    console.print(about_100_newtons(), highlight=False)


def _group(results: Sequence[SlideResult]) -> Callable[[SlideResult], int]:
    """A key that keeps slides of one case and law together, in the order in which these came first."""
    order = list(dict.fromkeys((r.case, r.law) for r in results))
    return lambda r: order.index((r.case, r.law))


def thinned(result: SlideResult, every: int = 5) -> SlideResult:
    """The same result with fewer samples of its force."""
    return replace(result, times=result.times[::every], forces=result.forces[::every])
