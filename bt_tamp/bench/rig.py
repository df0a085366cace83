"""The arm, its controller and a true world in lock-step, and the lines that a slide consists of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pinocchio import SE3

from bt_tamp.bench.scene import SPONGE, STROKE, STROKE_X, TABLE_TOP, Truth, believed, true_scene
from bt_tamp.bench.stopwatch import Stopwatch
from planner.motion.motion_planner import MotionPlanner
from planner.motion.timing import time_line
from planner.motion.trajectory import Trajectory
from scenarios.shapes import inertia
from sim.bullet import BulletPlant
from sim.disturbance import DisturbedPlant, Fault
from sim.plant import Command, GripCommand, Observation
from sim.robot import RobotModel
from skills.control.controller import ArmController
from skills.control.reference import Reference

CONTROL_EVERY = 2
CLEARANCE = 0.02
"""Metres between the sponge and the table believed in, from where it is lowered."""

SEARCH = 0.015
"""Metres that it is lowered beyond the table believed in, should the true one lie lower."""

LOWERING = 0.03
FREE = 0.15
"""Metres per second on the way to the table, and in the air."""

GRASP_HEIGHT = 0.022
"""Metres of the fingertips above the sponge's underside."""


@dataclass(frozen=True)
class Lines:
    """Motions through the poses of a slide: up from the grasp, down to the table, along it, and up again."""

    grasp: np.ndarray
    lift: Trajectory
    lower: Trajectory
    slide: Trajectory


def plan_lines(robot: RobotModel, speed: float, sponge_higher: float = 0.0) -> Lines:
    """The slide of STROKE metres at `speed` m/s, on the table believed in, by a sponge that is seen to lie so many
    metres higher than believed. Raises ValueError if the arm can't."""
    down = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])

    def pose(y: float, height: float) -> SE3:
        return SE3(down, np.array([STROKE_X, y, TABLE_TOP + height]))

    start, end = -STROKE / 2, STROKE / 2
    bottom = GRASP_HEIGHT - SEARCH
    ways = (
        [pose(start, GRASP_HEIGHT), pose(start, GRASP_HEIGHT + sponge_higher)],
        [pose(start, GRASP_HEIGHT + sponge_higher), pose(start, GRASP_HEIGHT + CLEARANCE)],
        [pose(start, GRASP_HEIGHT + CLEARANCE), pose(start, bottom)],
        [pose(start, GRASP_HEIGHT), pose(end, GRASP_HEIGHT)],
    )
    motion = MotionPlanner(robot, 0)
    along = next(iter(motion.lines(ways[-1])), None)
    if along is None:
        raise ValueError(f"the arm can't follow a stroke of {STROKE} m at x {STROKE_X} m")
    found = [along[:1]]
    for way in ways[:-1]:
        line = motion.line_from(found[-1][-1], way)
        if line is None:
            raise ValueError(f"the arm can't be lowered to the table at x {STROKE_X} m")
        found.append(line)
    _, to_grasp, lift, lower = found
    return Lines(
        grasp=to_grasp[-1],
        lift=time_line(robot, lift, FREE),
        lower=time_line(robot, lower, LOWERING),
        slide=time_line(robot, along, speed),
    )


@dataclass
class Rig:
    """A controller that believes in the declared scene, on a world that is as `truth` and `faults` make it. The
    hand begins open around the sponge."""

    lines: Lines
    grip_force: float
    truth: Truth
    faults: Sequence[Fault]
    law: Callable[[Observation], np.ndarray] = field(init=False)

    def __post_init__(self) -> None:
        self.robot = RobotModel()
        scene = believed()
        self.scene = replace(scene, robot=replace(scene.robot, q0=self.lines.grasp))
        self.world = BulletPlant(true_scene(self.scene, self.truth), self.robot)
        if self.truth.masses != 1.0:
            self.world.scale_masses(self.truth.masses)
        self.plant = DisturbedPlant(self.world, self.faults)
        self.controller = ArmController(self.robot, CONTROL_EVERY * self.plant.timestep)
        self._stopwatch = Stopwatch()
        self.controller.lap = self._stopwatch.lap
        self.period = CONTROL_EVERY * self.plant.timestep
        self.law = self.controller.update
        self.grip = GripCommand(0.05, 80.0)
        self.watch: Callable[[Observation], None] = lambda _: None

    def tick(self) -> Observation:
        """One control period."""
        observation = self.plant.observe()
        self.plant.apply(Command(self.law(observation), self.grip))
        for _ in range(CONTROL_EVERY):
            self.plant.step()
        self.watch(observation)
        return observation

    def run(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds / self.period)):
            self.tick()

    def follow(self, reference: Reference, overtime: float = 1.0) -> bool:
        """Follow until it is finished. False when it isn't in time, or when the controller gives up."""
        self.controller.follow(reference)
        for _ in range(round((2.0 * reference.trajectory.duration + overtime) / self.period)):
            self.tick()
            if self.controller.finished:
                return True
            if self.controller.reference is None:
                return False
        return False

    def grasp_sponge(self) -> None:
        """Close on the sponge, take its believed load into the model, lift it and tare the sensor."""
        self.grip = GripCommand(-0.08, self.grip_force)
        self.run(0.5)
        seen = self.plant.observe()
        X_GO = self.robot.X_WG(seen.q).actInv(seen.poses[SPONGE])
        body = self.scene.bodies[SPONGE]
        turned = X_GO.rotation @ inertia(body.shape, body.mass) @ X_GO.rotation.T
        self.controller.set_payload(body.mass, np.array(X_GO.translation), turned)
        self.follow(Reference(self.lines.lift))
        self.run(0.2)
        self.controller.tare()

    def true_pose(self) -> SE3:
        """Where the tool truly is."""
        return self.robot.X_WG(self.world.observe().q)

    def grip_pose(self) -> SE3:
        """Where the sponge truly is in the hand, X_GO."""
        return self.true_pose().actInv(self.world.observe().poses[SPONGE])

    def true_force(self) -> float:
        """The true normal force in N between sponge and table."""
        return self.world.pressed(SPONGE, "table")

    def qp_us(self) -> float:
        """Median time in microseconds to build and solve a QP."""
        return self._stopwatch.median("QP build") + self._stopwatch.median("solve")

    def close(self) -> None:
        """Free the engine."""
        self.world.close()
