"""Bodies and the robot's model, as PyBullet takes them."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pinocchio as pin
import pybullet as p
import pybullet_data
from pinocchio import SE3

from scenarios.shapes import Cylinder, Shape
from sim.bullet_shapes import add_collision_shape, add_visual_shape, principal_axes
from sim.robot import RobotModel

Color = tuple[float, float, float, float]

ROTATION_DAMPING = 2.0
"""1/s at which a thing's turning dies away: without it a glass on its rim or a ball never come to rest. Bullet's own
rolling friction does it too, but doubles the cost of every contact."""

ROLLING_FRICTION = 1e-3
"""Metres, times the friction of what it lies on: a cylinder's resistance to rolling. Without it Bullet has one that
lies at rest roll off at 8 mm/s, with a tenth of it some still do."""

ASLEEP = 1e-6
"""(m/s)² plus (rad/s)² below which, for two seconds, a thing is left out of the sums until something touches it or what
it rests on moves: 1 mm/s. Bullet's own 0.05 would stop a ball that rolls at 0.2 m/s."""


def add_body(shape: Shape, X_WO: SE3, matter: tuple[float, float], color: Color, client: int) -> int:
    """The number of a new body at X_WO. matter: its mass in kg (0: it stands fast) and its friction."""
    mass, friction = matter
    axes = principal_axes(shape)
    pose = pin.SE3ToXYZQUAT(X_WO if axes is None else X_WO * axes[0])
    X_IO = [0.0] * 6 + [1.0] if axes is None else pin.SE3ToXYZQUAT(axes[0].inverse()).tolist()
    frame = {"visualFramePosition": X_IO[:3], "visualFrameOrientation": X_IO[3:]}
    body = p.createMultiBody(
        mass,
        add_collision_shape(shape, client),
        add_visual_shape(shape, client, rgbaColor=color, **frame),
        list(pose[:3]),
        list(pose[3:]),
        # Maximal coordinates cost less. What stands fast does the same in both, but of what moves a pushed cube
        # drifts aside by a tenth of its way and a pressed sponge rings by 5 % of the force.
        useMaximalCoordinates=mass == 0.0,
        physicsClientId=client,
    )
    if axes is not None:
        # PyBullet would put a margin of 1 mm around every hull.
        p.changeDynamics(
            body,
            -1,
            collisionMargin=0.0,
            localInertiaDiagonal=[mass * moment for moment in axes[1]],
            physicsClientId=client,
        )
    p.changeDynamics(
        body,
        -1,
        lateralFriction=friction,
        restitution=0.0,
        linearDamping=0.0,
        rollingFriction=ROLLING_FRICTION if isinstance(shape, Cylinder) else 0.0,
        angularDamping=ROTATION_DAMPING,
        activationState=p.ACTIVATION_STATE_ENABLE_SLEEPING,
        sleepThreshold=ASLEEP,
        physicsClientId=client,
    )
    return body


@contextmanager
def resolved_urdf(robot: RobotModel) -> Iterator[str]:
    """Path of a copy of the robot's URDF with `package://pybullet_data` replaced by where it is installed."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / robot.urdf.name
        path.write_text(robot.urdf.read_text().replace("package://pybullet_data", pybullet_data.getDataPath()))
        yield str(path)
