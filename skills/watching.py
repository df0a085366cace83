"""Does what an action was refined for still hold? Its objects lie where they lay, and the rest of its path is free."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from pinocchio import SE3

from planner.failure import MotionFailure
from planner.motion.motion_planner import MotionPlanner
from planner.refinement import Phase, Refinement
from planner.support import burden
from scenarios.goal import is_crumb
from sim.scene import SceneState, pose_distance

SHIFT = 0.008
TURN = np.radians(6.0)
"""How far an object may move before what was refined for it no longer fits."""

IN_HAND = 0.01
IN_HAND_TURN = np.radians(7.0)
"""How far what is held may shift and turn in the hand before a motion that carries it no longer fits."""

STIR = 0.002
STIR_TURN = np.radians(2.0)
"""How far a body may move before the path is looked at again."""


class Watch:
    """Compares the scene with the one in which an action was refined. Cheap as long as nothing has moved."""

    def __init__(self, motion: MotionPlanner, refinement: Refinement, scene: SceneState) -> None:
        self._motion = motion
        self._phases = refinement.phases
        self._refined = scene
        self._looked_at = scene.poses
        self._objects = [name for name in refinement.action.args if name in scene.poses and not _holds(scene, name)]
        self._regions = self._regions_looked_at = scene.scenario.regions
        self._places = [name for name in refinement.action.args if name in self._regions]
        self._load = Load(self._objects, scene)

    def object_shifted(self, scene: SceneState) -> str | None:
        """Which of the action's objects no longer lies, or is no longer held, as it was refined for, in a sentence."""
        for name in self._objects:
            if name not in scene.poses:
                return f"{name} is gone"
            if _has_moved(self._refined.poses[name], scene.poses[name], SHIFT, TURN):
                return f"{name} was moved"
        for name in self._places:
            if scene.scenario.regions[name] is not self._regions[name]:
                return f"{name} was moved"
        return self._shifted_in_hand(scene) or self._load.come(scene)

    def _shifted_in_hand(self, scene: SceneState) -> str | None:
        before, held = self._refined.held, scene.held
        if before is None or held is None or held.name != before.name:
            return None
        has_shifted = _has_moved(before.X_GO, held.X_GO, IN_HAND, IN_HAND_TURN)
        return f"{held.name} shifted in the hand" if has_shifted else None

    def path_blocked(self, scene: SceneState, phase: Phase, since: float) -> MotionFailure | None:
        """What is in the way of the rest of a phase, `since` seconds after its start, and of the moves after it.

        Looked for only when a body that the phase may not touch has moved.
        """
        may_touch = frozenset[str]().union(*phase.allowed)
        stirred = [name for name in _stirred(self._looked_at, scene) if name not in may_touch]
        regions = scene.scenario.regions
        stirred += [
            name for name in regions if name not in may_touch and regions[name] is not self._regions_looked_at[name]
        ]
        if not stirred:
            return None
        for ahead, start in self._ahead(phase, since):
            seen = replace(scene, opening=ahead.opening, held=ahead.held)
            failure = self._motion.audit(seen, ahead.trajectory, ahead.allowed, since=start, only=frozenset(stirred))
            if failure is not None:
                return failure
        self._looked_at, self._regions_looked_at = scene.poses, regions
        return None

    def _ahead(self, phase: Phase, since: float) -> Sequence[tuple[Phase, float]]:
        """The phase from `since` on, and the free motions that follow it."""
        names = [one.name for one in self._phases]
        rest = self._phases[names.index(phase.name) + 1 :] if phase.name in names else ()
        found = [(phase, since)]
        for one in rest:
            if one.kind not in ("move", "approach"):
                break
            found.append((one, 0.0))
        return found


class Load:
    """What stands on some bodies, in the hand or not, compared with what stood on them in an earlier scene. Crumbs are
    only pushed, whatever stands on them."""

    def __init__(self, names: Sequence[str], scene: SceneState) -> None:
        crumbs = {name for name in names if is_crumb(scene.scenario.bodies[name], scene.scenario.robot.model)}
        self._borne = {name: _burden(scene, name) for name in names if name not in crumbs}
        self._looked_at = scene.poses

    def come(self, scene: SceneState) -> str | None:
        """What has come to stand on one of them, in a sentence. Looked for only when something has moved."""
        if not _stirred(self._looked_at, scene):
            return None
        for name, borne in self._borne.items():
            more = _burden(scene, name) - borne if name in scene.poses else ()
            if more:
                return f"{', '.join(sorted(more))} came to stand on {name}"
        self._looked_at = scene.poses
        return None


def _burden(scene: SceneState, name: str) -> frozenset[str]:
    return burden(replace(scene, held=None), name)


def _stirred(before: Mapping[str, SE3], scene: SceneState) -> list[str]:
    """What lies otherwise than before, or is new."""
    return [
        name
        for name, X_WO in scene.poses.items()
        if not _holds(scene, name) and (name not in before or _has_moved(before[name], X_WO, STIR, STIR_TURN))
    ]


def _holds(scene: SceneState, name: str) -> bool:
    return scene.held is not None and scene.held.name == name


def _has_moved(X_before: SE3, X_now: SE3, shift: float, turn: float) -> bool:
    distance, angle = pose_distance(X_before, X_now)
    return distance > shift or angle > turn
