"""Mass, centre and inertia of what the hand holds, as the scene declares it."""

import numpy as np

from scenarios.shapes import Box, Cylinder, Shape, Sphere
from sim.scene import SceneState


def load_of(scene: SceneState, name: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass in kg, centre of mass (3,) in m and inertia (3,3) in kg m² about it, in G, of the held body.

    Raises ValueError when the body is not held.
    """
    if scene.held is None or scene.held.name != name:
        raise ValueError(f"{name!r} is not held, held: {scene.held.name if scene.held else 'nothing'}")
    body = scene.scenario.bodies[name]
    R_GO = scene.held.X_GO.rotation
    return body.mass, np.array(scene.held.X_GO.translation), R_GO @ inertia(body.shape, body.mass) @ R_GO.T


def inertia(shape: Shape, mass: float) -> np.ndarray:
    """Rotational inertia (3,3) in kg m² of a homogeneous body about its centre, in its own axes."""
    match shape:
        case Box((x, y, z)):
            return mass / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])
        case Cylinder(r, h):
            side = mass * (3 * r * r + h * h) / 12
            return np.diag([side, side, mass * r * r / 2])
        case Sphere(r):
            return 0.4 * mass * r * r * np.eye(3)
