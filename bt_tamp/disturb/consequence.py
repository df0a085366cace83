"""Did what was done change a fact or a geometry that the rest of the run rests on?"""

from collections.abc import Mapping
from dataclasses import dataclass

from pinocchio import SE3

from bt_tamp.disturb.deed import Deed, Occasion
from planner.task.symbols import Fact
from sim.robot import RobotModel
from sim.scene import pose_distance
from skills.watching import SHIFT, TURN


@dataclass(frozen=True)
class Stake:
    """What a run rests on, in truth: which bodies are there, where those lie that are still needed and lie about, where
    the regions stand, what is wanted; and what of it is reached, as it is seen."""

    there: frozenset[str]
    poses: Mapping[str, SE3]
    regions: Mapping[str, SE3]
    goal: frozenset[Fact]
    reached: frozenset[Fact]

    @staticmethod
    def of(now: Occasion) -> "Stake":
        """What is at stake at that moment."""
        poses, agenda = dict(now.truth.poses), now.machine.agenda
        needed = {*now.lying(), *now.tools()}
        return Stake(
            frozenset(poses),
            {name: poses[name] for name in sorted(needed & poses.keys())},
            now.truth.regions,
            agenda.order,
            agenda.goal & agenda.facts(now.machine.context.scene),
        )

    def is_hurt(self, after: "Stake", poses: Mapping[str, SE3]) -> bool:
        """Is it otherwise than it was? `poses`: where everything lies afterwards."""
        if (self.there, self.goal) != (after.there, after.goal) or self.regions != after.regions:
            return True
        if not self.reached <= after.reached:
            return True
        return any(have_parted(X_WO, poses[name]) for name, X_WO in self.poses.items())


@dataclass
class Trial:
    """One deed, by its number among those told, whose consequence is still to be seen: what was at stake before it,
    until when (s) it is looked for, and the pose in the hand of what the deed is about to loosen."""

    number: int
    deed: Deed
    since: float
    before: Stake
    X_GO: SE3 | None

    @staticmethod
    def of(number: int, deed: Deed, now: Occasion) -> "Trial":
        """What has been done at that moment, and has not come about yet."""
        return Trial(number, deed, now.t, Stake.of(now), _in_hand(deed, now) if deed.loosens else None)

    @property
    def until(self) -> float:
        """Seconds of the run after which nothing more will come of it."""
        ends = [fault.end for fault in self.deed.faults] if self.deed.loosens else []
        return max([self.since, *ends]) + LOOSE_FOR

    def is_proven(self, now: Occasion) -> bool:
        """Has it changed something by now?"""
        if self.deed.loosens:
            X_GO, context = _in_hand(self.deed, now), now.machine.context
            is_lost = X_GO is None or self.X_GO is None or have_parted(self.X_GO, X_GO) or context.scene.held is None
            return context.grip.is_closing and is_lost
        return self.before.is_hurt(Stake.of(now), now.truth.poses)


LOOSE_FOR = 0.3
"""Seconds for which something may go on falling once the fingers hold again."""


def have_parted(X_before: SE3, X_now: SE3) -> bool:
    """Are two poses so far apart that what was worked out for one doesn't fit the other?"""
    distance, angle = pose_distance(X_before, X_now)
    return distance > SHIFT or angle > TURN


def _in_hand(deed: Deed, now: Occasion) -> SE3 | None:
    """X_GO of what the deed is about, None if it isn't there."""
    robot: RobotModel = now.machine.robot
    X_WO = now.truth.poses.get(deed.names[0])
    return None if X_WO is None else robot.X_WG(now.truth.q).inverse() * X_WO
