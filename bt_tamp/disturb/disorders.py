"""Sensors that err and joints that rub: what a scene declares and what the classes draw are made here alike."""

import math

import numpy as np

from bt_tamp.disturb.deed import Deed, Occasion
from scenarios.names import Disordered
from sim.disturbance import FOREVER, Fault
from sim.robot_faults import JointFriction
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

LEVER = 0.03
"""Metres: a force sensor that is off by so many N is off by so much torque for each of them."""

TURN_BY_SHIFT = math.radians(3.0) / 0.005
"""Rad of noise by metre of noise on poses: 3° at 5 mm."""


def disordered(now: Occasion, what: Disordered, size: float = 0.0, seconds: float = FOREVER) -> Deed:
    """Something errs by `size` (N, s, m or Nm, as it goes) for so many seconds; direction and joint go by chance."""
    lasting = "from then on" if seconds == FOREVER else f"for {seconds:g} s"
    fault, said = _disorder(now, what, size, now.t + seconds)
    return Deed(f"{said} {lasting}", (fault,), is_certain=True)


def _disorder(now: Occasion, what: Disordered, size: float, end: float) -> tuple[Fault, str]:
    """The fault from now to `end`, and what is said of it."""
    start, seed = now.t, int(now.rng.integers(2**31))
    match what:
        case "force-bias":
            force, torque = size * _direction(now), LEVER * size * _direction(now)
            fault = ForceBias(start=start, end=end, force=_triple(force), torque=_triple(torque))
            return fault, f"the force sensor was off by {size:g} N"
        case "force-noise":
            fault = ForceNoise(start=start, end=end, force=size, torque=LEVER * size, seed=seed)
            return fault, f"the force sensor was noisy by {size:g} N"
        case "force-missing":
            return ForceMissing(start=start, end=end), "the force sensor said nothing"
        case "force-frozen":
            return ForceFrozen(start=start, end=end), "the force sensor was frozen"
        case "joint-delay":
            late = JointDelay(start=start, end=end, seconds=size)
            return late, f"the joints' state came {1000 * size:g} ms late"
        case "joint-friction":
            joint = int(now.rng.integers(7))
            rubbing = JointFriction(start=start, end=end, torque=tuple(size * (k == joint) for k in range(7)))
            return rubbing, f"joint {joint + 1} rubbed with {size:g} Nm"
        case "pose-noise":
            angle = TURN_BY_SHIFT * size
            fault = PoseNoise(start=start, end=end, position=size / 3**0.5, angle=angle / 3**0.5, seed=seed)
            return fault, f"objects were seen with {1000 * size:g} mm and {math.degrees(angle):.2g}° of noise"
        case "pose-delay":
            return PoseDelay(start=start, end=end, seconds=size), f"objects were seen {size:g} s late"
        case "pose-missing":
            return PoseMissing(start=start, end=end), "no object was seen"


def _direction(now: Occasion) -> np.ndarray:
    drawn = now.rng.normal(size=3)
    return drawn / np.linalg.norm(drawn)


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
