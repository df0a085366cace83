"""The robot's model: kinematics, dynamics, limits and solid geometry, from one URDF.

`RobotModel` is what everything above knows of the robot. It has seven joints (the fingers are
part of the hand, fixed half open for the dynamics) and stands at X_WB. Frames: W world, B base,
E flange (where the wrist sensor sits), G gripper (tool centre point, z out of the hand, y along
the fingers' motion). Spatial quantities are (linear, angular), Pinocchio's order.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from pathlib import Path

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from scenarios.shapes import Box, Convex, Cylinder, Sphere

GRAVITY = 9.81
"""Magnitude of gravity in m/s², along −z of W, in the models and in the simulated world."""

MODELS = {"iiwa14_wsg50": "iiwa14_wsg50.urdf"}
"""URDF file in `sim/assets` by model name."""


@dataclass(frozen=True)
class Gripper:
    """A parallel gripper. Lengths in metres, force in N per finger, speed in m/s of opening.

    `pad` is the full size of one finger along G's axes (x across, y thickness, z length);
    `body` that of the hand's body, whose end lies `pad[2]` behind the fingertips.
    """

    stroke: float
    max_force: float
    max_speed: float
    pad: tuple[float, float, float]
    body: tuple[float, float, float]
    pad_friction: float
    min_grasp_extent: float


WSG50 = Gripper(
    stroke=0.11,
    max_force=80.0,
    max_speed=0.42,
    pad=(0.02, 0.01, 0.1),
    body=(0.05, 0.146, 0.0725),
    pad_friction=1.2,
    min_grasp_extent=0.03,
)


@dataclass(frozen=True)
class LinkShape:
    """A solid part of the robot: shape, and its pose X_LS in the frame of `link`."""

    link: str
    shape: Convex
    X_LS: SE3


def urdf_path(model: str) -> Path:
    """The URDF file of a robot model. Raises KeyError naming the known models."""
    if model not in MODELS:
        raise KeyError(f"unknown robot model {model!r}, known: {', '.join(sorted(MODELS))}")
    return Path(str(files("sim") / "assets" / MODELS[model]))


class RobotModel:
    """Kinematics and dynamics of the arm with its hand, standing at X_WB.

    q_min, q_max (7,) rad; v_max (7,) rad/s; a_max (7,) rad/s²; tau_max (7,) Nm; tcp_speed_max m/s of the tool centre.
    """

    links = (*(f"link_{i}" for i in range(8)), "hand", "finger_left", "finger_right")
    hand_links = frozenset({"hand", "finger_left", "finger_right"})
    finger_links = frozenset({"finger_left", "finger_right"})

    def __init__(self, model: str = "iiwa14_wsg50", X_WB: SE3 | None = None) -> None:
        self.name = model
        self.X_WB = SE3.Identity() if X_WB is None else X_WB
        self.gripper = WSG50
        self.urdf = urdf_path(model)
        full = pin.buildModelFromUrdf(str(self.urdf))
        fingers = [full.getJointId(f"finger_{side}_slide") for side in ("left", "right")]
        half_open = pin.neutral(full)
        for joint in fingers:
            half_open[full.joints[joint].idx_q] = self.gripper.stroke / 4
        arm = pin.buildReducedModel(full, fingers, half_open)
        arm.jointPlacements[1] = self.X_WB * arm.jointPlacements[1]
        arm.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
        self.model = arm
        self.q_min = arm.lowerPositionLimit.copy()
        self.q_max = arm.upperPositionLimit.copy()
        self.v_max = arm.velocityLimit.copy()
        self.tau_max = arm.effortLimit.copy()
        self.a_max = np.array([6.0, 6.0, 8.0, 8.0, 10.0, 12.0, 12.0])
        self.tcp_speed_max = 2.5
        self.tcp_id = arm.getFrameId("tcp")
        self.flange_id = arm.getFrameId("hand")
        self._data = arm.createData()
        self._frame_ids = {link: arm.getFrameId(link) for link in self.links[1:]}

    def data(self) -> pin.Data:
        """A fresh Pinocchio workspace for `model`."""
        return self.model.createData()

    def X_WG(self, q: np.ndarray) -> SE3:
        """Pose of the gripper frame at configuration q (7,)."""
        pin.forwardKinematics(self.model, self._data, q)
        return SE3(pin.updateFramePlacement(self.model, self._data, self.tcp_id))

    def V_WG(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Velocity (6,) of the gripper frame's origin in W, linear before angular, at q (7,) and v (7,) in rad/s."""
        pin.forwardKinematics(self.model, self._data, q, v)
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return pin.getFrameVelocity(self.model, self._data, self.tcp_id, frame).vector.copy()

    def link_poses(self, q: np.ndarray, opening: float) -> dict[str, SE3]:
        """Poses X_WL of all links at q (7,), the fingers `opening` metres apart."""
        pin.framesForwardKinematics(self.model, self._data, q)
        poses = {link: SE3(self._data.oMf[i]) for link, i in self._frame_ids.items()}
        poses["link_0"] = self.X_WB
        mount = self._finger_mount
        for side, sign in (("left", 1.0), ("right", -1.0)):
            slide = SE3(np.eye(3), np.array([0.0, sign * opening / 2, 0.0]))
            poses[f"finger_{side}"] = poses["hand"] * mount * slide
        return poses

    @cached_property
    def shoulder(self) -> np.ndarray:
        """Centre (3,) of the shoulder in W, where the first two axes meet, in metres."""
        pin.framesForwardKinematics(self.model, self._data, np.zeros(7))
        return self._data.oMi[2].translation.copy()

    @cached_property
    def reach(self) -> float:
        """Greatest distance in metres of the gripper frame's origin from the shoulder: the arm stretched out."""
        return float(np.linalg.norm(self.X_WG(np.zeros(7)).translation - self.shoulder))

    @cached_property
    def X_EG(self) -> SE3:
        """Pose of the gripper frame in the flange frame."""
        return self.model.frames[self.flange_id].placement.actInv(self.model.frames[self.tcp_id].placement)

    @cached_property
    def _finger_mount(self) -> SE3:
        return SE3(np.eye(3), np.array([0.0, 0.0, self.gripper.body[2]]))

    @cached_property
    def geometry(self) -> tuple[LinkShape, ...]:
        """Every solid part, from the URDF's collision elements (the same that PyBullet loads)."""
        found = []
        for link in ET.parse(self.urdf).getroot().iter("link"):
            for element in link.iter("collision"):
                found.append(LinkShape(link.attrib["name"], _shape(element), _origin(element)))
        return tuple(found)

    def with_payload(self, mass: float, com_G: np.ndarray, inertia_G: np.ndarray) -> "RobotModel":
        """The same robot with a rigid load in the hand: mass in kg, centre (3,) in m and rotational
        inertia (3,3) in kg m² about that centre, in G."""
        loaded = RobotModel.__new__(RobotModel)
        loaded.__dict__.update(self.__dict__)
        loaded.model = pin.Model(self.model)
        frame = loaded.model.frames[self.tcp_id]
        load = pin.Inertia(mass, com_G, inertia_G)
        loaded.model.appendBodyToJoint(frame.parentJoint, load, frame.placement)
        loaded._data = loaded.model.createData()
        return loaded


def _floats(text: str) -> np.ndarray:
    return np.array([float(word) for word in text.split()])


def _origin(element: ET.Element) -> SE3:
    origin = element.find("origin")
    if origin is None:
        return SE3.Identity()
    rpy = _floats(origin.attrib.get("rpy", "0 0 0"))
    return SE3(pin.rpy.rpyToMatrix(rpy), _floats(origin.attrib.get("xyz", "0 0 0")))


def _shape(element: ET.Element) -> Convex:
    for geometry in element.iter("geometry"):
        for shape in geometry:
            match shape.tag:
                case "sphere":
                    return Sphere(float(shape.attrib["radius"]))
                case "box":
                    x, y, z = _floats(shape.attrib["size"])
                    return Box((float(x), float(y), float(z)))
                case "cylinder":
                    return Cylinder(float(shape.attrib["radius"]), float(shape.attrib["length"]))
    raise ValueError(f"collision element without a sphere, box or cylinder: {ET.tostring(element, 'unicode').strip()}")
