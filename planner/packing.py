"""Room among what stands about already: placements in which nothing overlaps come first."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from planner.placements import Placement
from scenarios.scenario import Body
from scenarios.shapes import bounding_radius
from scenarios.solids import Solid, body_solid, overlap
from sim.scene import SceneState

DEPTH = 0.002
"""Metres that two bodies may overlap by what is believed: where things have come to rest is known roughly."""


def standing_about(scene: SceneState) -> list[Solid]:
    """All fixtures and bodies but the held one."""
    bodies = scene.scenario.bodies
    held = scene.held.name if scene.held is not None else None
    fixtures = [body_solid(fixture) for fixture in scene.scenario.fixtures.values()]
    return fixtures + [body_solid(bodies[name], X_WO) for name, X_WO in scene.poses.items() if name != held]


def clear_first(
    samples: Iterable[Placement], body: Body, others: Sequence[Solid], is_clear: Callable[[Placement], bool]
) -> Iterator[Placement]:
    """The placements after which the body overlaps none of the others and that `is_clear` finds nothing against, as
    they come; then the rest, so that failing with them tells who is in the way."""
    blocked = []
    centres = np.array([other.ball[0] for other in others]).reshape(-1, 3)
    reach = np.array([other.ball[1] for other in others]) + bounding_radius(body.shape)
    for sample in samples:
        X_WO = sample.X_WO_rest
        offset = centres - X_WO.translation
        near = np.flatnonzero((offset * offset).sum(axis=1) < reach * reach)
        at_rest = body_solid(body, X_WO) if len(near) else None
        overlaps = at_rest is not None and any(overlap(at_rest, others[int(k)], DEPTH) for k in near)
        if overlaps or not is_clear(sample):
            blocked.append(sample)
        else:
            yield sample
    yield from blocked
