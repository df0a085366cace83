"""The collision models that were asked for last."""

from collections.abc import Callable
from typing import Generic, TypeVar

from planner.motion.checking import CollisionChecker
from planner.motion.world import Margins
from sim.robot import RobotModel
from sim.scene import SceneState

MOST = 12

Model = TypeVar("Model", bound=CollisionChecker)


class Recent(Generic[Model]):
    """Makes models of one kind and keeps the latest."""

    def __init__(self, make: Callable[[RobotModel, SceneState, Margins], Model]) -> None:
        self._make = make
        self._known: list[tuple[SceneState, Margins, Model]] = []

    def of(self, robot: RobotModel, scene: SceneState, margins: Margins) -> Model:
        """The model of this very scene with these margins."""
        for known, limits, checker in self._known:
            if known is scene and limits == margins:
                return checker
        checker = self._make(robot, scene, margins)
        self._known = [(scene, margins, checker), *self._known[: MOST - 1]]
        return checker
