"""The disturbances that a scene declares, as deeds."""

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from bt_tamp.disturb.deed import Deed, Draw, Occasion
from bt_tamp.disturb.disorders import disordered
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
from sim.robot_faults import Push, WeakGrip
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
            return Deed(f"someone pushed the arm with {size:.0f} N for {seconds:g} s", (push,), is_certain=True)
        case WeakenGrip(force, seconds):
            weak = WeakGrip(start=t, end=t + seconds, force=force)
            said = f"the gripper pressed with {force:g} N at most for {seconds:g} s"
            held = now.held
            return Deed(said, (weak,), names=() if held is None else (held,), loosens=held is not None)
        case Disorder(what, size, seconds):
            return disordered(now, what, size, seconds)
        case NewGoal(goal):
            return Deed("something else was wanted from then on", goal=goal_facts(goal))
