"""Are two solids surely further apart than a margin? Compiled; the columns of their tables are told in `tables`.

A sphere against anything is exact. Two solids that aren't spheres are held apart by a separating axis: among the
axes tried, one along which both are further apart than the margin. For two boxes these are the
classic fifteen (Gottschalk, Lin, Manocha: OBBTree, 1996) and the line from centre to centre, exact at margin zero; with
a margin, two corners facing each other may be rejected that are apart by a little more. A cylinder against a box or a
cylinder may be rejected half a millimetre too early on average, rarely a centimetre, where its rim faces an
edge. Hulls, if not apart as their bounding boxes are, are tested by `gjk`, exactly but for margins below zero. Never is
a pair accepted that is nearer than its margin.
"""

import numpy as np
from numba import njit

from planner.motion.gjk import surely_apart
from planner.motion.tables import CYLINDER, HALF, HULL, KIND, LOWER, OBSTACLE_COLUMNS, PLACE, SPHERE, UPPER

_part = njit(inline="always")
"""Written into its callers."""


@_part
def out_of_bounds(x, y, z, reach, obstacles, k):
    """Is the cube of half side `reach` about the point clear of the obstacle's world bounds?"""
    return (
        x + reach < obstacles[k, LOWER]
        or x - reach > obstacles[k, UPPER]
        or y + reach < obstacles[k, LOWER + 1]
        or y - reach > obstacles[k, UPPER + 1]
        or z + reach < obstacles[k, LOWER + 2]
        or z - reach > obstacles[k, UPPER + 2]
    )


@_part
def bounds_apart(solids, s, obstacles, k, margin):
    """Are the world bounds of placed solid s and of obstacle k further apart than the margin?"""
    for i in range(3):
        if solids[s, LOWER + i] - margin > obstacles[k, UPPER + i]:
            return True
        if solids[s, UPPER + i] + margin < obstacles[k, LOWER + i]:
            return True
    return False


@_part
def _distance(dx, dy, dz, solids, k):
    """Distance from solid k (a hull counts as its bounding box) of a point d away from its centre; 0 inside."""
    R = PLACE
    x = solids[k, R] * dx + solids[k, R + 3] * dy + solids[k, R + 6] * dz
    y = solids[k, R + 1] * dx + solids[k, R + 4] * dy + solids[k, R + 7] * dz
    z = solids[k, R + 2] * dx + solids[k, R + 5] * dy + solids[k, R + 8] * dz
    if solids[k, KIND] == SPHERE:
        return max(0.0, np.sqrt(x * x + y * y + z * z) - solids[k, HALF])
    z = max(0.0, abs(z) - solids[k, HALF + 2])
    if solids[k, KIND] == CYLINDER:
        x, y = max(0.0, np.sqrt(x * x + y * y) - solids[k, HALF]), 0.0
    else:
        x, y = max(0.0, abs(x) - solids[k, HALF]), max(0.0, abs(y) - solids[k, HALF + 1])
    return np.sqrt(x * x + y * y + z * z)


@_part
def point_distance(x, y, z, solids, k):
    """Distance of the point from placed solid k, 0 inside; for a hull, from its bounding box."""
    p = PLACE + 9
    return _distance(x - solids[k, p], y - solids[k, p + 1], z - solids[k, p + 2], solids, k)


@njit(cache=True)
def point_near(x, y, z, reach, solids, k, corners):
    """Does the point come nearer than `reach` to placed solid k?"""
    p = PLACE + 9
    dx, dy, dz = x - solids[k, p], y - solids[k, p + 1], z - solids[k, p + 2]
    if _distance(dx, dy, dz, solids, k) >= reach:
        return False
    if solids[k, KIND] != HULL:
        return True
    point = np.zeros((1, OBSTACLE_COLUMNS))
    point[0, KIND], point[0, p], point[0, p + 1], point[0, p + 2] = SPHERE, x, y, z
    return not surely_apart(point, 0, corners, solids, k, corners, reach)


@njit(cache=True)
def sphere_hits(x, y, z, reach, obstacles, k, corners):
    """Does a sphere of radius `reach` (margin included) touch obstacle k?"""
    return not out_of_bounds(x, y, z, reach, obstacles, k) and point_near(x, y, z, reach, obstacles, k, corners)


@njit(cache=True)
def solid_hits(solids, s, own, obstacles, k, corners, margin):
    """Does solid s (corners `own`), placed in W, come nearer to obstacle k than the margin?"""
    p = PLACE + 9
    x, y, z = solids[s, p], solids[s, p + 1], solids[s, p + 2]
    if solids[s, KIND] == SPHERE:
        return sphere_hits(x, y, z, solids[s, HALF] + margin, obstacles, k, corners)
    if obstacles[k, KIND] == SPHERE:
        reach = obstacles[k, HALF] + margin
        return point_near(obstacles[k, p], obstacles[k, p + 1], obstacles[k, p + 2], reach, solids, s, own)
    if solids_apart(solids, s, obstacles, k, margin):
        return False
    if solids[s, KIND] != HULL and obstacles[k, KIND] != HULL:
        return True
    return not surely_apart(solids, s, own, obstacles, k, corners, margin)


@njit(cache=True)
def _extent(solids, k, x, y, z, square):
    """Half the extent of solid k along an axis (x, y, z in its frame) times the axis' length, whose square is given."""
    if solids[k, KIND] == CYLINDER:
        return solids[k, HALF] * np.sqrt(max(0.0, square - z * z)) + solids[k, HALF + 2] * abs(z)
    return solids[k, HALF] * abs(x) + solids[k, HALF + 1] * abs(y) + solids[k, HALF + 2] * abs(z)


@njit(cache=True)
def _flat_extent(solids, k, r, u, t, v, square):
    """The same for an axis with components u and v along r and t only."""
    if solids[k, KIND] == CYLINDER:
        z = u if r == 2 else v if t == 2 else 0.0
        return solids[k, HALF] * np.sqrt(max(0.0, square - z * z)) + solids[k, HALF + 2] * abs(z)
    return solids[k, HALF + r] * abs(u) + solids[k, HALF + t] * abs(v)


@njit(cache=True)
def _cosine(first, i, r, second, j, k):
    """Cosine of the angle between axis r of solid i and axis k of solid j."""
    R = PLACE
    return (
        first[i, R + r] * second[j, R + k]
        + first[i, R + 3 + r] * second[j, R + 3 + k]
        + first[i, R + 6 + r] * second[j, R + 6 + k]
    )


@njit(cache=True)
def _in_frame(x, y, z, solids, k):
    """A vector of W in the frame of solid k."""
    R = PLACE
    return (
        x * solids[k, R] + y * solids[k, R + 3] + z * solids[k, R + 6],
        x * solids[k, R + 1] + y * solids[k, R + 4] + z * solids[k, R + 7],
        x * solids[k, R + 2] + y * solids[k, R + 5] + z * solids[k, R + 8],
    )


@njit(cache=True)
def solids_apart(first, i, second, j, margin):
    """Are two solids, hulls taken for their bounding boxes, surely further apart than `margin`? See the module.

    In the frames of the first and of the second, d and e lead from centre to centre. c[3 r + k] is the cosine
    between axis r of the first and axis k of the second.
    """
    p = PLACE + 9
    x, y, z = second[j, p] - first[i, p], second[j, p + 1] - first[i, p + 1], second[j, p + 2] - first[i, p + 2]
    d, e = _in_frame(x, y, z, first, i), _in_frame(x, y, z, second, j)
    c = (
        _cosine(first, i, 0, second, j, 0),
        _cosine(first, i, 0, second, j, 1),
        _cosine(first, i, 0, second, j, 2),
        _cosine(first, i, 1, second, j, 0),
        _cosine(first, i, 1, second, j, 1),
        _cosine(first, i, 1, second, j, 2),
        _cosine(first, i, 2, second, j, 0),
        _cosine(first, i, 2, second, j, 1),
        _cosine(first, i, 2, second, j, 2),
    )
    for r in range(3):
        across = _extent(second, j, c[3 * r], c[3 * r + 1], c[3 * r + 2], 1.0)
        if abs(d[r]) - margin > first[i, HALF + r] + across:
            return True
    for k in range(3):
        if abs(e[k]) - margin > second[j, HALF + k] + _extent(first, i, c[k], c[3 + k], c[6 + k], 1.0):
            return True
    if _separates(d, d, e, first, i, second, j, margin):
        return True
    for r in range(3):
        r1, r2 = (r + 1) % 3, (r + 2) % 3
        for k in range(3):
            k1, k2 = (k + 1) % 3, (k + 2) % 3
            # The cross product of both axes: two components in either frame.
            u, v, s, t = -c[3 * r2 + k], c[3 * r1 + k], c[3 * r + k2], -c[3 * r + k1]
            square = u * u + v * v
            if square < 1e-12:
                continue
            across = _flat_extent(first, i, r1, u, r2, v, square) + _flat_extent(second, j, k1, s, k2, t, square)
            if abs(d[r1] * u + d[r2] * v) - margin * np.sqrt(square) > across:
                return True
    return _sides_apart(d, e, c, first, i, second, j, margin)


@njit(cache=True)
def _sides_apart(d, e, c, first, i, second, j, margin):
    """Along the way from centre to centre, as far as it is square to the axis of a cylinder among both?"""
    if first[i, KIND] == CYLINDER:
        n = (d[0], d[1], 0.0)
        m = (d[0] * c[0] + d[1] * c[3], d[0] * c[1] + d[1] * c[4], d[0] * c[2] + d[1] * c[5])
        if _separates(d, n, m, first, i, second, j, margin):
            return True
    if second[j, KIND] == CYLINDER:
        n = (e[0] * c[0] + e[1] * c[1], e[0] * c[3] + e[1] * c[4], e[0] * c[6] + e[1] * c[7])
        m = (e[0], e[1], 0.0)
        return _separates(d, n, m, first, i, second, j, margin)
    return False


@njit(cache=True)
def _separates(d, n, m, first, i, second, j, margin):
    """Does an axis, n in the frame of the first and m in that of the second, keep both apart? No length: no."""
    square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    if square < 1e-12:
        return False
    across = _extent(first, i, n[0], n[1], n[2], square) + _extent(second, j, m[0], m[1], m[2], square)
    return abs(d[0] * n[0] + d[1] * n[1] + d[2] * n[2]) - margin * np.sqrt(square) > across
