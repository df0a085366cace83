"""The `pybullet-planning` package in a scene of ours, to be compared with. It is an extra: imported when it is used.

Its planner (`birrt` with its defaults) asks PyBullet about one pair of links after the other.
"""

import random
from collections.abc import Iterable, Iterator
from importlib import import_module
from typing import Any

import numpy as np
import pinocchio as pin
import pybullet as p
from pinocchio import SE3

from sim.bullet import BulletPlant
from sim.robot import RobotModel
from sim.scene import SceneState

Watched = tuple[str, str, float]
"""Names of two things (links of the robot, what it holds, what stands in the scene) and the metres they keep apart."""


class PybulletPlanning(BulletPlant):
    """Plans in one scene, with the hand's opening and what it holds; `watched` are the pairs that are looked at.

    Raises ImportError without the package, and RuntimeError if another engine runs in the process: the package talks
    to the first one.
    """

    def __init__(self, scene: SceneState, robot: RobotModel, watched: Iterable[Watched], resolution: float) -> None:
        package = import_module("pybullet_planning")
        super().__init__(scene.scenario, robot)
        if self._client != 0:
            self.close()
            raise RuntimeError("pybullet-planning needs the process' only engine, and another one is running")
        self._package: Any = package
        self._place(scene)
        self._held = None if scene.held is None else self._attached(scene.held.name, scene.held.X_GO)
        self._pairs = [pair for first, second, margin in watched for pair in self._numbers(first, second, margin)]
        self._resolution = resolution
        self._q_min, self._q_max = robot.q_min, robot.q_max

    def collides(self, q: np.ndarray, diagnosis: bool = False) -> bool:
        """Is q (7,) beyond a joint limit, or is a watched pair nearer than it may be? diagnosis: unused, asked for."""
        package = self._package
        if np.any(q < self._q_min) or np.any(q > self._q_max):
            return True
        package.set_joint_positions(self._robot, self._arm_joints, q)
        if self._held is not None:
            self._held.assign()
        return any(self._near(*pair) for pair in self._pairs)

    def plan(self, start: np.ndarray, goal: np.ndarray, seed: int) -> np.ndarray | None:
        """Waypoints (n,7) from the start to the goal (7,), or None if `birrt` finds none."""
        random.seed(seed)
        np.random.seed(seed)  # noqa: NPY002 - the package draws from there
        package, joints = self._package, self._arm_joints
        path = package.birrt(
            tuple(start),
            tuple(goal),
            package.get_distance_fn(self._robot, joints),
            package.get_sample_fn(self._robot, joints),
            package.get_extend_fn(self._robot, joints, resolutions=np.full(7, self._resolution)),
            self.collides,
        )
        return None if path is None else np.array(path)

    def _place(self, scene: SceneState) -> None:
        for name, X_WO in scene.poses.items():
            self.put(name, X_WO)
        for finger in self._finger_joints:
            p.resetJointState(self._robot, finger, scene.opening / 2, physicsClientId=self._client)

    def _attached(self, name: str, X_GO: SE3) -> Any:
        X_OI = self._turned[name][1] if name in self._turned else SE3.Identity()
        pose = pin.SE3ToXYZQUAT(X_GO * X_OI).tolist()
        return self._package.Attachment(self._robot, self._tcp_link, (pose[:3], pose[3:]), self._bodies[name])

    def _numbers(self, first: str, second: str, margin: float) -> Iterator[tuple[tuple[int, int, int, int], float]]:
        """Body and link of either thing; a bin is several bodies."""
        for a in self._found(first):
            for b in self._found(second):
                yield (*a, *b), margin

    def _found(self, name: str) -> list[tuple[int, int]]:
        return [part for part, known in self._names.items() if known == name]

    def _near(self, bodies: tuple[int, int, int, int], margin: float) -> bool:
        a, link_a, b, link_b = bodies
        if margin >= 0.0:
            return self._package.pairwise_link_collision(a, link_a, b, link_b, max_distance=margin)
        points = self._package.pairwise_link_collision_info(a, link_a, b, link_b, max_distance=0.0)
        return any(point[8] < margin for point in points)
