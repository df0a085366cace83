"""The `disturbances` section of the scene format: what goes wrong during a run, and when.

Each entry says when (`at`, or `phase` with `action`, `nth` and `after`) and, under one further key, what.
"""

from typing import Annotated

from pydantic import Field, model_validator

from scenarios.names import SIZELESS, Disordered
from scenarios.schema_parts import Angles, BodyPose, Number, Part, Position, Triple, problem

Seconds = Annotated[Number, Field(ge=0, le=10_000)]
Lasting = Annotated[Number, Field(gt=0, le=10_000, description="How long it lasts, in seconds.")]
Force = Annotated[list[Annotated[Number, Field(ge=-1000, le=1000)]], Triple]


class MovedObject(Part):
    """An object is put elsewhere."""

    object: str
    by: Position = Field(default=[0.0, 0.0, 0.0], description="Shift in W, metres.")
    turn_deg: Angles = Field(default=[0.0, 0.0, 0.0], description="Turn about W's x, then y, then z, on the spot.")

    @model_validator(mode="after")
    def _is_put_elsewhere(self) -> "MovedObject":
        if not any(self.by) and not any(angle % 360.0 for angle in self.turn_deg):
            raise problem("", "nothing is moved, expected `by` or `turn_deg`")
        return self


class TakenObject(Part):
    """An object is taken away."""

    object: str


class BroughtObject(Part):
    """An object that isn't there is put down. One that is brought before it is taken isn't there at the start."""

    object: str
    pose: BodyPose | None = Field(default=None, description="Where; without: at its declared pose.")


class ShiftedRegion(Part):
    """A region is shifted with what lies in it."""

    region: str
    by: Position = Field(description="Shift in W, metres.")

    @model_validator(mode="after")
    def _is_put_elsewhere(self) -> "ShiftedRegion":
        if not any(self.by):
            raise problem("by", "shifts nothing, expected a length other than 0")
        return self


class Push(Part):
    """Someone pushes the arm."""

    force: Force = Field(description="In W, newtons.")
    seconds: Lasting
    link: str | None = Field(default=None, description="One of the robot's links; without: the tool centre.")

    @model_validator(mode="after")
    def _pushes(self) -> "Push":
        if not any(self.force):
            raise problem("force", "pushes nothing, expected a force other than 0")
        return self


class WeakGrip(Part):
    """The fingers lose force."""

    force: Annotated[Number, Field(ge=0, le=1000)] = Field(description="Newtons with which they press at most.")
    seconds: Lasting


class Disorder(Part):
    """A sensor errs, or the joints rub."""

    what: Disordered
    size: Annotated[Number, Field(gt=0, le=1000)] | None = Field(
        default=None, description="Of force-bias and force-noise in N, of delays in s, pose-noise in m, friction in Nm."
    )
    seconds: Lasting

    @model_validator(mode="after")
    def _has_a_size_where_one_is_needed(self) -> "Disorder":
        if self.what in SIZELESS and self.size is not None:
            raise problem("size", f"{self.what} has none, expected no size")
        if self.what not in SIZELESS and self.size is None:
            raise problem("", f"{self.what} has no size, expected `size`")
        return self


HAPPENINGS = ("move", "take", "bring", "shift", "push", "grip", "disorder", "goal")


class Entry(Part):
    """One disturbance."""

    at: Seconds | None = Field(default=None, description="Simulated seconds after the run's start.")
    phase: str | None = Field(default=None, description="Or: when a phase of this name begins.")
    action: str | None = Field(default=None, description="Only phases of this action (pick, place, wipe, drag …).")
    nth: Annotated[int, Field(ge=1, le=1000)] = Field(default=1, description="The how-manieth such phase.")
    after: Seconds = Field(default=0.0, description="Seconds after the phase began.")
    move: MovedObject | None = None
    take: TakenObject | None = None
    bring: BroughtObject | None = None
    shift: ShiftedRegion | None = None
    push: Push | None = None
    grip: WeakGrip | None = None
    disorder: Disorder | None = None
    goal: str | None = Field(default=None, description="What is wanted from then on, as the scene's `goal`.")

    @model_validator(mode="after")
    def _is_one_at_one_time(self) -> "Entry":
        given = [key for key in HAPPENINGS if getattr(self, key) is not None]
        if len(given) != 1:
            raise problem("", f"{len(given)} things happen, expected one of {', '.join(HAPPENINGS)}")
        if (self.at is None) == (self.phase is None):
            many = "neither is given" if self.at is None else "both are given"
            raise problem("", f"expected either `at` or `phase`, {many}")
        if self.at is not None and (self.action is not None or self.nth != 1 or self.after):
            raise problem("at", "stands alone; action, nth and after go with `phase`")
        return self
