"""What the controller is asked to follow, and where along it the arm should be now."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from planner.motion.timing import joined
from planner.motion.trajectory import Trajectory
from skills.control.dynamics import Dynamics

Mode = Literal["position", "impedance", "hybrid"]

SHORTEST_JOINING = 0.15
"""Seconds in which a difference between the arm and the trajectory's start fades, at least."""

SHORTEST_STOP = 0.1
"""Seconds in which the arm comes to rest, at least."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A trajectory and the law by which the arm follows it.

    mode "position": stiffly, in joint space. "impedance": the tool as a mass, spring and damper with
    `stiffness` (6,) (N/m and Nm/rad, linear first, along W's axes; the other modes make no use of
    it). "hybrid": stiffly in all directions of the contact frame C but its z, along which the
    measured force is regulated.

    damping: impedance as a ratio of critical damping; in hybrid mode what damps the sinking onto the surface, as a
    ratio of the usual.
    force: N to press with along −z of C (0: none). Impedance shifts its set-point below the touched
    surface by force over stiffness, without measuring what comes of it.
    R_WC (3,3): axes of C in W; z is the surface's outward normal.
    until_contact: the trajectory leads through the expected surface and is followed until the tool
    touches; time then stands still and the force ramps up. Otherwise a reference with a force
    presses from its start on.
    then: in position mode, what the trajectory passes into at its end, where it need not stand still: a reference
    to that, told in time, goes on from there.

    Raises ValueError for parts that don't fit together.
    """

    trajectory: Trajectory
    mode: Mode = "position"
    stiffness: np.ndarray | None = None
    force: float = 0.0
    R_WC: np.ndarray = field(default_factory=lambda: np.eye(3))
    until_contact: bool = False
    damping: float = 1.0
    then: Trajectory | None = None

    def __post_init__(self) -> None:
        if self.mode not in ("position", "impedance", "hybrid"):
            raise ValueError(f"control mode {self.mode!r}, expected position, impedance or hybrid")
        if not self.force >= 0.0:
            raise ValueError(f"force to press with is {self.force} N, expected 0 or more")
        if not self.damping > 0.0:
            raise ValueError(f"damping ratio is {self.damping}, expected above 0")
        if self.mode == "position" and self.force > 0.0:
            raise ValueError(f"position mode can't press with {self.force} N, expected impedance or hybrid")
        if self.mode == "hybrid" and self.force == 0.0:
            raise ValueError("hybrid mode needs a force above 0 N")
        if self.until_contact and self.force == 0.0:
            raise ValueError("a reference until contact needs a force above 0 N")
        if self.then is not None and self.mode != "position":
            raise ValueError(f"{self.mode} mode can't pass into another trajectory, expected position")
        if self.mode == "impedance":
            stiffness = np.zeros(0) if self.stiffness is None else np.asarray(self.stiffness, dtype=float)
            if stiffness.shape != (6,) or not (stiffness > 0.0).all():
                raise ValueError(f"impedance needs six positive stiffnesses, got {self.stiffness}")

    @cached_property
    def course(self) -> Trajectory:
        """The trajectory with what it passes into."""
        return self.trajectory if self.then is None else joined([self.trajectory, self.then])

    @cached_property
    def normal(self) -> np.ndarray:
        """The surface's outward normal (3,) in W."""
        return np.ascontiguousarray(self.R_WC[:, 2])


def near_contact(dynamics: Dynamics, reference: Reference, speed: float) -> float:
    """How many times longer the reference's trajectory must take (1 or more) for the tool nowhere to come faster
    than `speed` m/s against the surface."""
    trajectory, fastest = reference.trajectory, speed
    for t in np.linspace(0.0, trajectory.duration, 25):
        fastest = max(fastest, -float(reference.normal @ dynamics.target(*trajectory.at(t)).V[:3]))
    return fastest / speed


class Fade:
    """A difference in joint position and velocity (7,) each that goes to zero in `duration` seconds, along a
    quintic that begins and ends without acceleration."""

    def __init__(self, gap: np.ndarray, slip: np.ndarray, duration: float) -> None:
        self._gap, self._slip = gap, slip
        self.duration = duration

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The difference (7,), its velocity and acceleration after t seconds."""
        if t >= self.duration:
            return _STILL, _STILL, _STILL
        T = self.duration
        s = t / T
        gap, slip = self._gap, self._slip * T
        position = gap * (1 - s**3 * (10 - 15 * s + 6 * s * s)) + slip * (s - s**3 * (6 - 8 * s + 3 * s * s))
        velocity = gap * (-30 * s * s * (1 - s) ** 2) + slip * (1 - s * s * (18 - 32 * s + 15 * s * s))
        acceleration = gap * (-60 * s * (1 - s) * (1 - 2 * s)) + slip * (-s * (36 - 96 * s + 60 * s * s))
        return position, velocity / T, acceleration / T**2


class Course:
    """Progress along a trajectory. Where the arm isn't at its start when it begins, the difference
    (in position and velocity) fades instead of being jumped."""

    def __init__(self, trajectory: Trajectory, fade: Fade | None = None) -> None:
        self.trajectory = trajectory
        self._fade = fade
        self._frozen: np.ndarray | None = None
        self.time = self._elapsed = _BEGUN

    @staticmethod
    def joined(trajectory: Trajectory, q: np.ndarray, v: np.ndarray, a_max: np.ndarray) -> "Course":
        """Begin from where the arm is (q, v (7,)), spending about a_max (7,) rad/s² on joining the trajectory."""
        q0, v0, _ = trajectory.at(_BEGUN)
        gap, slip = q - q0, v - v0
        # Peak accelerations of the quintic: 5.8 gap/T² and 3.9 slip/T.
        by_gap = np.sqrt(5.8 * np.abs(gap) / a_max).max()
        by_slip = (3.9 * np.abs(slip) / a_max).max()
        return Course(trajectory, Fade(gap, slip, max(SHORTEST_JOINING, float(by_gap), float(by_slip))))

    @staticmethod
    def stop(q: np.ndarray, v: np.ndarray, a_max: np.ndarray) -> "Course":
        """Come to rest from q, v (7,), braking with at most a_max (7,) rad/s², and stay."""
        # With a gap of v T/2 the quintic's velocity falls monotonously, braking with 1.5 v/T at most.
        duration = max(SHORTEST_STOP, float((1.5 * np.abs(v) / a_max).max()))
        rest = q + v * duration / 2
        return Course(Trajectory.standstill(rest), Fade(q - rest, v, duration))

    def passed(self, trajectory: Trajectory, duration: float) -> "Course":
        """The same course, seen as one along `trajectory`, the first `duration` seconds of it being over."""
        onward = Course(trajectory, self._fade)
        onward.time, onward._elapsed = self.time - duration, self._elapsed
        return onward

    @property
    def over(self) -> bool:
        """Whether the trajectory's time is over and the difference at its start has faded."""
        joined = self._fade is None or self._elapsed >= self._fade.duration
        return joined and self.time >= self.trajectory.duration

    def advance(self, period: float) -> None:
        """Let `period` seconds pass."""
        self._elapsed += period
        if self._frozen is None:
            self.time += period

    def freeze(self) -> None:
        """Stay from now on where the course is now."""
        self._frozen = self.now()[0]

    def now(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where the joints should be: position, velocity and acceleration (7,)."""
        if self._frozen is not None:
            return self._frozen, _STILL, _STILL
        q, v, a = self.trajectory.at(self.time)
        if self._fade is None or self._elapsed >= self._fade.duration:
            return q, v, a
        dq, dv, da = self._fade.at(self._elapsed)
        return q + dq, v + dv, a + da


_STILL = np.zeros(7)

_BEGUN = 1e-9
"""Seconds after the start: at 0 itself a trajectory still stands."""
