"""Going on from where another run ended: how things stand, and how a new run takes that up."""

from dataclasses import replace

import pinocchio as pin

from bt_tamp.executive.build import CONTROL_EVERY, Machine
from bt_tamp.executive.seams import Seams
from bt_tamp.report.state import RunState
from scenarios.goal import goal_text
from sim.bullet import BulletPlant
from sim.disturbance import DisturbedPlant
from sim.plant import Command
from skills.payload import load_of

TAKING_UP = 0.4
"""Seconds in which the arm holds and the fingers close on what they held."""


def state_of(machine: Machine) -> RunState:
    """How things stand now, in truth."""
    context, plant = machine.context, machine.plant
    seen = plant.truth() if isinstance(plant, DisturbedPlant) else plant.observe()
    held = context.scene.held
    return RunState(
        q=tuple(seen.q.tolist()),
        opening=float(seen.opening),
        held=held.name if held is not None else None,
        grip_n=context.grip.force,
        poses={name: tuple(pin.SE3ToXYZQUAT(X).tolist()) for name, X in seen.poses.items()},
        regions={name: tuple(pin.SE3ToXYZQUAT(X).tolist()) for name, X in seen.regions.items()},
        goal=goal_text((fact.predicate, fact.args) for fact in sorted(machine.agenda.order)),
        late=tuple(sorted(machine.agenda.unseen - seen.poses.keys())),
    )


def entering(start: RunState, seams: Seams) -> Seams:
    """The same seams, with a plant whose hand is as it was, and in which what was gone is not there."""

    def entered(plant: BulletPlant) -> BulletPlant | DisturbedPlant:
        for name in start.gone(plant.scenario):
            plant.take_away(name)
        plant.set_opening(start.opening)
        return seams.plant(plant)

    return replace(seams, plant=entered)


def take_up(machine: Machine, start: RunState) -> None:
    """Hold still, and close the fingers on what they held."""
    context, plant = machine.context, machine.plant
    machine.agenda.has_begun = True
    if start.held is None:
        context.grip.open_to(start.opening)
    else:
        context.grip.close(start.grip_n)
    for _ in range(round(TAKING_UP / (CONTROL_EVERY * plant.timestep))):
        context.observation = plant.observe()
        tau = context.controller.update(context.observation)
        plant.apply(Command(tau, context.grip.command(context.observation)))
        for _ in range(CONTROL_EVERY):
            plant.step()
    context.observation = plant.observe()
    context.scene = machine.belief.update(context.observation, context.grip.is_closing)
    if context.scene.held is not None:
        context.controller.set_payload(*load_of(context.scene, context.scene.held.name))
