"""The surface of a shape as triangles, for pictures and for points on it."""

from functools import lru_cache

import numpy as np

from scenarios.shapes import Shape, convex_parts, outline


@lru_cache(maxsize=256)
def triangles(shape: Shape) -> np.ndarray:
    """Triangles (n,3,3) of all convex parts in the shape's frame, counterclockwise seen from outside, in metres.

    Curved surfaces are made of flat ones (see `outline`). What lies inside another part is there too.
    """
    found = []
    for part, X_OP in convex_parts(shape):
        solid = outline(part)
        found.append(solid.vertices[solid.triangles] @ X_OP.rotation.T + X_OP.translation)
    surface = np.concatenate(found)
    surface.setflags(write=False)
    return surface
