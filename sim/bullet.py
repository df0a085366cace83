"""A simulated world behind the `Plant` seam: PyBullet at 1 kHz.

The arm moves by joint torques alone and things are held by friction. A stiff spring and damper
couples the two fingers, as the gear does in the real gripper. Two frictions combine as their product.
"""

import math
import weakref
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pybullet as p
from numba import njit
from pinocchio import SE3

from scenarios.regions import parts
from scenarios.scenario import Scenario
from scenarios.shapes import Box, Shape
from sim.bullet_bodies import Color, add_body, resolved_urdf
from sim.bullet_shapes import principal_axes
from sim.contact import NORMAL_FORCE, Contact
from sim.converted import Converted, pose_of
from sim.plant import Command, GripCommand, Observation
from sim.robot import GRAVITY, RobotModel
from sim.scene import floor_height, pedestal
from sim.window import frame_scene
from sim.wrench import felt_at_joint

PHYSICS_STEP = 1e-3
"""Seconds a step: at 240 Hz a sponge held by friction turns in the hand."""

SOLVER_ITERATIONS = 50

CONTACT_BREAKING = 0.002
"""Metres after which a contact point is given up. With Bullet's own 0.02 stale points under the pads let a book
turn in the hand by 3° a second while everything stands still."""

PAD_RESISTANCE = 0.003
"""Metres, before it is multiplied by the friction of what is held: lever of the force with which the pads resist
turning on the spot, that of a round patch 9 mm across (two thirds of its radius). A point contact resists nothing, and
what is held would swing. PyBullet's wrist sensor leaves these torques out, some 0.1 Nm: forces are felt rightly, so a
load's mass is, but not where its centre lies."""

ARM_STIFFNESS, ARM_DAMPING = 5e4, 150.0
"""N/m and N s/m at each point of contact of the arm: rubber on the fingers, and what gears and links give behind every
contact (some 10 kNm/rad a joint). A rigid contact would stop a moving arm within one step, with a force that says more
about the step's length than about the arm."""

SEEN_EVERY = 10
"""Steps between two looks at the bodies: 100 Hz, a fast camera. Joints, fingers and wrist are sensed at each step."""

FLOOR_FRICTION = 0.8
FLOOR_SIZE = 40.0
"""Metres: what is thrown away comes to rest somewhere, too."""
GEAR_STIFFNESS = 2e4
"""N/m between the fingers' slides. PyBullet's own gear constraint (JOINT_GEAR) would be felt by the wrist
sensor as if it were an outside force: 13 N with the fingers pressed against their stops."""

GEAR_DAMPING = 40.0
"""N s/m: damps the 0.1 kg fingers well and is stable at 1 kHz."""


class BulletPlant:
    """A `Plant` for a scenario. Every quantity in SI units and in W unless said otherwise.

    `lap` is called with the name of each part of a step that has just been done.
    """

    def __init__(self, scenario: Scenario, robot: RobotModel, window: bool = False) -> None:
        self.scenario = scenario
        self.lap: Callable[[str], None] = _nobody
        self.timestep = PHYSICS_STEP
        self._t = 0.0
        self._unseen = SEEN_EVERY
        self._poses: Converted[SE3] | None = None
        self._velocities: Converted[np.ndarray] | None = None
        self._client = p.connect(p.GUI if window else p.DIRECT)
        # A plant that nobody closed keeps its engine, 10 MB and more, until the process ends.
        self._free = weakref.finalize(self, p.disconnect, self._client)
        self._free.atexit = False
        self._names: dict[tuple[int, int], str] = {}
        self._turned: dict[str, tuple[tuple[float, ...], SE3]] = {}
        self._shifted: dict[str, SE3] = {}
        p.setGravity(0, 0, -GRAVITY, physicsClientId=self._client)
        p.setPhysicsEngineParameter(
            fixedTimeStep=PHYSICS_STEP,
            numSolverIterations=SOLVER_ITERATIONS,
            deterministicOverlappingPairs=1,
            contactBreakingThreshold=CONTACT_BREAKING,
            physicsClientId=self._client,
        )
        self._add_room(scenario)
        self._bodies = {name: self._add_body(name) for name in scenario.bodies if name not in scenario.late}
        self._add_robot(scenario, robot)
        if window:
            frame_scene(scenario, self._client)

    def close(self) -> None:
        """Free the engine. The plant can't be used afterwards."""
        self._free()

    def observe(self) -> Observation:
        states = p.getJointStates(self._robot, self._joints, physicsClientId=self._client)
        q, v, reactions, drives = zip(*states, strict=True)
        self._slip = q[8] - q[7], v[8] - v[7]
        poses, velocities = self._look()
        return Observation(
            t=self._t,
            q=np.array(q[:7]),
            v=np.array(v[:7]),
            tau=self._tau,
            opening=q[7] + q[8],
            opening_velocity=v[7] + v[8],
            grip_force=(abs(drives[7]) + abs(drives[8])) / 2,
            wrist=felt_at_joint(reactions[-1], self._lever),
            poses=poses,
            velocities=velocities,
            regions=self._shifted,
        )

    def _look(self) -> tuple["Converted[SE3]", "Converted[np.ndarray]"]:
        if self._poses is not None and self._velocities is not None and self._unseen < SEEN_EVERY:
            return self._poses, self._velocities
        poses, velocities = {}, {}
        for name, body in self._bodies.items():
            position, quaternion = p.getBasePositionAndOrientation(body, physicsClientId=self._client)
            linear, angular = p.getBaseVelocity(body, physicsClientId=self._client)
            if name in self._turned:
                position, quaternion = p.multiplyTransforms(
                    position, quaternion, (0.0, 0.0, 0.0), self._turned[name][0]
                )
            poses[name] = position + quaternion
            velocities[name] = linear + angular
        self._unseen = 0
        self._poses = Converted(poses, pose_of, self._poses)
        self._velocities = Converted(velocities, np.array, self._velocities)
        return self._poses, self._velocities

    def apply(self, command: Command) -> None:
        tau = np.empty(7)
        if not _clip(command.tau, self._tau_max, tau):
            raise ValueError(f"torque command must be finite, got {command.tau}")
        self._tau, self._torques = tau, tau.tolist()
        speed = min(max(float(command.grip.speed), -self._max_grip_speed), self._max_grip_speed) / 2
        force = min(max(float(command.grip.force), 0.0), self._max_grip_force)
        if (speed, force) == self._grip:
            return
        self._grip = speed, force
        p.setJointMotorControlArray(
            self._robot,
            self._finger_joints,
            p.VELOCITY_CONTROL,
            targetVelocities=[speed, speed],
            forces=[force, force],
            physicsClientId=self._client,
        )

    def step(self) -> None:
        if self._slip is None:
            left, right = p.getJointStates(self._robot, self._finger_joints, physicsClientId=self._client)
            self._slip = right[0] - left[0], right[1] - left[1]
        gear = GEAR_STIFFNESS * self._slip[0] + GEAR_DAMPING * self._slip[1]
        # PyBullet forgets applied torques after each step.
        p.setJointMotorControlArray(
            self._robot,
            self._driven_joints,
            p.TORQUE_CONTROL,
            forces=[*self._torques, gear, -gear],
            physicsClientId=self._client,
        )
        self.lap("drive")
        p.stepSimulation(physicsClientId=self._client)
        self.lap("physics")
        self._slip = None
        self._t += PHYSICS_STEP
        self._unseen += 1

    def contacts(self) -> list[Contact]:
        """True contacts that carry force, for reports and benchmarks; the executive never reads them."""
        names = self._names
        return [
            Contact(names[point[1], point[3]], names[point[2], point[4]], point)
            for point in p.getContactPoints(physicsClientId=self._client)
            if point[NORMAL_FORCE] > 0.0
        ]

    def pressed(self, first: str, second: str) -> float:
        """True normal force in N between two things, for reports and benchmarks. Raises ValueError for a name that
        stands for no single body."""
        bodies = []
        for name in (first, second):
            found = [body for (body, _), known in self._names.items() if known == name]
            if len(found) != 1:
                raise ValueError(f"{len(found)} bodies are called {name!r}, expected one")
            bodies += found
        return sum(point[NORMAL_FORCE] for point in p.getContactPoints(*bodies, physicsClientId=self._client))

    def push(self, force: np.ndarray, link: str | None = None) -> None:
        """Apply a force (3,) in N, in W, during the next step: at the tool centre, or at the centre of mass of
        one of the robot's links. Raises ValueError for a link that the robot doesn't have."""
        index = self._tcp_link if link is None else self._link_index(link)
        state = p.getLinkState(self._robot, index, computeForwardKinematics=True, physicsClientId=self._client)
        p.applyExternalForce(self._robot, index, list(force), state[0], p.WORLD_FRAME, physicsClientId=self._client)

    def put(self, name: str, X_WO: SE3) -> None:
        """Put a body elsewhere, at rest: what a person's hand does, for disturbances. The executive never calls it."""
        turned = self._turned.get(name)
        pose = pin.SE3ToXYZQUAT(X_WO if turned is None else X_WO * turned[1])
        p.resetBasePositionAndOrientation(
            self._bodies[name], list(pose[:3]), list(pose[3:]), physicsClientId=self._client
        )
        p.resetBaseVelocity(self._bodies[name], [0.0] * 3, [0.0] * 3, physicsClientId=self._client)
        self._wake_all()

    def take_away(self, name: str) -> None:
        """Take a body out of the world, for disturbances."""
        body = self._bodies.pop(name)
        del self._names[body, -1]
        p.removeBody(body, physicsClientId=self._client)
        self._wake_all()

    def bring(self, name: str, X_WO: SE3) -> None:
        """Put a declared body that is not there into the world, at rest, for disturbances."""
        if name in self._bodies:
            raise ValueError(f"body {name!r} is there already")
        self._bodies[name] = self._add_body(name)
        self.put(name, X_WO)

    def shift_region(self, name: str, by: tuple[float, float, float]) -> None:
        """Shift a region in W (m) with what lies in it, for disturbances. Raises KeyError for an unknown one."""
        region = self.scenario.regions[name]
        X_WR = self._shifted.get(name, region.X_WR)
        half, shift = np.array(region.size) / 2, np.array(by)
        X_WO = dict(self._look()[0])
        inside = {self._bodies[body] for body, X in X_WO.items() if (np.abs(X_WR.actInv(X.translation)) < half).all()}
        for body in inside.union(body for (body, _), known in self._names.items() if known == name):
            position, quaternion = p.getBasePositionAndOrientation(body, physicsClientId=self._client)
            p.resetBasePositionAndOrientation(body, list(shift + position), quaternion, physicsClientId=self._client)
        self._shifted = {**self._shifted, name: SE3(X_WR.rotation, X_WR.translation + shift)}
        self._wake_all()

    def set_pad_friction(self, friction: float | None) -> None:
        """From now on the fingers' pads have this friction, for disturbances; None: their own."""
        for finger in self._finger_joints:
            friction = self._pad_friction if friction is None else friction
            p.changeDynamics(self._robot, finger, lateralFriction=friction, physicsClientId=self._client)

    def _wake_all(self) -> None:
        """The engine does not see that what rested on something that was moved lies on nothing now; nor do we yet."""
        self._unseen = SEEN_EVERY
        for body in self._bodies.values():
            p.changeDynamics(body, -1, activationState=p.ACTIVATION_STATE_WAKE_UP, physicsClientId=self._client)

    def set_joint_friction(self, torque: np.ndarray) -> None:
        """From now on the arm's joints rub with Coulomb friction of `torque` (7,) Nm: the engine's own joint motors
        hold the joints still with at most as much, so a joint sticks as well as slides."""
        self.joint_friction = np.array(torque, dtype=float)
        p.setJointMotorControlArray(
            self._robot,
            self._arm_joints,
            p.VELOCITY_CONTROL,
            targetVelocities=[0.0] * 7,
            forces=self.joint_friction.tolist(),
            physicsClientId=self._client,
        )

    def set_opening(self, opening: float) -> None:
        """Put the fingers `opening` metres apart at once: a run that goes on begins with what its hand was like."""
        for finger in self._finger_joints:
            p.resetJointState(self._robot, finger, opening / 2, physicsClientId=self._client)
        self._slip = None

    def scale_masses(self, factor: float) -> None:
        """Make every moving link of the robot `factor` times as heavy as its model says, inertia included."""
        for link in range(p.getNumJoints(self._robot, physicsClientId=self._client)):
            info = p.getDynamicsInfo(self._robot, link, physicsClientId=self._client)
            p.changeDynamics(
                self._robot,
                link,
                mass=factor * info[0],
                localInertiaDiagonal=[factor * i for i in info[2]],
                physicsClientId=self._client,
            )

    def _link_index(self, name: str) -> int:
        for index, known in self._link_names.items():
            if known == name and index >= 0:
                return index
        known = ", ".join(n for i, n in sorted(self._link_names.items()) if i >= 0)
        raise ValueError(f"no moving link {name!r}, known: {known}")

    def _add(self, name: str, shape: Shape, X_WO: SE3, friction: float, mass: float, color: Color) -> int:
        body = add_body(shape, X_WO, (mass, friction), color, self._client)
        self._names[body, -1] = name
        return body

    def _add_room(self, scenario: Scenario) -> None:
        floor = floor_height(scenario)
        self._add(
            "floor",
            Box((FLOOR_SIZE, FLOOR_SIZE, 0.1)),
            SE3(np.eye(3), np.array([0.0, 0.0, floor - 0.05])),
            FLOOR_FRICTION,
            0.0,
            (0.8, 0.8, 0.8, 1.0),
        )
        block = pedestal(scenario)
        if block is not None:
            self._add("pedestal", *block, FLOOR_FRICTION, 0.0, (0.4, 0.4, 0.4, 1.0))
        table = scenario.table
        self._add("table", table.shape, table.X_WT, table.friction, 0.0, (0.75, 0.6, 0.45, 1.0))
        for region in scenario.regions.values():
            color = (0.7, 0.2, 0.2, 1.0) if region.kind == "dustpan" else (0.5, 0.55, 0.6, 1.0)
            for shape, X_RP in parts(region):
                self._add(region.name, shape, region.X_WR * X_RP, region.friction, 0.0, color)
        for fixture in scenario.fixtures.values():
            self._add(fixture.name, fixture.shape, fixture.X_WO, fixture.friction, 0.0, fixture.color)

    def _add_body(self, name: str) -> int:
        body = self.scenario.bodies[name]
        axes = principal_axes(body.shape)
        if axes is not None:
            X_OI, _ = axes
            self._turned[name] = tuple(pin.SE3ToXYZQUAT(X_OI.inverse())[3:].tolist()), X_OI
        identity = self._add(name, body.shape, body.X_WO, body.friction, body.mass, body.color)
        if body.contact_stiffness is not None and body.contact_damping is not None:
            p.changeDynamics(
                identity,
                -1,
                contactStiffness=body.contact_stiffness,
                contactDamping=body.contact_damping,
                physicsClientId=self._client,
            )
        return identity

    def _add_robot(self, scenario: Scenario, robot: RobotModel) -> None:
        pose = pin.SE3ToXYZQUAT(scenario.robot.X_WB)
        with resolved_urdf(robot) as path:
            self._robot = p.loadURDF(
                path,
                list(pose[:3]),
                list(pose[3:]),
                useFixedBase=True,
                flags=p.URDF_USE_INERTIA_FROM_FILE,
                physicsClientId=self._client,
            )
        joints = range(p.getNumJoints(self._robot, physicsClientId=self._client))
        info = [p.getJointInfo(self._robot, j, physicsClientId=self._client) for j in joints]
        index = {entry[1].decode(): entry[0] for entry in info}
        self._link_names = {-1: "link_0"} | {entry[0]: entry[12].decode() for entry in info}
        self._names |= {(self._robot, link): name for link, name in self._link_names.items()}
        self._arm_joints = [index[f"joint_{i}"] for i in range(1, 8)]
        self._finger_joints = [index["finger_left_slide"], index["finger_right_slide"]]
        self._sensor_joint = index["wrist_sensor"]
        self._driven_joints = [*self._arm_joints, *self._finger_joints]
        self._joints = [*self._driven_joints, self._sensor_joint]
        self._tcp_link = index["tcp_mount"]
        hand = p.getDynamicsInfo(self._robot, self._sensor_joint, physicsClientId=self._client)
        self._lever = hand[3]
        self._tau = np.zeros(7)
        # By how much the right finger is further out than the left, m, and moves faster, m/s; None until read.
        self._slip: tuple[float, float] | None = None
        self._grip: tuple[float, float] | None = None
        self._tau_max = robot.tau_max
        self._pad_friction = robot.gripper.pad_friction
        self._max_grip_force = robot.gripper.max_force
        self._max_grip_speed = robot.gripper.max_speed

        for link in self._link_names:
            p.changeDynamics(
                self._robot,
                link,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                contactStiffness=ARM_STIFFNESS,
                contactDamping=ARM_DAMPING,
                physicsClientId=self._client,
            )
        self.set_pad_friction(None)
        for finger in self._finger_joints:
            p.changeDynamics(self._robot, finger, spinningFriction=PAD_RESISTANCE, physicsClientId=self._client)
        self.set_joint_friction(np.zeros(7))
        for joint, angle in zip(self._arm_joints, scenario.robot.q0, strict=True):
            p.resetJointState(self._robot, joint, float(angle), physicsClientId=self._client)
        for finger in self._finger_joints:
            p.resetJointState(self._robot, finger, robot.gripper.stroke / 2, physicsClientId=self._client)
        p.enableJointForceTorqueSensor(self._robot, self._sensor_joint, True, physicsClientId=self._client)
        self.apply(Command(np.zeros(7), GripCommand(0.0, robot.gripper.max_force)))


def _nobody(part: str) -> None:
    """Takes no times."""


@njit(cache=True)
def _clip(values: np.ndarray, most: np.ndarray, clipped: np.ndarray) -> bool:
    """Fill in the values, none beyond ±most. Are all finite?"""
    total = 0.0
    for i in range(len(values)):
        total += values[i]
        clipped[i] = min(max(values[i], -most[i]), most[i])
    return math.isfinite(total)
