"""The interface between the search-then-sample loop and the skills.

The loop knows no skill by name: it asks a `Refiner` to turn an action into motion in a scene, and
to predict the scene afterwards. What comes back is plain data: phases, each with a trajectory,
a control mode and the contacts it declares.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np

from planner.failure import RefinementFailure
from planner.motion.trajectory import Trajectory
from planner.task.symbols import GroundAction
from sim.scene import Held, SceneState

Pair = frozenset[str]
"""Two names that may touch: robot links, bodies, fixtures, regions or the table."""


def pairs(first: frozenset[str] | str, second: frozenset[str] | str) -> frozenset[Pair]:
    """Every pair of one name of `first` with one of `second`."""
    left = {first} if isinstance(first, str) else first
    right = {second} if isinstance(second, str) else second
    return frozenset(frozenset((a, b)) for a in left for b in right)


@dataclass(frozen=True)
class Press:
    """Contact force of a phase: `force` N along −z of W, with `stiffness` (6,) (N/m, Nm/rad; linear first, in W)
    in the directions that are not force-controlled, and so many times critical `damping`."""

    force: float
    stiffness: np.ndarray
    damping: float = 1.0


@dataclass(frozen=True)
class Phase:
    """One stretch of an action: what the arm and the fingers do, and which contacts that may make.

    kind "move": follow the trajectory in joint space. "approach": the same along a straight line
    near contact. "open" and "close": hold still and drive the fingers apart to `opening`, or together
    until an object resists. "touch": lower along the trajectory until contact with `press.force`.
    "slide": follow the trajectory pressed with `press`. `allowed` pairs may touch meanwhile.

    `held` and `opening` (m) are what the hand holds and how far it is open when the phase begins
    ("open": the opening it ends with). `grip` is the force in N with which each finger closes.
    """

    name: str
    kind: Literal["move", "approach", "open", "close", "touch", "slide"]
    trajectory: Trajectory
    opening: float
    held: Held | None = None
    allowed: frozenset[Pair] = frozenset()
    press: Press | None = None
    grip: float = 0.0


@dataclass(frozen=True)
class Refinement:
    """An action made concrete in one scene: the sample that was chosen and the motion that does it. `crashes`: errors
    met on the way, each as a phrase, that cost other samples."""

    action: GroundAction
    sample: Any
    phases: tuple[Phase, ...]
    crashes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Budget:
    """How much one refinement may cost: samples tried. is_widened: nothing was found with less, and what is only unwise
    may be tried, too."""

    tries: int = 20
    is_widened: bool = False

    def widened(self, factor: int = 2) -> "Budget":
        """The same budget, `factor` times as large."""
        return Budget(self.tries * factor, is_widened=True)


@dataclass(frozen=True)
class Hints:
    """Which samples to try first (what worked, or what was blocked by something now away) and which not again.

    `done` and `failed`: samples with which the primitive was carried out on the same object earlier in this run and
    came to its effect, or did not, wherever the object lay; the latest last.
    """

    first: tuple[Any, ...] = ()
    avoid: frozenset[Any] = frozenset()
    done: tuple[Any, ...] = ()
    failed: tuple[Any, ...] = ()


@dataclass
class Work:
    """Counts what planning costs, for simulated time: collision checks, IK calls, task expansions."""

    counts: dict[str, int] = field(default_factory=dict)

    def add(self, what: str, amount: int = 1) -> None:
        self.counts[what] = self.counts.get(what, 0) + amount


class Refiner(Protocol):
    """What the search-then-sample loop needs of a skill."""

    def refine(
        self, action: GroundAction, scene: SceneState, rng: np.random.Generator, budget: Budget, hints: Hints
    ) -> Refinement | RefinementFailure:
        """Find a sample and its motion in this scene, starting from scene.q."""
        ...

    def predict(self, scene: SceneState, refinement: Refinement) -> SceneState:
        """The scene after the refined action went as meant: everything that moves, moved."""
        ...


Refiners = Mapping[str, Refiner]
"""Refiner by action name."""
