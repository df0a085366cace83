"""What a body stands on, besides a surface: other bodies, and fixed things; and what stands on it."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from pinocchio import SE3

from planner.motion.world import Standing
from scenarios.solids import Solid, body_solid, overlap
from sim.scene import SceneState

GAP = 0.005
"""Metres by which a body is lowered to see what it comes to rest on."""


def supports(scene: SceneState, name: str) -> frozenset[str]:
    """Bodies and fixtures beneath a body that it touches, or would if it were lowered a little; none for a held one."""
    if name not in scene.poses or (scene.held is not None and scene.held.name == name):
        return frozenset()
    return _supports(Standing(scene), name)


def burden(scene: SceneState, name: str) -> frozenset[str]:
    """Bodies that stand on a body, or on what stands on it."""
    return _burden(Standing(scene), name)


def borne(scene: SceneState) -> frozenset[str]:
    """Bodies that stand on what the hand holds, or on what stands on it: they come along with it."""
    return frozenset() if scene.held is None else burden(replace(scene, held=None), scene.held.name)


@lru_cache(maxsize=512)
def _burden(standing: Standing, name: str) -> frozenset[str]:
    others = [other for other, _ in standing.poses]
    found = frozenset({name})
    for _ in others:
        more = found | {other for other in others if _supports(standing, other) & found}
        if more == found:
            break
        found = more
    return found - {name}


@lru_cache(maxsize=512)
def _supports(standing: Standing, name: str) -> frozenset[str]:
    scenario = standing.scenario
    poses = dict(standing.poses)
    body = body_solid(scenario.bodies[name], poses[name])
    lowered = body.moved(SE3(np.eye(3), np.array([0.0, 0.0, -GAP])))
    others = [body_solid(scenario.bodies[other], X_WO) for other, X_WO in poses.items() if other != name]
    others += [body_solid(fixture) for fixture in scenario.fixtures.values()]
    return frozenset(other.name for other in others if overlap(lowered, other) and _is_below(other, body))


def _is_below(lower: Solid, upper: Solid) -> bool:
    """Does the one lie beneath the other, rather than beside it? Then lowering it, or raising the other a little, parts
    them."""
    parted = lower.moved(SE3(np.eye(3), np.array([0.0, 0.0, -4 * GAP])))
    raised = upper.moved(SE3(np.eye(3), np.array([0.0, 0.0, GAP])))
    return not overlap(parted, upper) and not overlap(lower, raised)
