"""Mesh files: the points of a convex mesh in a Wavefront .obj file."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from scenarios.hulls import ShapeError, polyhedron

MAX_BYTES = 2_000_000
MAX_POINTS = 10_000

HOLLOW = 0.01
"""Share of the largest extent by which a vertex may lie inside the hull of a mesh that still counts as convex."""


def read_points(file: str, folder: Path | None) -> np.ndarray:
    """The vertices (n,3) of a mesh file, in its own frame.

    Raises ShapeError, which names the file, if it lies outside `folder`, can't be read or isn't convex.
    """
    points, faces = _contents(_text(file, folder), file)
    try:
        solid = polyhedron(points)
    except ShapeError as error:
        raise ShapeError(f"{file}: {error}") from None
    depth = -min(solid.outside(p) for p in (*points, *_within_faces(points, faces)))
    if depth > HOLLOW * float(np.ptp(points, axis=0).max()):
        raise ShapeError(
            f"{file}: is not convex (its surface lies up to {depth * 1000:.3g} mm inside the convex hull), "
            "expected a convex mesh, or a compound of several"
        )
    return points


def _text(file: str, folder: Path | None) -> str:
    if folder is None:
        raise ShapeError(f"{file}: this scene has no folder, expected vertices instead of a file")
    try:
        path = (folder / file).resolve()
        if not path.is_relative_to(folder.resolve()):
            raise ShapeError(f"{file}: lies outside the scene file's folder, expected it there or below")
        if path.suffix.lower() != ".obj":
            raise ShapeError(f"{file}: expected a Wavefront .obj file")
        if not path.is_file():
            raise ShapeError(f"{file}: no such file in the scene file's folder, expected a mesh")
        if path.stat().st_size > MAX_BYTES:
            raise ShapeError(f"{file}: is {path.stat().st_size} bytes, expected at most {MAX_BYTES}")
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise ShapeError(f"{file}: is not text, expected a Wavefront .obj file") from None
    except (OSError, ValueError) as error:
        if isinstance(error, ShapeError):
            raise
        raise ShapeError(f"{file}: can't be read ({error}), expected a mesh") from None


def _within_faces(points: np.ndarray, faces: list[list[int]]) -> Iterator[np.ndarray]:
    """The middle of each face, and of each of its edges: the corners of an L all lie on its hull."""
    for face in faces:
        corners = points[face]
        yield corners.mean(axis=0)
        yield from (corners + np.roll(corners, 1, axis=0)) / 2


def _contents(text: str, file: str) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices (n,3), and the numbers of each face's."""
    points: list[tuple[float, float, float]] = []
    faces: list[tuple[int, list[str]]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if words and words[0] == "v":
            points.append(_vertex(words, number, file))
            if len(points) > MAX_POINTS:
                raise ShapeError(f"{file}: has more than {MAX_POINTS} vertices, expected fewer")
        elif words and words[0] == "f":
            faces.append((number, words[1:]))
    if not points:
        raise ShapeError(f"{file}: holds no vertex, expected lines v X Y Z")
    return np.array(points), [_face(words, len(points), number, file) for number, words in faces]


def _vertex(words: list[str], number: int, file: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(word) for word in words[1:4])
    except ValueError:
        raise ShapeError(f"{file}: line {number} is no vertex, expected v X Y Z") from None
    if not all(abs(c) <= 10.0 for c in (x, y, z)):
        raise ShapeError(f"{file}: line {number} lies beyond 10 m, expected metres")
    return x, y, z


def _face(words: list[str], count: int, number: int, file: str) -> list[int]:
    """Numbers of a face's vertices from 0: in the file they count from 1, or back from the last one."""
    try:
        given = [int(word.split("/")[0]) for word in words]
    except ValueError:
        given = []
    if len(given) < 3 or not all(0 < abs(k) <= count for k in given):
        raise ShapeError(f"{file}: line {number} is no face, expected f with the numbers of three or more vertices")
    return [k - 1 if k > 0 else count + k for k in given]
