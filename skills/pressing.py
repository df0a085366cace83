"""How a stroke or a drag presses and how fast it goes: part of its sample, so that others are tried when one fails."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.refinement import Hints, Press


@dataclass(frozen=True)
class Pressing:
    """force: N normal to the surface. speed: m/s along it. stiffness (6,): N/m and Nm/rad in W, linear first, in the
    directions that are not force-controlled; damping: ratio, 1 is critical."""

    force: float
    speed: float
    stiffness: tuple[float, ...]
    damping: float = 1.0

    def varied(
        self, force: float = 1.0, speed: float = 1.0, stiffness: float = 1.0, damping: float = 1.0
    ) -> "Pressing":
        """The same with each quantity multiplied by a factor."""
        return Pressing(
            self.force * force, self.speed * speed, tuple(k * stiffness for k in self.stiffness), self.damping * damping
        )

    @property
    def press(self) -> Press:
        """What the controller is told."""
        return Press(self.force, np.array(self.stiffness), self.damping)


def in_order(variants: Sequence[Pressing], hints: Hints) -> list[Pressing]:
    """The variants, those first that brought this object to its effect in this run, those last that failed with it.

    The samples in `hints` are the skill's own, each with its `pressing`.
    """
    done = [sample.pressing for sample in hints.done]
    failed = [sample.pressing for sample in hints.failed]
    return sorted(variants, key=lambda one: (failed.count(one), -done.count(one)))
