"""Why the runs of a sweep failed, those that failed alike together."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from bt_tamp.sweep_results import Run, naming

OPEN_LOOP = "open loop: "
BODY = "a body"


class Kind(NamedTuple):
    """Runs that failed alike, watching (replan) or open loop; why: their reason without arguments, figures and names
    of bodies."""

    replan: bool
    why: str
    runs: list[Run]


def kinds_of_failure(runs: Sequence[Run]) -> list[Kind]:
    """The runs that were met and failed, by why: those that watched first, then the most frequent."""
    found: dict[tuple[bool, str], Kind] = {}
    for run in (run for run in runs if run.is_met and not run.succeeded):
        key = run.replan, _gist(run)
        found.setdefault(key, Kind(*key, [])).runs.append(run)
    return sorted(found.values(), key=lambda kind: (not kind.replan, -len(kind.runs), kind.why))


def _gist(run: Run) -> str:
    why = re.sub(r"\([^()]*\)", "", run.reason.removeprefix(OPEN_LOOP))
    if run.result is not None and run.result.places:
        why = naming(run.result.places).sub(BODY, why)
    why = re.sub(r"-?\b\d+(\.\d+)?", "…", why)
    # Which side of a limit it was on when the arm stopped is a matter of one reading.
    why = re.sub(r"\b(near|beyond) the safety limit", "at the safety limit", why)
    outcome = run.outcome.replace("_", " ")
    return f"{outcome}: {why}" if why else outcome
