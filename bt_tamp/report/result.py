"""How a run ended, in figures: what `result.json` holds."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

Outcome = Literal["goal_reached", "planned", "proven_infeasible", "no_plan", "gave_up", "interrupted", "crashed"]

EXIT_CODES: Mapping[Outcome, int] = {
    "goal_reached": 0,
    "planned": 0,
    "proven_infeasible": 10,
    "no_plan": 11,
    "gave_up": 12,
    "interrupted": 130,
    "crashed": 1,
}
"""Exit code of the command line by outcome. Wrong input is 2; "crashed" is an error in our own code."""


@dataclass(frozen=True)
class UnintendedContact:
    """Two things that touched with more than 1 N though the running phase did not declare it.

    t: simulated seconds at which it began; force_n: its peak in N; action and phase: what ran then.
    """

    t: float
    first: str
    second: str
    force_n: float
    action: str
    phase: str


@dataclass(frozen=True)
class PressedMotion:
    """A stroke or a drag, and the engine's true normal force from 0.5 s after touchdown until it lifted, in N: mean,
    root mean square of its difference from the target, and peak."""

    action: str
    target_n: float
    mean_n: float
    rms_error_n: float
    peak_n: float


@dataclass(frozen=True)
class Befallen:
    """A disturbance: when (s), of which class ("declared" for the scene's own), what was done, in which phase; and what
    the run answered first (`refined_again`, `action_failed`, `replan`, `rebuilt`, or nothing), after how many s.

    action: what ran then, "" while planning. bodies: what it was done to. mattered: it changed a fact or a geometry
    that the rest of the run rests on. is_urgent: it concerned the running action. reacted_after_s: if so, and the
    action did answer, the seconds until the arm stood still or set out anew, thinking included. hidden_s: seconds after
    which sensors that err could show it; None for never.
    """

    t: float
    name: str
    sentence: str
    phase: str
    answer: str = ""
    answered_after_s: float | None = None
    action: str = ""
    bodies: tuple[str, ...] = ()
    mattered: bool = True
    is_urgent: bool = False
    reacted_after_s: float | None = None
    hidden_s: float | None = 0.0

    @property
    def reacted_s(self) -> float | None:
        """`reacted_after_s`, counted from when the sensors could show it; 0 for what was felt before it was seen."""
        if self.reacted_after_s is None:
            return None
        return max(0.0, self.reacted_after_s - (self.hidden_s or 0.0))


@dataclass(frozen=True)
class RunResult:
    """One run. Field names are the keys of `result.json`.

    goal: literal → does it hold at the end. plan: actions of the last plan; executed: actions that were done, in order,
    and executed_s: how long each took. disturbances: what befell it. learned: sentences. places: where each movable
    body that was ever there lies at the end (a region's name, "table", "hand", "floor", "elsewhere", or "nowhere" to be
    seen). reason: why it ended so, one sentence. planning_cpu_s counts all rounds and re-refinements, children
    included. robot_s is simulated, wall_s real time. peak_contact_force_n: what the controller felt along the normal;
    peak_force_n: the engine's true net force of any one thing on the arm and what it holds (what both fingers squeeze
    cancels out).
    unlawful_commands: those with a torque beyond its limit, or none at all (NaN). energy_j is ∫|τ·q̇|dt.
    reproducible: no wall-clock watchdog cut anything short.
    """

    scenario: str
    seed: int
    outcome: Outcome
    reason: str
    goal: Mapping[str, bool]
    plan: tuple[str, ...] = ()
    executed: tuple[str, ...] = ()
    executed_s: tuple[float, ...] = ()
    learned: tuple[str, ...] = ()
    places: Mapping[str, str] = field(default_factory=dict)
    rounds: int = 0
    replans: int = 0
    planning_cpu_s: float = 0.0
    planning_wall_s: float = 0.0
    robot_s: float = 0.0
    wall_s: float = 0.0
    peak_contact_force_n: float = 0.0
    peak_force_n: float = 0.0
    torque_limit_violations: int = 0
    unlawful_commands: int = 0
    unintended_contacts: tuple[UnintendedContact, ...] = ()
    pressed: tuple[PressedMotion, ...] = ()
    peak_rss_mb: float = 0.0
    energy_j: float = 0.0
    disturbances: tuple[Befallen, ...] = ()
    reproducible: bool = True

    @property
    def exit_code(self) -> int:
        return EXIT_CODES[self.outcome]

    def to_json(self) -> str:
        """The result as indented JSON text."""
        return json.dumps(asdict(self), indent=2, ensure_ascii=False) + "\n"

    @staticmethod
    def from_json(text: str) -> "RunResult":
        """Read what `to_json` wrote. Raises ValueError for anything else."""
        try:
            data: dict[str, Any] = json.loads(text)
            data["unintended_contacts"] = tuple(UnintendedContact(**c) for c in data["unintended_contacts"])
            data["pressed"] = tuple(PressedMotion(**motion) for motion in data["pressed"])
            data["disturbances"] = tuple(
                Befallen(**(one | {"bodies": tuple(one.get("bodies", ()))})) for one in data.get("disturbances", ())
            )
            for key in ("plan", "executed", "executed_s", "learned"):
                data[key] = tuple(data.get(key, ()))
            if data["outcome"] not in EXIT_CODES:
                raise ValueError(f"not a run's result: unknown outcome {data['outcome']!r}")
            return RunResult(**data)
        except (TypeError, KeyError, AttributeError) as error:
            raise ValueError(f"not a run's result: {error}") from None
