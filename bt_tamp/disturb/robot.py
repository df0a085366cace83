"""What goes wrong with the robot: each function draws one instance of its class."""

from dataclasses import replace

import numpy as np

from bt_tamp.disturb.deed import Deed, Later, Occasion
from bt_tamp.disturb.disorders import disordered
from bt_tamp.disturb.world import DROPPING, moved
from scenarios.names import Disordered
from sim.robot_faults import Push, WeakGrip

WEAK = 0.5
"""Seconds for which the fingers are without force."""

LINKS = ("link_3", "link_4", "link_5", "link_6", "link_7", None)


def push(now: Occasion) -> Deed:
    """100 N for 0.1 s somewhere on the arm, level."""
    angle = now.rng.uniform(0.0, 2.0 * np.pi)
    link = LINKS[int(now.rng.integers(len(LINKS)))]
    force = (100.0 * float(np.cos(angle)), 100.0 * float(np.sin(angle)), 0.0)
    return pushed(now, force, 0.1, link)


def pushed(now: Occasion, force: tuple[float, float, float], seconds: float, link: str | None) -> Deed:
    """Someone pushes a link (None: the tool centre) with a force in N, in W."""
    where = "the hand" if link is None else f"the arm at {link}"
    said = f"someone pushed {where} with {np.linalg.norm(force):.0f} N for {seconds:g} s"
    return Deed(said, (Push(start=now.t, end=now.t + seconds, force=force, link=link),), is_certain=True)


def weak_grip(now: Occasion) -> Deed | None:
    """The fingers lose their force for half a second, over something that catches what is held."""
    if now.held is None or not now.falls_within_reach(WEAK + DROPPING):
        return None
    fault = WeakGrip(start=now.t, end=now.t + WEAK, force=0.5)
    return Deed("the gripper lost its force for 0.5 s", (fault,), names=(now.held,), loosens=True)


def moved_unseen(now: Occasion, what: Disordered, size: float, seconds: float, within: tuple[float, float]) -> Deed:
    """Eyes that err so, and `within` so many seconds something is moved: in a world at rest they would not matter."""
    seen = replace(disordered(now, what, size, seconds), is_certain=False)
    return replace(seen, later=Later(now.t + now.rng.uniform(*within), moved))
