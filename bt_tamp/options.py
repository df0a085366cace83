"""What a person can choose about a run, apart from the scene."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

ContactMode = Literal["hybrid", "impedance"]
Preset = Literal["default", "paper"]


@dataclass(frozen=True)
class RunOptions:
    """Choices of one run. None means: whatever the preset or the part concerned takes by default.

    seed: noise of the scene and every random choice. contact: how contact motions are controlled.
    search: name of the task planner's search. tries: samples per action in a refinement.
    motion_planner: name of the motion planner. domain, problem: hand-written PDDL files (both or
    none). disturb: names of the classes of disturbances that befall it, one instance each. replan: watch, and plan
    again; else the first plan is carried out blindly, and a failure ends the run. max_sim_time: simulated seconds
    after which the run gives up. window: open PyBullet's window (only where there is a display).
    """

    seed: int = 0
    contact: ContactMode = "hybrid"
    preset: Preset = "default"
    search: str | None = None
    tries: int | None = None
    motion_planner: str | None = None
    domain: Path | None = None
    problem: Path | None = None
    disturb: tuple[str, ...] = ()
    replan: bool = True
    max_sim_time: float = 900.0
    window: bool = False

    def __post_init__(self) -> None:
        if (self.domain is None) != (self.problem is None):
            given, missing = ("--domain", "--problem") if self.problem is None else ("--problem", "--domain")
            raise ValueError(f"{given} without {missing}: give both PDDL files or none")
        if self.tries is not None and self.tries < 1:
            raise ValueError(f"--tries {self.tries}: expected a whole number of at least 1")
        if not 0 < self.max_sim_time < float("inf"):
            raise ValueError(f"--max-sim-time {self.max_sim_time:g}: expected a positive number of seconds")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: expected a whole number of at least 0")
