"""The disturbances that a scene declares, as deeds."""

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from bt_tamp.disturb.deed import Deed, Draw, Occasion
from planner.task.facts import goal_facts
from scenarios.disturbance import (
    Bring,
    Disorder,
    Happening,
    Move,
    NewGoal,
    PushArm,
    ShiftRegion,
    Take,
    WeakenGrip,
)
from sim.disturbance import Fault
from sim.robot_faults import JointFriction, Push, WeakGrip
from sim.sensor_faults import (
    ForceBias,
    ForceFrozen,
    ForceMissing,
    ForceNoise,
    JointDelay,
    PoseDelay,
    PoseMissing,
    PoseNoise,
)
from sim.world_faults import BinShifted, Brought, Moved, TakenAway


def drawing(happening: Happening) -> Draw:
    """What does it, when its moment has come."""
    return lambda now: _deed(happening, now)


def _deed(happening: Happening, now: Occasion) -> Deed | None:
    t, there = now.t, now.truth.poses
    match happening:
        case Move(name, by, rpy):
            if name not in there:
                return None
            X = there[name]
            X_WO = SE3(pin.rpy.rpyToMatrix(*rpy) @ X.rotation, X.translation + np.array(by))
            return Deed(f"{name} was moved", (Moved(start=t, name=name, X_WO=X_WO),), names=(name,))
        case Take(name):
            return (
                Deed(f"{name} was taken away", (TakenAway(start=t, name=name),), names=(name,))
                if name in there
                else None
            )
        case Bring(name, X_WO):
            if name in there:
                return None
            return Deed(f"{name} appeared", (Brought(start=t, name=name, X_WO=X_WO),), names=(name,))
        case ShiftRegion(region, by):
            return Deed(f"{region} was shifted", (BinShifted(start=t, region=region, by=by),), names=(region,))
        case PushArm(force, seconds, link):
            size = float(np.linalg.norm(force))
            push = Push(start=t, end=t + seconds, force=force, link=link)
            return Deed(f"someone pushed the arm with {size:.0f} N for {seconds:g} s", (push,))
        case WeakenGrip(force, seconds):
            weak = WeakGrip(start=t, end=t + seconds, force=force)
            return Deed(f"the gripper pressed with {force:g} N at most for {seconds:g} s", (weak,))
        case Disorder(what, size, seconds):
            return Deed(_SAID[what].format(size=size, seconds=seconds), (_fault(happening, now),))
        case NewGoal(goal):
            return Deed("something else was wanted from then on", goal=goal_facts(goal))


_SAID = {
    "force-bias": "the force sensor was off by {size:g} N for {seconds:g} s",
    "force-noise": "the force sensor was noisy for {seconds:g} s, by {size:g} N",
    "force-missing": "the force sensor said nothing for {seconds:g} s",
    "force-frozen": "the force sensor was frozen for {seconds:g} s",
    "joint-delay": "the joints' state came {size:g} s late for {seconds:g} s",
    "joint-friction": "the joints rubbed with {size:g} Nm for {seconds:g} s",
    "pose-noise": "objects were seen with {size:g} m of noise for {seconds:g} s",
    "pose-delay": "objects were seen {size:g} s late for {seconds:g} s",
    "pose-missing": "no object was seen for {seconds:g} s",
}


def _fault(disorder: Disorder, now: Occasion) -> Fault:
    size, seed = disorder.size, int(now.rng.integers(2**31))
    start, end = now.t, now.t + disorder.seconds
    match disorder.what:
        case "force-bias":
            return ForceBias(start=start, end=end, force=(0.0, 0.0, size))
        case "force-noise":
            return ForceNoise(start=start, end=end, force=size, seed=seed)
        case "force-missing":
            return ForceMissing(start=start, end=end)
        case "force-frozen":
            return ForceFrozen(start=start, end=end)
        case "joint-delay":
            return JointDelay(start=start, end=end, seconds=size)
        case "joint-friction":
            return JointFriction(start=start, end=end, torque=(size,) * 7)
        case "pose-noise":
            return PoseNoise(start=start, end=end, position=size, seed=seed)
        case "pose-delay":
            return PoseDelay(start=start, end=end, seconds=size)
        case "pose-missing":
            return PoseMissing(start=start, end=end)
