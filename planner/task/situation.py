"""Where bodies are, as far as learning tells poses apart: as observed, or left there by an action of the plan."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from pinocchio import SE3

from planner.task.symbols import Fact, GroundAction
from sim.scene import SceneState, pose_distance

DISPLACED = 0.01
TURNED = float(np.radians(5.0))
"""A body farther (m) or more turned (rad) than this from where it was is no longer there."""


@dataclass(frozen=True)
class Spot:
    """Where a body is: as observed (`left_by` None), or where that action of the plan leaves it."""

    body: str
    left_by: GroundAction | None = None

    def __str__(self) -> str:
        return self.body if self.left_by is None else f"{self.body} (where {self.left_by} leaves it)"


def in_order(spots: frozenset[Spot]) -> list[Spot]:
    """The spots in an order that is the same in every run."""
    return sorted(spots, key=str)


@dataclass(frozen=True)
class Whereabouts:
    """A body's pose: X_GO in the hand, X_WO elsewhere."""

    X: SE3
    is_held: bool


def whereabouts(scene: SceneState, name: str) -> Whereabouts | None:
    """Where a body is; None if it isn't in the scene."""
    if scene.held is not None and scene.held.name == name:
        return Whereabouts(scene.held.X_GO, True)
    return Whereabouts(scene.poses[name], False) if name in scene.poses else None


def is_displaced(before: Whereabouts | None, now: Whereabouts | None, distance: float = DISPLACED) -> bool:
    """Is it elsewhere now: farther than `distance` metres, turned, taken up, put down, gone?"""
    if before is None or now is None:
        return before is not now
    if before.is_held != now.is_held:
        return True
    moved, turned = pose_distance(before.X, now.X)
    return moved > distance or turned > TURNED * distance / DISPLACED


@dataclass(frozen=True)
class Situation:
    """A scene, observed or predicted in the course of a plan.

    `observed` is the scene from which the plan starts; `facts` is what the task planner holds true
    here; `movers` gives, for each body moved since, the action that moved it last.
    """

    observed: SceneState
    scene: SceneState
    facts: frozenset[Fact] = frozenset()
    movers: Mapping[str, GroundAction] = field(default_factory=dict)

    @staticmethod
    def now(scene: SceneState, facts: frozenset[Fact] = frozenset()) -> "Situation":
        """The scene as observed."""
        return Situation(scene, scene, facts)

    def spot(self, body: str) -> Spot:
        """Where a body is."""
        return Spot(body, self.movers.get(body))

    def is_away(self, spot: Spot) -> bool:
        """Is the body elsewhere?"""
        return self.spot(spot.body) != spot

    @property
    def held(self) -> Spot | None:
        """The spot of what the hand holds."""
        return self.spot(self.scene.held.name) if self.scene.held else None

    def after(self, action: GroundAction, scene: SceneState, facts: frozenset[Fact]) -> "Situation":
        """The situation that an action leads to: it moves its first argument, and whatever else lies elsewhere then."""
        moved = {
            name: action
            for name in self.scene.poses
            if name == action.args[0]
            or is_displaced(whereabouts(self.scene, name), whereabouts(scene, name), distance=1e-4)
        }
        return Situation(self.observed, scene, facts, {**self.movers, **moved})
