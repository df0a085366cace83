"""Whether things can stand where they are said to stand: nothing overlaps, floats or hangs over an edge."""

from collections.abc import Iterable, Sequence

import numpy as np
from pinocchio import SE3

from scenarios.shapes import Box
from scenarios.solids import TOUCH, Solid, overlap, overlapping

REST_GAP = 0.002
"""Largest gap in metres between a thing at rest and what it rests on."""

_PLUMB_SIDE = 1e-4
_PLUMB_LENGTH = 20.0


def standing_problem(solid: Solid, others: Sequence[Solid]) -> str | None:
    """Why a thing can't stand among the others, or None."""
    return overlap_problem(solid, others) or support_problem(solid, others)


def overlap_problem(solid: Solid, others: Iterable[Solid]) -> str | None:
    """Which of the others a thing overlaps, as a phrase, or None."""
    hit = overlapping(solid, others)
    return None if hit is None else f"overlaps {hit!r}, expected a free place"


def support_problem(solid: Solid, others: Iterable[Solid]) -> str | None:
    """Why a thing would fall, as a phrase, or None.

    Something must lie at most REST_GAP beneath it, and if that is one thing only, the centre must
    lie above it. Whether a tilted body would topple is not asked.
    """
    supports = _supports(solid, others)
    if not supports:
        return f"floats, expected a surface at most {REST_GAP * 1000:g} mm beneath it"
    if len(supports) == 1 and not _is_above(solid, supports[0]):
        return f"has its centre beyond the edge of {supports[0].name!r}, expected it above what it stands on"
    return None


def _supports(solid: Solid, others: Iterable[Solid]) -> list[Solid]:
    lowered = solid.moved(SE3(np.eye(3), np.array([0.0, 0.0, -REST_GAP - TOUCH])))
    return [other for other in others if overlap(lowered, other)]


def _is_above(solid: Solid, support: Solid) -> bool:
    centre = solid.centre
    down = np.array([centre[0], centre[1], centre[2] - _PLUMB_LENGTH / 2])
    plumb = Solid("plumb", ((Box((_PLUMB_SIDE, _PLUMB_SIDE, _PLUMB_LENGTH)), SE3(np.eye(3), down)),))
    return overlap(plumb, support, 0.0)
