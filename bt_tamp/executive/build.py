"""Wires the parts of a run together: the only place that knows them all."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bt_tamp.executive.agenda import Agenda
from bt_tamp.executive.belief import Belief
from bt_tamp.executive.mission import Mission, mission, planning
from bt_tamp.executive.plan_node import LiftOff, Planner, PlanNode
from bt_tamp.options import RunOptions
from planner.motion.motion_planner import MotionPlanner, MotionSettings
from planner.refinement import Work
from planner.search_then_sample import PlanSettings, SearchThenSample
from planner.task.facts import facts, goal_facts
from planner.task.pyperplan_ import PyperplanPlanner
from scenarios.scenario import Scenario
from sim.bullet import BulletPlant
from sim.robot import RobotModel
from skills.catalogue import domain_path, skills
from skills.context import GripDriver, SkillContext
from skills.control.controller import ArmController
from skills.skill import ContactSettings, Toolkit

CONTROL_EVERY = 2
"""Physics steps per control tick: 500 Hz."""

TREE_EVERY = 10
"""Control ticks per tick of the tree: 50 Hz."""

Report = Callable[..., None]


@dataclass
class Machine:
    """A wired run, ready to be stepped."""

    plant: BulletPlant
    robot: RobotModel
    belief: Belief
    context: SkillContext
    agenda: Agenda
    planner: Planner
    mission: Mission


def build(scenario: Scenario, options: RunOptions, report: Callable[..., None], tree_changed: Callable[[str], None]) -> Machine:
    """Everything that a run of `scenario` needs. `report(kind, **data)` takes events; `tree_changed(why)` is told of
    every rebuilt tree. Raises PddlError for hand-written PDDL that does not fit the scene."""
    robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
    search, motion = build_search(scenario, options, robot, report)
    contact = contact_settings(options)
    planner = Planner(search, options.seed)
    motion.work = planner.thinking.work
    goal = goal_facts(scenario.goal)

    plant = BulletPlant(scenario, robot, window=options.window)
    belief = Belief(scenario, robot)
    observation = plant.observe()
    scene = belief.update(observation, is_closing=False)
    context = SkillContext(
        robot=robot,
        controller=ArmController(robot, period=CONTROL_EVERY * plant.timestep),
        grip=GripDriver(robot.gripper),
        observation=observation,
        scene=scene,
        refine=lambda action: planner.refine(action, context.scene),
        contact_mode=contact.mode,
        report=report,
    )
    agenda = Agenda(goal, search.refiners, lambda state: facts(state, search.learned), tree_changed)
    lift = LiftOff(context, lambda q, height: motion.straight_up(q, height))
    tree = mission(agenda, context, planning(lift, PlanNode(planner, agenda, context)))
    return Machine(plant, robot, belief, context, agenda, planner, tree)


def contact_settings(options: RunOptions) -> ContactSettings:
    """How contact is made, by options and preset. "paper": section IV-D's stiffness and pre-wipe offsets."""
    if options.preset == "paper":
        return ContactSettings(
            mode=options.contact, stiffness=(100.0, 100.0, 10.0, 10.0, 10.0, 10.0), pre_wipe=(0.2, 0.2)
        )
    return ContactSettings(mode=options.contact)
