"""The flat tables in which the compiled collision tests take solids: what stands in which column."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

BOX = 0
CYLINDER = 1
SPHERE = 2
HULL = 3

# Columns of a table of solids. A hull lies about the middle of its bounding box; FIRST, COUNT and FACES are the row of
# its first corner in a table of corners (n,3), the number of corners, and that of faces, whose normals follow there.
KIND, PART, BOUND, HALF, PLACE = 0, 1, 2, 3, 6
FIRST, COUNT, FACES = 18, 19, 20
SOLID_COLUMNS = 21
# Columns of a table of obstacles: as above, then the world bounds.
LOWER, UPPER = 21, 24
OBSTACLE_COLUMNS = 27

RIDERS = 8
"""What rides on link 7 comes after links 0 to 7."""


class ArmArrays(NamedTuple):
    """The robot as tables.

    joints (7,12): placement of each joint (revolute about z) in the previous link. base (12,): placement
    of link 0 in W. limits (2,7): lowest and highest position.
    spheres (n,4): centre in the link's frame and radius; link i has rows first[i]:first[i+1].
    covers (8,4): a sphere around each link's spheres. solids (m,SOLID_COLUMNS): hand, fingers and held body in
    link 7, with their corners (h,3). probes (k,4): points in link 7 whose travel along an edge is bounded, as
    spheres without radius. turning (7,9): metres by which any point of links 0 to 7, or (last) of what rides on link 7,
    can be away from the axis of each joint, 0 if the joint doesn't move it.
    """

    joints: np.ndarray
    base: np.ndarray
    limits: np.ndarray
    spheres: np.ndarray
    first: np.ndarray
    covers: np.ndarray
    solids: np.ndarray
    corners: np.ndarray
    probes: np.ndarray
    turning: np.ndarray


class SceneArrays(NamedTuple):
    """What the robot may hit.

    obstacles (n,OBSTACLE_COLUMNS) in W with their corners (h,3). margins (parts,n): least distance of robot part and
    obstacle, −inf: not checked. link_pairs (k,3), solid_pairs (l,3): (link, link, margin) and (solid, link, margin)
    of the robot itself. bounds (6,n): world bounds of the obstacles, lowest and highest, once more.
    """

    obstacles: np.ndarray
    corners: np.ndarray
    margins: np.ndarray
    link_pairs: np.ndarray
    solid_pairs: np.ndarray
    bounds: np.ndarray


class Packed(NamedTuple):
    """Tables one after the other: their shapes, and all their numbers."""

    shapes: list[tuple[int, int]]
    numbers: np.ndarray


def flat(tables: Iterable[np.ndarray]) -> Packed:
    """Tables (one row for what has one dimension) one after the other."""
    tables = [np.atleast_2d(table) for table in tables]
    return Packed([(len(table), table.shape[1]) for table in tables], np.concatenate([t.ravel() for t in tables]))


def pack(arm: Packed, scene: SceneArrays) -> np.ndarray:
    """All tables in one array: first for each where it begins, its rows and its columns, then their numbers."""
    world = flat(scene)
    shapes = [*arm.shapes, *world.shapes]
    header, start = [], 3.0 * len(shapes)
    for rows, columns in shapes:
        header += [start, rows, columns]
        start += rows * columns
    return np.concatenate([header, arm.numbers, world.numbers])
