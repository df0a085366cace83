"""The tables of `bench tamp`: fig1, generated ones that can be cleared and ones that can't, and those that are run."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from scenarios.document import parse_document
from scenarios.generate import generate
from scenarios.load import build_scenario, load_scenario
from scenarios.scenario import Scenario
from scenarios.spoilers import KINDS

Part = Literal["fig1", "table", "larger", "unsolvable", "run"]

FIG1_SEEDS = range(20)
FIG1_OBJECTS = 4
SEEDS = range(100)
FEWEST, MOST = 4, 12
"""Objects of the tables that are planned with SEEDS."""

LARGER = (14, 16, 18, 20)
LARGER_SEEDS = range(100, 105)
UNSOLVABLE_SEEDS = range(10)
UNSOLVABLE_OBJECTS = 5
RUN_SEEDS = range(10)

CULPRITS = {
    "goal-too-small": "block_1",
    "crumb-behind-wall": "crumb_1",
    "out-of-reach": "box_far",
    "too-heavy": "block_1",
    "flat-blocked": "book_1",
}
"""By kind of unsolvable table: the one thing on it that can't be cleared."""


@dataclass(frozen=True)
class Case:
    """One table. part "run": it is not only planned but cleared. kind: of an unsolvable table, else None."""

    part: Part
    seed: int
    objects: int
    kind: str | None = None

    def scenario(self) -> Scenario:
        """The scene: fig1 with the seed's noise, or the generated table as it is written."""
        if self.part == "fig1":
            return load_scenario("fig1", self.seed)
        return build_scenario(parse_document(generate(self.seed, self.objects, self.kind), str(self)))

    def __str__(self) -> str:
        if self.part == "fig1":
            return f"fig1, seed {self.seed}"
        option = f" --unsolvable {self.kind}" if self.kind else ""
        return f"generate --seed {self.seed} --objects {self.objects}{option}"


def objects_of(seed: int) -> int:
    """How many objects the table of a seed gets: all numbers from FEWEST to MOST in turn."""
    return FEWEST + seed % (MOST - FEWEST + 1)


def cases(quick: bool) -> Iterator[Case]:
    """All of them, or a few of each part and kind."""
    for seed in FIG1_SEEDS[:3] if quick else FIG1_SEEDS:
        yield Case("fig1", seed, FIG1_OBJECTS)
    for seed in SEEDS[::20] if quick else SEEDS:
        yield Case("table", seed, objects_of(seed))
    for objects in LARGER[:1] if quick else LARGER:
        for seed in LARGER_SEEDS[:1] if quick else LARGER_SEEDS:
            yield Case("larger", seed, objects)
    for kind in KINDS:
        for seed in UNSOLVABLE_SEEDS[:1] if quick else UNSOLVABLE_SEEDS:
            yield Case("unsolvable", seed, UNSOLVABLE_OBJECTS, kind)
    for seed in RUN_SEEDS[:1] if quick else RUN_SEEDS:
        yield Case("run", seed, objects_of(seed))
