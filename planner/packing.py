"""Room among what stands about already: placements in which nothing overlaps come first."""

from collections.abc import Iterable, Iterator, Sequence

from planner.placements import Placement
from scenarios.scenario import Body
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


def clear_first(samples: Iterable[Placement], body: Body, others: Sequence[Solid]) -> Iterator[Placement]:
    """The placements after which the body overlaps none of the others, as they come; then the rest, so that failing
    with them tells who is in the way."""
    blocked = []
    for sample in samples:
        at_rest = body_solid(body, sample.X_WO_rest)
        if any(overlap(at_rest, other, DEPTH) for other in others):
            blocked.append(sample)
        else:
            yield sample
    yield from blocked
