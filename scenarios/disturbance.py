"""What a scene says will go wrong during a run: plain data. Times in s, lengths in m, forces in N."""

from dataclasses import dataclass

from pinocchio import SE3

from scenarios.names import Disordered


@dataclass(frozen=True)
class Moment:
    """When: at time `at`; or `after` s into the `nth` phase that is called so, of actions whose name is `action`
    (None: any)."""

    at: float | None = None
    phase: str = ""
    action: str | None = None
    nth: int = 1
    after: float = 0.0


@dataclass(frozen=True)
class Move:
    """An object is put elsewhere: shifted by `by` in W, turned about W's axes by `rpy` (rad) on the spot."""

    object: str
    by: tuple[float, float, float]
    rpy: tuple[float, float, float]


@dataclass(frozen=True)
class Take:
    """An object is taken away."""

    object: str


@dataclass(frozen=True)
class Bring:
    """An object that isn't there is put down."""

    object: str
    X_WO: SE3


@dataclass(frozen=True)
class ShiftRegion:
    """A region is shifted with what lies in it."""

    region: str
    by: tuple[float, float, float]


@dataclass(frozen=True)
class PushArm:
    """The arm is pushed at one of its links (None: at the tool centre)."""

    force: tuple[float, float, float]
    seconds: float
    link: str | None = None


@dataclass(frozen=True)
class WeakenGrip:
    """The fingers press with at most `force`."""

    force: float
    seconds: float


@dataclass(frozen=True)
class Disorder:
    """A sensor errs, or a joint rubs, by so much: N of force, s of delay, m of position, Nm of friction."""

    what: Disordered
    size: float
    seconds: float


@dataclass(frozen=True)
class NewGoal:
    """From now on something else is wanted."""

    goal: str


Happening = Move | Take | Bring | ShiftRegion | PushArm | WeakenGrip | Disorder | NewGoal


@dataclass(frozen=True)
class Disturbance:
    """Something that happens at a moment."""

    moment: Moment
    happening: Happening
