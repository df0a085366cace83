"""A small laboratory: the arm on a bare table, straight motions, and pushes at the tool."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pinocchio as pin
import pytest
from pinocchio import SE3

from planner.motion.trajectory import Trajectory
from scenarios.scenario import Body, RobotPlacement, Scenario, Table
from scenarios.shapes import Box
from sim.bullet import BulletPlant
from sim.plant import Command, GripCommand, Observation
from sim.robot import RobotModel
from skills.control.controller import ArmController
from skills.control.reference import Reference

TABLE_TOP = 0.05
PERIOD = 0.002
IDLE = GripCommand(0.0, 80.0)
ACCELERATION = 0.4


class Rig:
    """A controller on a simulated arm, ticking in lock-step; nothing is teleported once it runs."""

    def __init__(self, robot: RobotModel, q0: np.ndarray, bodies: tuple[Body, ...], grip: GripCommand) -> None:
        table = Table((0.8, 1.2, 0.05), SE3(np.eye(3), np.array([0.62, 0.0, TABLE_TOP - 0.025])), 0.3)
        placement = RobotPlacement("iiwa14_wsg50", SE3.Identity(), q0)
        scenario = Scenario("bare", 0, placement, table, {}, {}, {body.name: body for body in bodies}, "")
        self.robot = robot
        self.plant = BulletPlant(scenario, robot)
        self.controller = ArmController(robot, PERIOD)
        self.grip = grip
        self.push: np.ndarray | None = None
        self.tau = np.zeros(7)

    def tick(self) -> Observation:
        observation = self.plant.observe()
        self.tau = self.controller.update(observation)
        self.plant.apply(Command(self.tau, self.grip))
        for _ in range(2):
            if self.push is not None:
                self.plant.push(self.push)
            self.plant.step()
        return observation

    def run(self, duration: float, watch: Callable[[Observation], object] = lambda _: None, every: int = 1) -> list:
        """Tick for `duration` seconds; what `watch` says at every so-many-th tick."""
        seen = []
        for tick in range(round(duration / PERIOD)):
            observation = self.tick()
            if tick % every == 0:
                seen.append(watch(observation))
        return seen

    def follow(
        self, reference: Reference, watch: Callable[[Observation], object] = lambda _: None, every: int = 1
    ) -> list:
        """Run until it is finished, at most a second longer than its trajectory."""
        self.controller.follow(reference)
        seen = []
        for _ in range(round((reference.trajectory.duration + 1.0) / (every * PERIOD))):
            seen += self.run(every * PERIOD, watch, every)
            if self.controller.finished:
                break
        return seen

    @property
    def q(self) -> np.ndarray:
        return self.plant.observe().q

    @property
    def position(self) -> np.ndarray:
        return self.robot.X_WG(self.q).translation

    def pressed_on_table(self, name: str) -> float:
        """True normal force in N between a body and the table."""
        return sum(c.normal_force for c in self.plant.contacts() if {c.first, c.second} == {name, "table"})

    def touching(self) -> set[tuple[str, str]]:
        """Pairs of what touches in truth."""
        return {(c.first, c.second) for c in self.plant.contacts()}


class Steps:
    """The largest change of a torque between two ticks that were watched, in Nm."""

    def __init__(self, rig: Rig) -> None:
        self._rig, self._last = rig, rig.tau.copy()
        self.largest = 0.0

    def __call__(self, _: Observation) -> None:
        self.largest = max(self.largest, float(np.abs(self._rig.tau - self._last).max()))
        self._last = self._rig.tau.copy()


class Lab:
    """Makes rigs, poses and trajectories."""

    home = np.radians([0.0, 20.0, 0.0, -80.0, 0.0, 80.0, 0.0])
    postures = (
        home,
        np.radians([30.0, 40.0, 10.0, -70.0, 20.0, 60.0, 40.0]),
        np.radians([-40.0, 10.0, -20.0, -100.0, -30.0, 70.0, 10.0]),
    )
    stiffness = np.array([1000.0, 1000.0, 500.0, 50.0, 50.0, 50.0])
    table_top = TABLE_TOP
    period = PERIOD

    def __init__(self) -> None:
        self.robot = RobotModel()
        self._rigs: list[Rig] = []

    def rig(self, q0: np.ndarray, bodies: tuple[Body, ...] = (), grip: GripCommand = IDLE) -> Rig:
        self._rigs.append(Rig(self.robot, q0, bodies, grip))
        return self._rigs[-1]

    @staticmethod
    def steps(rig: Rig) -> Steps:
        return Steps(rig)

    def close(self) -> None:
        for rig in self._rigs:
            rig.plant.close()

    @staticmethod
    def down(x: float, y: float, above_table: float) -> SE3:
        """The hand pointing down, fingers moving along y."""
        return SE3(np.diag([-1.0, 1.0, -1.0]), np.array([x, y, TABLE_TOP + above_table]))

    def ik(self, X_WG: SE3, q: np.ndarray) -> np.ndarray:
        data = self.robot.data()
        for _ in range(100):
            J = pin.computeFrameJacobian(self.robot.model, data, q, self.robot.tcp_id, pin.ReferenceFrame.LOCAL)
            error = pin.log6(self.robot.X_WG(q).actInv(X_WG)).vector
            if np.linalg.norm(error) < 1e-10:
                break
            q = q + J.T @ np.linalg.solve(J @ J.T, error)
        return q

    def straight(self, q: np.ndarray, displacement: Sequence[float], speed: float) -> Trajectory:
        """The tool from where q puts it along a straight `displacement` (3,), at `speed` m/s between the ends."""
        start = self.robot.X_WG(q)
        way = np.array(displacement)
        length = float(np.linalg.norm(way))
        easing = min(speed / ACCELERATION, float(np.sqrt(length / ACCELERATION)))
        duration = length / (ACCELERATION * easing) + easing
        times = np.linspace(0.0, duration, max(15, int(duration / 0.05)))
        data = self.robot.data()
        positions, velocities = [], []
        for t in times:
            rising, falling = min(t, easing), min(duration - t, easing)
            rate = ACCELERATION * min(rising, falling)
            done = ACCELERATION * easing * (t - easing / 2) if easing <= t <= duration - easing else 0.0
            if t < easing:
                done = ACCELERATION * t * t / 2
            elif t > duration - easing:
                done = length - ACCELERATION * (duration - t) ** 2 / 2
            q = self.ik(SE3(start.rotation, start.translation + way * done / length), q)
            J = pin.computeFrameJacobian(
                self.robot.model, data, q, self.robot.tcp_id, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            positions.append(q)
            velocities.append(np.linalg.pinv(J) @ np.concatenate([way * rate / length, np.zeros(3)]))
        return Trajectory(times, np.array(positions), np.array(velocities))

    def gripped_sponge(self, x: float, y: float, above_table: float, mass: float = 0.05) -> Rig:
        """A rig whose hand has closed on a sponge's ends, by friction, and holds it above the table, sensor tared."""
        turned = pin.rpy.rpyToMatrix(0.0, 0.0, np.pi / 2)
        sponge = Body(
            name="sponge",
            shape=Box((0.1, 0.06, 0.04)),
            mass=mass,
            friction=0.6,
            color=(1.0, 1.0, 0.0, 1.0),
            X_WO=SE3(turned, np.array([x, y, TABLE_TOP + 0.02])),
            tool="sponge",
            contact_stiffness=2000.0,
            contact_damping=20.0,
        )
        q0 = self.ik(self.down(x, y, 0.015), self.home)
        rig = self.rig(q0, (sponge,), GripCommand(-0.1, 40.0))
        rig.run(0.2)
        rig.controller.set_payload(mass, np.array([0.0, 0.0, -0.005]), mass * np.diag([1e-3, 3e-4, 1e-3]))
        rig.follow(Reference(self.straight(q0, [0.0, 0.0, above_table], 0.2)))
        rig.run(0.1)
        rig.controller.tare()
        return rig


@pytest.fixture(scope="module")
def lab() -> Iterator[Lab]:
    made = Lab()
    yield made
    made.close()


@pytest.fixture(scope="session")
def robot() -> RobotModel:
    return RobotModel()
