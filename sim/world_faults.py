"""What happens to the world: things are moved, taken away and brought, bins are shifted.

Each happens once, before the first step at or after its start.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from pinocchio import SE3

from sim.bullet import BulletPlant
from sim.disturbance import Fault


@dataclass(frozen=True)
class _Deed(Fault, ABC):
    """Done once; nothing is left to end."""

    @abstractmethod
    def begin(self, plant: BulletPlant) -> None:
        """Do it."""

    def act(self, plant: BulletPlant) -> None:
        """Nothing more: the deed is done."""

    def cease(self, plant: BulletPlant) -> None:
        """Nothing to end: what is done stays done."""


@dataclass(frozen=True)
class Moved(_Deed):
    """A body is put elsewhere, at rest."""

    name: str
    X_WO: SE3

    def begin(self, plant: BulletPlant) -> None:
        plant.put(self.name, self.X_WO)


@dataclass(frozen=True)
class TakenAway(_Deed):
    """A body is taken out of the world."""

    name: str

    def begin(self, plant: BulletPlant) -> None:
        plant.take_away(self.name)


@dataclass(frozen=True)
class Brought(_Deed):
    """A body that wasn't there is put down, at rest."""

    name: str
    X_WO: SE3

    def begin(self, plant: BulletPlant) -> None:
        plant.bring(self.name, self.X_WO)


@dataclass(frozen=True)
class BinShifted(_Deed):
    """A region is shifted in W (m) with all that lies in it."""

    region: str
    by: tuple[float, float, float]

    def begin(self, plant: BulletPlant) -> None:
        plant.shift_region(self.region, self.by)
