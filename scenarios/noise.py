"""Noise on start poses: reproducible, and each object's own.

Every object draws from its own random stream, named by seed and object, so that adding an object
changes no other's draw unless they would overlap.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pinocchio import SE3

from scenarios.scenario import Body
from scenarios.solids import Solid, body_solid
from scenarios.standing import standing_problem

MAX_DRAWS = 200
"""Draws for one object before the noise is declared impossible."""


@dataclass(frozen=True)
class PoseNoise:
    """Uniform on ±xy in W's x and y (metres) and ±yaw about W's z through the body's origin (rad)."""

    xy: float
    yaw: float


class NoFreePose(Exception):
    """No draw of `name` found a place; the message says why the last one failed."""

    def __init__(self, name: str, problem: str) -> None:
        self.name = name
        super().__init__(problem)


def stream(seed: int, name: str) -> np.random.Generator:
    """The random stream of one object in one run, the same on every machine."""
    digest = hashlib.sha256(name.encode()).digest()
    return np.random.default_rng([seed, int.from_bytes(digest[:8], "little")])


def perturbed(X_WO: SE3, noise: PoseNoise, rng: np.random.Generator) -> SE3:
    """One draw around X_WO. Uses three numbers of the stream, whatever the noise."""
    dx, dy, turn = rng.uniform(-1.0, 1.0, 3) * (noise.xy, noise.xy, noise.yaw)
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return SE3(R @ X_WO.rotation, X_WO.translation + np.array([dx, dy, 0.0]))


def draw_poses(
    bodies: Mapping[str, Body], noises: Mapping[str, PoseNoise], fixed: Sequence[Solid], seed: int
) -> dict[str, SE3]:
    """Poses X_WO of all bodies, drawn around their declared ones until nothing overlaps, floats or falls.

    `fixed` is what never moves. Lower bodies are drawn first, so that what stands on another finds
    it in place. Raises NoFreePose after MAX_DRAWS draws of one body.
    """
    poses = {name: body.X_WO for name, body in bodies.items() if name not in noises}
    around = [*fixed, *(body_solid(bodies[name]) for name in poses)]
    for name in sorted(noises, key=lambda name: (round(float(bodies[name].X_WO.translation[2]), 3), name)):
        poses[name] = _draw(bodies[name], noises[name], around, stream(seed, name))
        around.append(body_solid(bodies[name], poses[name]))
    for name in sorted(bodies.keys() - noises.keys()):
        problem = standing_problem(body_solid(bodies[name]), [solid for solid in around if solid.name != name])
        if problem is not None:
            raise NoFreePose(name, f"with the noise of what carries it, it {problem}")
    return {name: poses[name] for name in bodies}


def _draw(body: Body, noise: PoseNoise, around: Sequence[Solid], rng: np.random.Generator) -> SE3:
    problem = None
    for _ in range(MAX_DRAWS):
        X_WO = perturbed(body.X_WO, noise, rng)
        problem = standing_problem(body_solid(body, X_WO), around)
        if problem is None:
            return X_WO
    raise NoFreePose(body.name, f"{MAX_DRAWS} draws found no free place, the last one {problem}")
