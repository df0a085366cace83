"""From observations to the believed scene: where things are, and what the hand holds."""

from collections import defaultdict, deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from pinocchio import SE3

from bt_tamp.executive.rest import FINGERS_AT_REST, at_rest
from bt_tamp.executive.sighting import OVERLOOKED, REMEMBERED, Sighting
from planner.grasps import TIP
from planner.task.facts import place_of
from scenarios.scenario import Scenario
from scenarios.shapes import distance_to
from sim.plant import Observation
from sim.robot import RobotModel
from sim.scene import Held, SceneState, is_on_floor, pose_distance

GRIP_FORCE = 5.0
"""Newtons below which the fingers hold nothing, but for what is seen to stay where it was between them, or to hang
there."""

STAYS = 0.008
"""Metres in the hand within which that is."""

GRASP_REACH = 0.008
KEEP_REACH = 0.025
"""Metres from the pads' middle within which a body counts as grasped, and as still held (hysteresis)."""


APART = 0.004
"""Metres between the fingers from which something may be between them."""

OFF_STOP = 1e-3
"""Rad by which a joint is believed off its stop, at least."""

OLDEST = 1.0
"""Seconds for which it is remembered where the hand was: as late as a pose may be told."""


class Belief:
    """Keeps the believed scene. A body is remembered for a while when it is out of sight, its pose averaged when it is
    noisy; a held one moves along with the hand."""

    def __init__(self, scenario: Scenario, robot: RobotModel) -> None:
        self._scenario = self._declared = scenario
        self._robot = robot
        self._lowest, self._highest = robot.q_min + OFF_STOP, robot.q_max - OFF_STOP
        self._held: str | None = None
        self._regions: Mapping[str, SE3] = {}
        self._lying = defaultdict[str, Sighting](Sighting)
        self._in_hand = Sighting()
        self._X_GO: SE3 | None = None
        self._X_GO_pressed: SE3 | None = None
        self._known: dict[str, tuple[float, SE3]] = {}
        self._hands: deque[tuple[float, SE3]] = deque()
        self._was_blind = False

    def update(self, observation: Observation, is_closing: bool) -> SceneState:
        """The scene as believed after an observation; `is_closing`: the fingers are told to press."""
        X_WG = self._robot.X_WG(observation.q)
        self._remember_hand(observation.t, X_WG)
        self._look_at_regions(observation.regions)
        poses = self._poses(observation)
        before = self._held
        if before is not None:
            self._X_GO = self._seen_in_hand(before, observation, X_WG)
            if self._X_GO is not None:
                poses[before] = X_WG * self._X_GO
        self._held = self._held_name(observation, X_WG, poses, is_closing)
        held = None
        if self._held is not None:
            if self._held != before or self._X_GO is None:
                self._in_hand = Sighting()
                self._X_GO = X_WG.inverse() * poses[self._held]
            poses[self._held] = X_WG * self._X_GO
            if observation.grip_force >= GRIP_FORCE:
                self._X_GO_pressed = self._X_GO
            self._known[self._held] = (observation.t, poses[self._held])
            held = Held(self._held, self._X_GO)
        else:
            self._X_GO = self._X_GO_pressed = None
        return SceneState(self._scenario, poses, self._within_limits(observation.q), observation.opening, held)

    def _within_limits(self, q: np.ndarray) -> np.ndarray:
        """A joint that was pushed onto its stop, believed just off it: no motion could begin beyond a limit."""
        return np.minimum(np.maximum(q, self._lowest), self._highest)

    def _poses(self, observation: Observation) -> dict[str, SE3]:
        """Every body that is seen, or was a moment ago."""
        t, known = observation.t, self._known
        for name, X_WO in observation.poses.items():
            known[name] = (t, self._lying[name].see(X_WO, at_rest(observation.velocities[name])))
        patience = OVERLOOKED if observation.poses else REMEMBERED
        if self._was_blind and observation.poses:
            # What doesn't turn up again with the rest is looked for from now on.
            for name in known.keys() - observation.poses.keys():
                known[name] = (t, known[name][1])
        self._was_blind = not observation.poses
        for name in [name for name, (seen, _) in known.items() if t - seen > patience]:
            del known[name]
        return {name: known[name][1] for name in self._declared.bodies if name in known}

    def _seen_in_hand(self, name: str, observation: Observation, X_WG: SE3) -> SE3 | None:
        """X_GO of a held body: by where the hand was when the body was seen; as before while it is out of sight."""
        if name not in observation.poses:
            return self._X_GO
        seen_at = observation.seen_at.get(name)
        X_WG_then = X_WG if seen_at is None else self._hand_at(seen_at)
        return self._in_hand.see(X_WG_then.inverse() * observation.poses[name], is_at_rest=True)

    def _remember_hand(self, t: float, X_WG: SE3) -> None:
        self._hands.append((t, X_WG))
        while self._hands[0][0] < t - OLDEST:
            self._hands.popleft()

    def _hand_at(self, t: float) -> SE3:
        """Where the hand was, between two looks at it."""
        later = next((k for k, (then, _) in enumerate(self._hands) if then >= t), len(self._hands) - 1)
        (t_b, X_b), (t_a, X_a) = self._hands[later], self._hands[max(later - 1, 0)]
        share = 1.0 if t_b <= t_a else min(max((t - t_a) / (t_b - t_a), 0.0), 1.0)
        return SE3.Interpolate(X_a, X_b, share)

    def _look_at_regions(self, regions: Mapping[str, SE3]) -> None:
        """Regions that stand elsewhere than declared are believed where they are seen."""
        if regions == self._regions:
            return
        self._regions = regions
        declared, before = self._declared.regions, self._scenario.regions
        moved = {
            name: before[name] if before[name].X_WR == X_WR else replace(declared[name], X_WR=X_WR)
            for name, X_WR in regions.items()
        }
        self._scenario = replace(self._declared, regions={**declared, **moved})

    def _stays(self, observation: Observation) -> bool:
        """Is what was held seen where it was when the fingers last pressed on it?"""
        if self._held not in observation.poses or self._X_GO is None or self._X_GO_pressed is None:
            return False
        return pose_distance(self._X_GO, self._X_GO_pressed)[0] < STAYS

    def _held_name(self, observation: Observation, X_WG: SE3, poses: Mapping[str, SE3], is_closing: bool) -> str | None:
        is_pressed = observation.grip_force >= GRIP_FORCE
        if not is_closing:
            return None
        if abs(observation.opening_velocity) > FINGERS_AT_REST and self._held is None:
            return None
        pads = X_WG.act(np.array([0.0, 0.0, -TIP]))

        def gap(name: str) -> float:
            return distance_to(self._declared.bodies[name].shape, poses[name].actInv(pads))

        is_kept = is_pressed or self._stays(observation)
        if is_kept and self._held is not None and self._held in poses and gap(self._held) < KEEP_REACH:
            return self._held
        nearest = min(poses, key=gap, default=None)
        if nearest is None or gap(nearest) >= GRASP_REACH:
            return None
        return nearest if is_pressed or self._hangs(nearest, observation, poses) else None

    def _hangs(self, name: str, observation: Observation, poses: Mapping[str, SE3]) -> bool:
        """Is a body between the fingers at rest with nothing under it? Then they hold it, however weakly."""
        if observation.opening < APART or name not in observation.poses or not at_rest(observation.velocities[name]):
            return False
        scene = SceneState(self._scenario, poses, observation.q, observation.opening)
        return place_of(scene, name) is None and not is_on_floor(scene, name)
