"""What goes wrong with the robot and its sensors: each function draws one instance of its class."""

import numpy as np

from bt_tamp.disturb.deed import Deed, Occasion
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

LINKS = ("link_3", "link_4", "link_5", "link_6", "link_7", None)


def push(now: Occasion) -> Deed:
    """100 N for 0.1 s somewhere on the arm, level."""
    angle = now.rng.uniform(0.0, 2.0 * np.pi)
    link = LINKS[int(now.rng.integers(len(LINKS)))]
    force = (100.0 * float(np.cos(angle)), 100.0 * float(np.sin(angle)), 0.0)
    where = "the hand" if link is None else f"the arm at {link}"
    return Deed(f"someone pushed {where} with 100 N", (Push(start=now.t, end=now.t + 0.1, force=force, link=link),))


def weak_grip(now: Occasion) -> Deed | None:
    """The fingers lose their force for half a second."""
    if now.held is None:
        return None
    fault = WeakGrip(start=now.t, end=now.t + 0.5, force=0.5)
    return Deed("the gripper lost its force for 0.5 s", (fault,), names=(now.held,))


def force_bias(now: Occasion) -> Deed:
    """The wrist sensor is off by 3 N and 0.1 Nm from now on."""
    force, torque = 3.0 * _direction(now), 0.1 * _direction(now)
    fault = ForceBias(start=now.t, force=_triple(force), torque=_triple(torque))
    return Deed("the force sensor was off by 3 N from then on", (fault,))


def force_noise(now: Occasion) -> Deed:
    """The wrist sensor is noisy from now on: 0.5 N and 0.02 Nm of standard deviation."""
    fault = ForceNoise(start=now.t, force=0.5, torque=0.02, seed=int(now.rng.integers(2**31)))
    return Deed("the force sensor was noisy from then on, by 0.5 N", (fault,))


def force_missing(now: Occasion) -> Deed:
    """The wrist sensor says NaN for a second."""
    return Deed("the force sensor said nothing for 1 s", (ForceMissing(start=now.t, end=now.t + 1.0),))


def force_frozen(now: Occasion) -> Deed:
    """The wrist sensor says the same for a second."""
    return Deed("the force sensor was frozen for 1 s", (ForceFrozen(start=now.t, end=now.t + 1.0),))


def joint_delay(now: Occasion) -> Deed:
    """Joint positions and velocities are 10 ms old for two seconds."""
    fault = JointDelay(start=now.t, end=now.t + 2.0, seconds=0.01)
    return Deed("the joints' state came 10 ms late for 2 s", (fault,))


def joint_friction(now: Occasion) -> Deed:
    """One joint rubs with 3 Nm from now on."""
    joint = int(now.rng.integers(7))
    fault = JointFriction(start=now.t, torque=tuple(3.0 if k == joint else 0.0 for k in range(7)))
    return Deed(f"joint {joint + 1} rubbed with 3 Nm from then on", (fault,))


def pose_noise(now: Occasion) -> Deed:
    """Objects are seen with 5 mm and 3° of noise from now on."""
    angle = float(np.radians(3.0)) / np.sqrt(3.0)
    fault = PoseNoise(start=now.t, position=0.005 / np.sqrt(3.0), angle=angle, seed=int(now.rng.integers(2**31)))
    return Deed("objects were seen with 5 mm and 3° of noise from then on", (fault,))


def pose_delay(now: Occasion) -> Deed:
    """Objects are seen 0.3 s late from now on."""
    return Deed("objects were seen 0.3 s late from then on", (PoseDelay(start=now.t, seconds=0.3),))


def pose_missing(now: Occasion) -> Deed:
    """Nothing is seen for a second."""
    return Deed("no object was seen for 1 s", (PoseMissing(start=now.t, end=now.t + 1.0),))


def _direction(now: Occasion) -> np.ndarray:
    drawn = now.rng.normal(size=3)
    return drawn / np.linalg.norm(drawn)


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
