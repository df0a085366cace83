"""Figures to reach, and whether they were."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table


@dataclass(frozen=True)
class Check:
    """One figure: what it is about, what was wanted and what was measured, as text, and whether that suffices."""

    figure: str
    wanted: str
    measured: str
    reached: bool


def at_most(figure: str, values: Sequence[float], limit: float, unit: str) -> Check:
    """The largest of `values` must not be beyond `limit`. No value, or one that is NaN, reaches nothing."""
    if not values or any(value != value for value in values):
        return Check(figure, f"≤ {limit:g} {unit}", "–", False)
    return Check(figure, f"≤ {limit:g} {unit}", f"{max(values):.3g} {unit}", max(values) <= limit)


def at_least(figure: str, values: Sequence[float], limit: float, unit: str) -> Check:
    """The smallest of `values` must not be below `limit`. No value, or one that is NaN, reaches nothing."""
    if not values or any(value != value for value in values):
        return Check(figure, f"≥ {limit:g} {unit}", "–", False)
    return Check(figure, f"≥ {limit:g} {unit}", f"{min(values):.3g} {unit}", min(values) >= limit)


def print_checks(console: Console, checks: Sequence[Check]) -> None:
    """The acceptance section."""
    table = Table(title="figures to reach (the worst of the cases concerned)", title_justify="left")
    for heading in ("figure", "wanted", "measured", ""):
        table.add_column(heading)
    for check in checks:
        table.add_row(check.figure, check.wanted, check.measured, "reached" if check.reached else "NOT reached")
    console.print(table)


def write_json(path: Path, checks: Sequence[Check], **parts: Any) -> None:
    """Everything measured, as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {**parts, "acceptance": [asdict(check) for check in checks]}
    path.write_text(json.dumps(content, indent=1))
