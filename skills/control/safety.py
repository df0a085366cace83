"""When the arm must stop: safety limits, and the typed reasons for which it did.

A limit in the QP (`limits`) shapes the motion so that it is kept; one of these ends the motion when it
is about to be passed, whatever the task.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit

ALERT = 0.9
"""Share of a safety limit at which the arm stops, so that the limit itself is not passed."""

BLOW_ALERT = 0.75
"""The same of a contact force that isn't regulated: what is hit goes on pressing while the arm comes to rest."""

TORQUE_ALERT = 0.98
"""The same of a joint's torque: the QP keeps it within its limit anyway."""

TORQUE_PATIENCE = 0.05
"""Seconds that a joint may work at its torque limit."""

FORCE_PATIENCE = 0.004
COLLISION_PATIENCE = 0.006
"""Seconds that an excess must last: one odd reading stops nothing."""

SENSOR_PATIENCE = 0.02
"""Seconds without a wrist reading after which force control is blind."""


def _held_against(value: float, limit: float, digits: int) -> str:
    """The value beside its limit, compared as they are printed."""
    shown, bound = f"{value:.{digits}f}", f"{limit:.{digits}f}"
    where = "at" if shown == bound else "near" if value < limit else "beyond"
    return f"{where} the safety limit of {bound}"


@dataclass(frozen=True)
class ForceTooHigh:
    """The contact force came near its limit, N."""

    force: float
    limit: float

    def __str__(self) -> str:
        return f"{self.force:.0f} N of contact force, {_held_against(self.force, self.limit, 0)} N"


@dataclass(frozen=True)
class TooFast:
    """The tool's speed came near its limit, m/s."""

    speed: float
    limit: float

    def __str__(self) -> str:
        return f"the hand moved at {self.speed:.2f} m/s, {_held_against(self.speed, self.limit, 2)} m/s"


@dataclass(frozen=True)
class TorqueSpent:
    """A joint (1 to 7) went on needing all the torque it has, Nm."""

    joint: int
    torque: float

    def __str__(self) -> str:
        return f"joint {self.joint} needs more than {self.torque:.0f} Nm"


@dataclass(frozen=True)
class Collision:
    """Something that no model explains pushed against the arm: most on a joint (1 to 7), about so many Nm."""

    joint: int
    torque: float

    def __str__(self) -> str:
        return f"something unexpected pushes joint {self.joint} with about {self.torque:.0f} Nm"


@dataclass(frozen=True)
class SensorLost:
    """The wrist sensor was silent, or frozen, for so many seconds while a force was to be kept."""

    silent: float

    def __str__(self) -> str:
        return f"the wrist sensor has told nothing new for {self.silent * 1000:.0f} ms"


Stop = ForceTooHigh | TooFast | TorqueSpent | Collision | SensorLost


@dataclass(frozen=True)
class SafetyLimits:
    """speed: m/s of the tool centre. contact_force: N, of the wrench at the wrist that weight doesn't explain.
    collision (7,): Nm on each joint that come up suddenly and neither model nor wrist sensor explains. Ordinary
    work stays below 3 Nm; 1 Nm of joint friction, masses 20 % wrong and a sensor 4 ms late below 10 on joint 2
    (when the weight is first felt) and 4 on the others. A joint that rubs with 3 Nm turns round by 6; what meets
    the hand is felt at the wrist before."""

    speed: float
    contact_force: float = 60.0
    collision: np.ndarray = field(default_factory=lambda: np.array([8.0, 14.0, 7.5, 8.0, 7.5, 7.5, 7.5]))


class Guard:
    """Watches one tick after the other and says why to stop."""

    def __init__(self, limits: SafetyLimits, tau_max: np.ndarray, period: float) -> None:
        self._limits, self._tau_max = limits, tau_max
        self._period = period
        self.reset()

    def reset(self) -> None:
        """Begin anew: no excess has lasted yet."""
        self._forced = self._spent = self._struck = self._silent = 0.0

    def look(
        self, V: np.ndarray, wrench: np.ndarray, sudden: np.ndarray, tau: np.ndarray, is_pressed: bool
    ) -> Stop | None:
        """Look at one tick: the tool's velocity (6,), the wrench (6,) in contact, torques (7,) in Nm that nothing
        explains, those (7,) that are commanded, and whether the tool is meant to press."""
        limits = self._limits
        speed, force, struck, blow, spent, effort = _sizes(V, wrench, sudden, limits.collision, tau, self._tau_max)
        self._forced = self._longer(self._forced, force > (ALERT if is_pressed else BLOW_ALERT) * limits.contact_force)
        self._struck = self._longer(self._struck, blow > 1.0)
        self._spent = self._longer(self._spent, effort > TORQUE_ALERT)
        if speed > ALERT * limits.speed:
            return TooFast(speed, limits.speed)
        if self._forced > FORCE_PATIENCE:
            return ForceTooHigh(force, limits.contact_force)
        if self._struck > COLLISION_PATIENCE:
            return Collision(struck + 1, float(abs(sudden[struck])))
        if self._spent > TORQUE_PATIENCE:
            return TorqueSpent(spent + 1, float(self._tau_max[spent]))
        return None

    def sensor(self, is_silent: bool) -> Stop | None:
        """Look at whether the wrist sensor says anything, while a force is to be kept."""
        self._silent = self._longer(self._silent, is_silent)
        return SensorLost(self._silent) if self._silent > SENSOR_PATIENCE else None

    def _longer(self, so_far: float, is_so: bool) -> float:
        return so_far + self._period if is_so else 0.0


@njit(cache=True)
def _sizes(V, wrench, sudden, collision, tau, tau_max):
    """Speed and force, and of both torques the joint that is worst and its share of the limit."""
    speed = math.sqrt(V[0] ** 2 + V[1] ** 2 + V[2] ** 2)
    force = math.sqrt(wrench[0] ** 2 + wrench[1] ** 2 + wrench[2] ** 2)
    struck, blow = _worst(sudden, collision)
    spent, effort = _worst(tau, tau_max)
    return speed, force, struck, blow, spent, effort


@njit(cache=True)
def _worst(values: np.ndarray, limits: np.ndarray) -> tuple[int, float]:
    """Index of the value that is largest as a share of its limit, and that share."""
    worst, largest = 0, -1.0
    for i in range(len(values)):
        share = abs(values[i]) / limits[i]
        if share > largest:
            worst, largest = i, share
    return worst, largest
