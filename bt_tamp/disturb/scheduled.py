"""The disturbances that a scene declares, as deeds."""

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from bt_tamp.disturb.deed import Deed, Draw, Occasion
from bt_tamp.disturb.disorders import disordered
from bt_tamp.disturb.robot import pushed
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
from sim.robot_faults import WeakGrip
from sim.world_faults import BinShifted, Brought, Moved, TakenAway

BESIDE = (0.0, 0.2)
"""Metres from where the arm is in its way within which what is brought is put down."""


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
            return Deed(f"{name} was {_moved(by, rpy)}", (Moved(start=t, name=name, X_WO=X_WO),), names=(name,))
        case Take(name):
            return (
                Deed(f"{name} was taken away", (TakenAway(start=t, name=name),), names=(name,))
                if name in there
                else None
            )
        case Bring(name, X_WO):
            return None if name in there else _brought(now, name, X_WO)
        case ShiftRegion(region, by):
            said = f"{region} was shifted by {_centimetres(by)}"
            return Deed(said, (BinShifted(start=t, region=region, by=by),), names=(region,))
        case PushArm(force, seconds, link):
            return pushed(now, force, seconds, link)
        case WeakenGrip(force, seconds):
            weak = WeakGrip(start=t, end=t + seconds, force=force)
            said = f"the gripper pressed with {force:g} N at most for {seconds:g} s"
            held = now.held
            return Deed(said, (weak,), names=() if held is None else (held,), loosens=held is not None)
        case Disorder(what, size, seconds):
            return disordered(now, what, size, seconds)
        case NewGoal(goal):
            wanted = goal_facts(goal)
            said = ", ".join(sorted(map(str, wanted)))
            return Deed(f"what was wanted from then on: {said}", goal=wanted)


def _brought(now: Occasion, name: str, X_WO: SE3) -> Deed | None:
    """A body is put down at X_WO, or beside it where the arm is in the way: that may be waiting for just this body."""
    body, sentence = now.scenario.bodies[name], f"{name} appeared"
    spot: SE3 | None = X_WO
    if now.is_taken(body, X_WO):
        return None
    if not now.stands_free(body, X_WO):
        spot = now.spot(body, X_WO.rotation, X_WO.translation[:2], BESIDE) if now.is_on_top(body, X_WO) else None
        sentence += ", beside where it was to be: the arm was there"
    return None if spot is None else Deed(sentence, (Brought(start=now.t, name=name, X_WO=spot),), names=(name,))


def _moved(by: tuple[float, float, float], rpy: tuple[float, float, float]) -> str:
    turn = f"turned by {_brief(np.degrees(np.linalg.norm(pin.log3(pin.rpy.rpyToMatrix(*rpy)))))}°" if any(rpy) else ""
    shift = f"moved by {_centimetres(by)}" if any(by) else ""
    return " and ".join(part for part in (shift, turn) if part)


def _centimetres(by: tuple[float, float, float]) -> str:
    return f"{_brief(100 * float(np.linalg.norm(by)))} cm"


def _brief(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"
