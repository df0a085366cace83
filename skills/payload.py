"""Mass, centre and inertia of what the hand holds, as the scene declares it."""

import numpy as np

from scenarios.shapes import inertia
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
