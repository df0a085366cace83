"""Wires the parts of a run together: the only place that knows them all."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from bt_tamp.executive.agenda import Agenda
from bt_tamp.executive.belief import Belief
from bt_tamp.executive.mission import Mission, mission, planning
from bt_tamp.executive.plan_node import Planner, PlanNode
from bt_tamp.executive.seams import REAL, Seams
from bt_tamp.options import RunOptions
from planner.motion.clearance import MotionSettings
from planner.refinement import Work
from planner.search_then_sample import PlanSettings, SearchThenSample
from planner.task.facts import goal_facts
from planner.task.given import read_given
from planner.task.pddl_reader import read_domain, read_text
from planner.task.pyperplan_ import PyperplanPlanner
from planner.task.symbols import Fact
from scenarios.scenario import Scenario
from sim.bullet import BulletPlant
from sim.disturbance import DisturbedPlant
from sim.robot import RobotModel
from sim.scene import SceneState
from skills.catalogue import domain_path, skills
from skills.context import GripDriver, SkillContext
from skills.control.controller import ArmController
from skills.lift_off import LiftOff
from skills.skill import ContactSettings, Skill, Toolkit

CONTROL_EVERY = 2
"""Physics steps per control tick: 500 Hz."""

TREE_EVERY = 10
"""Control ticks per tick of the tree: 50 Hz."""


@dataclass
class Machine:
    """A wired run, ready to be stepped."""

    plant: BulletPlant | DisturbedPlant
    robot: RobotModel
    belief: Belief
    context: SkillContext
    agenda: Agenda
    planner: Planner
    mission: Mission


def build(
    scenario: Scenario,
    options: RunOptions,
    report: Callable[..., None],
    tree_changed: Callable[[str], None],
    seams: Seams = REAL,
) -> Machine:
    """Everything that a run of `scenario` needs. `report(kind, **data)` takes events; `tree_changed(why)` is told of
    every rebuilt tree; `seams`: what takes the place of the real parts. Raises PddlError for hand-written PDDL that
    does not fit the scene."""
    robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
    contact = contact_settings(options)
    thinker = build_planner(scenario, options, robot, report, seams)
    planner, goal = thinker.planner, thinker.goal

    plant = seams.plant(BulletPlant(scenario, robot, window=options.window))
    belief = Belief(scenario, robot)
    observation = plant.observe()
    context = SkillContext(
        robot=robot,
        controller=ArmController(robot, period=CONTROL_EVERY * plant.timestep, solver=seams.solver),
        grip=GripDriver(robot.gripper),
        observation=observation,
        scene=belief.update(observation, is_closing=False),
        refine=lambda action: planner.refine(action, context.scene, agenda.left[1:]),
        contact_mode=contact.mode,
        is_watchful=options.replan,
        report=report,
    )
    agenda = Agenda(
        goal,
        thinker.skills,
        planner.search.facts,
        tree_changed,
        planner.search.learn_success,
        scenario.late,
        options.replan,
    )
    tree = mission(agenda, context, planning(LiftOff(context), PlanNode(planner, agenda, context)))
    return Machine(plant, robot, belief, context, agenda, planner, tree)


@dataclass
class Thinker:
    """Everything that plans, with no world attached."""

    planner: Planner
    skills: Mapping[str, Skill]
    goal: frozenset[Fact]


def build_planner(
    scenario: Scenario,
    options: RunOptions,
    robot: RobotModel,
    report: Callable[..., None],
    seams: Seams = REAL,
) -> Thinker:
    """What plans for `scenario`. Raises PddlError for hand-written PDDL that does not fit, ValueError for options."""
    work = Work()
    motion = seams.motion(robot, options.seed, motion_settings(options), work)
    primitives = skills(Toolkit(robot, motion, contact_settings(options)))
    search = options.search or ("astar-hmax" if options.preset == "paper" else "auto")
    task_planner = seams.task_planner(PyperplanPlanner(search))
    settings = PlanSettings() if options.tries is None else PlanSettings(tries=options.tries)

    def tell(kind: str, data: Mapping[str, Any]) -> None:
        report(kind, **data)

    if options.domain is None or options.problem is None:
        domain, given, goal = read_domain(read_text(domain_path())), None, goal_facts(scenario.goal)
    else:
        start = SceneState.initial(scenario, robot.gripper.stroke)
        arities = {name: skill.arity for name, skill in primitives.items()}
        domain, given = read_given(options.domain, options.problem, arities, start)
        goal = given.problem.goal
    loop = SearchThenSample(task_planner, primitives, domain, settings, tell, given)
    return Thinker(Planner(loop, options.seed, work), primitives, goal)


def motion_settings(options: RunOptions) -> MotionSettings:
    """Which motion planner, by options and preset. "paper": RRT with goal bias 0.05, the best of five."""
    if options.motion_planner is not None:
        return MotionSettings(planner=options.motion_planner)
    if options.preset == "paper":
        return MotionSettings(planner="best-of-n-RRT", goal_bias=0.05, restarts=5)
    return MotionSettings()


def contact_settings(options: RunOptions) -> ContactSettings:
    """How contact is made, by options and preset. "paper": section IV-D's stiffness and pre-wipe offsets."""
    if options.preset == "paper":
        return ContactSettings(
            mode=options.contact, stiffness=(100.0, 100.0, 10.0, 10.0, 10.0, 10.0), pre_wipe=(0.2, 0.2)
        )
    return ContactSettings(mode=options.contact)
