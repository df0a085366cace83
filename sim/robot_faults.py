"""What goes wrong with the robot itself: joints that rub, fingers without force or grip, someone who pushes."""

from dataclasses import dataclass, replace

import numpy as np

from sim.bullet import BulletPlant
from sim.disturbance import Fault
from sim.plant import Command, GripCommand


@dataclass(frozen=True)
class JointFriction(Fault):
    """Coulomb friction in the arm's joints, in Nm: at rest it holds against as much, moving it brakes with as much.
    What rubs at the same time adds up."""

    torque: tuple[float, ...]

    def begin(self, plant: BulletPlant) -> None:
        plant.set_joint_friction(plant.joint_friction + self.torque)

    def act(self, plant: BulletPlant) -> None:
        """Nothing more while it lasts."""

    def cease(self, plant: BulletPlant) -> None:
        plant.set_joint_friction(np.maximum(plant.joint_friction - self.torque, 0.0))


@dataclass(frozen=True)
class Push(Fault):
    """A force (N, in W) on a link of the robot, at its centre of mass; None: at the tool centre."""

    force: tuple[float, float, float]
    link: str | None = None

    def begin(self, plant: BulletPlant) -> None:
        """A push is the same from its first step to its last."""

    def act(self, plant: BulletPlant) -> None:
        plant.push(np.array(self.force), self.link)

    def cease(self, plant: BulletPlant) -> None:
        """A push lasts for one step only: nothing is left to end."""


@dataclass(frozen=True)
class SlipperyPads(Fault):
    """The fingers' pads have another friction. What they let slip doesn't slide where it falls."""

    friction: float

    def begin(self, plant: BulletPlant) -> None:
        plant.set_pad_friction(self.friction)

    def act(self, plant: BulletPlant) -> None:
        """Nothing more while it lasts."""

    def cease(self, plant: BulletPlant) -> None:
        plant.set_pad_friction(None)


@dataclass(frozen=True)
class WeakGrip(Fault):
    """The fingers press with at most `force` N, whatever they are told."""

    force: float

    def alter(self, command: Command) -> Command:
        grip = command.grip
        return replace(command, grip=GripCommand(grip.speed, min(grip.force, self.force)))
