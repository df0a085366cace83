"""A world with one arm in which single actions are carried out, as the executive does it."""

from dataclasses import replace

import numpy as np
from pinocchio import SE3
from py_trees.common import Status
from py_trees.trees import BehaviourTree

from bt_tamp.executive.belief import Belief
from planner.failure import RefinementFailure
from planner.motion.motion_planner import MotionPlanner
from planner.refinement import Budget, Hints, Refinement
from planner.task.symbols import GroundAction
from scenarios.load import load_scenario
from scenarios.scenario import Scenario
from sim.bullet import BulletPlant
from sim.plant import Command
from sim.robot import RobotModel
from sim.scene import SceneState
from skills.catalogue import skills
from skills.context import ActionRun, GripDriver, SkillContext
from skills.control.controller import ArmController
from skills.skill import ContactSettings, Toolkit

TICKS_PER_TREE = 10
LIMIT = 40.0


def action(text: str) -> GroundAction:
    """`pick(cup, table)` as an action."""
    name, args = text.rstrip(")").split("(")
    return GroundAction(name, tuple(arg.strip() for arg in args.split(",")))


def scene_with(*names: str, scene: str = "fig1", seed: int = 0) -> Scenario:
    """A shipped scene with only some of its bodies."""
    scenario = load_scenario(scene, seed)
    return replace(scenario, bodies={name: scenario.bodies[name] for name in names})


def with_pose(scenario: Scenario, name: str, x: float, y: float, yaw: float = 0.0) -> Scenario:
    """The scenario with one body elsewhere on the same height, turned by yaw rad about z."""
    body = scenario.bodies[name]
    c, s = np.cos(yaw), np.sin(yaw)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    moved = replace(body, X_WO=SE3(R, np.array([x, y, body.X_WO.translation[2]])))
    return replace(scenario, bodies={**scenario.bodies, name: moved})


class Bench:
    """Carries out actions one after the other, each refined in the scene as it is observed."""

    def __init__(
        self,
        scenario: Scenario,
        contact: str = "hybrid",
        seed: int = 0,
        motion: type[MotionPlanner] = MotionPlanner,
    ) -> None:
        self.robot = RobotModel(scenario.robot.model, scenario.robot.X_WB)
        self.plant = BulletPlant(scenario, self.robot)
        self._belief = Belief(scenario, self.robot)
        settings = ContactSettings(mode=contact)
        self.motion = motion(self.robot, seed)
        self.skills = skills(Toolkit(self.robot, self.motion, settings))
        self._rng = np.random.default_rng(seed)
        observation = self.plant.observe()
        self.context = SkillContext(
            robot=self.robot,
            controller=ArmController(self.robot, period=2 * self.plant.timestep),
            grip=GripDriver(self.robot.gripper),
            observation=observation,
            scene=self._belief.update(observation, False),
            refine=lambda what: (self.refine(what), 0.0),
            contact_mode=contact,
        )
        self.latest: ActionRun | None = None
        self.peak_force = 0.0
        self.forces: dict[str, list[float]] = {}

    @property
    def scene(self) -> SceneState:
        return self.context.scene

    def belief_mass(self, name: str, mass: float) -> None:
        """Have everything above the plant believe that a body has another mass than it truly has."""
        bodies = self.plant.scenario.bodies
        self.believe(replace(self.plant.scenario, bodies={**bodies, name: replace(bodies[name], mass=mass)}))

    def believe(self, scenario: Scenario) -> None:
        """Have everything above the plant believe in another scene than there truly is."""
        self._belief = Belief(scenario, self.robot)
        self.context.scene = self._belief.update(self.context.observation, False)

    def refine(self, what: GroundAction) -> Refinement | RefinementFailure:
        return self.skills[what.name].refine(what, self.scene, self._rng, Budget(), Hints())

    def do(self, text: str) -> Status:
        """Carry out an action to its end; SUCCESS or FAILURE (then context.failure says why)."""
        what = action(text)
        self.latest = ActionRun(what)
        tree = BehaviourTree(self.skills[what.name].subtree(self.latest, self.context))
        start = self.context.observation.t
        while self.context.observation.t - start < LIMIT:
            tree.tick()
            if tree.root.status in (Status.SUCCESS, Status.FAILURE):
                return tree.root.status
            self.run(TICKS_PER_TREE)
        raise AssertionError(f"{text} took more than {LIMIT} s, at {tree.tip()}")

    def run(self, ticks: int) -> None:
        """Let so many control ticks pass."""
        for _ in range(ticks):
            observation = self.plant.observe()
            self.context.observation = observation
            tau = self.context.controller.update(observation)
            self.plant.apply(Command(tau, self.context.grip.command(observation)))
            self.plant.step()
            self.plant.step()
            force = self.context.controller.contact_force
            self.peak_force = max(self.peak_force, force)
            if self.context.phase is not None:
                self.forces.setdefault(self.context.phase.name, []).append(force)
        self.context.scene = self._belief.update(self.context.observation, self.context.grip.is_closing)
