"""Are two convex solids surely further apart than a margin? For all pairs in which one is a hull.

The closest points are sought as Gilbert, Johnson and Keerthi do (A fast procedure for computing the distance between
complex objects, 1988). Every step gives an axis, and the gap between both solids along it is a lower bound of
their distance: once that exceeds the margin, they are surely apart, whatever rounding did on the way. Everything
doubtful counts as too near. Margins below zero ask how deep both overlap; the axes tried for that are
the normals of flat faces, so that it may be overestimated.
"""

import numpy as np
from numba import njit

from planner.motion.tables import BOX, COUNT, CYLINDER, FACES, FIRST, HALF, HULL, KIND, PLACE, SPHERE

STEPS = 40
CONVERGED = 1e-9
"""Square metres between the squared upper and lower bound of the distance at which the search ends."""


@njit(cache=True)
def _support(solids, k, corners, nx, ny, nz, out):
    """Write `out` (3,): the point of placed solid k that lies farthest along n. A sphere is its centre."""
    R, p = PLACE, PLACE + 9
    out[0], out[1], out[2] = solids[k, p], solids[k, p + 1], solids[k, p + 2]
    kind = solids[k, KIND]
    if kind == SPHERE:
        return
    x = nx * solids[k, R] + ny * solids[k, R + 3] + nz * solids[k, R + 6]
    y = nx * solids[k, R + 1] + ny * solids[k, R + 4] + nz * solids[k, R + 7]
    z = nx * solids[k, R + 2] + ny * solids[k, R + 5] + nz * solids[k, R + 8]
    if kind == HULL:
        first = int(solids[k, FIRST])
        best, farthest = first, -np.inf
        for c in range(first, first + int(solids[k, COUNT])):
            along = x * corners[c, 0] + y * corners[c, 1] + z * corners[c, 2]
            if along > farthest:
                best, farthest = c, along
        x, y, z = corners[best, 0], corners[best, 1], corners[best, 2]
    else:
        z = np.copysign(solids[k, HALF + 2], z)
        if kind == BOX:
            x, y = np.copysign(solids[k, HALF], x), np.copysign(solids[k, HALF + 1], y)
        else:
            scale = solids[k, HALF] / max(np.sqrt(x * x + y * y), 1e-12)
            x, y = x * scale, y * scale
    for r in range(3):
        out[r] += solids[k, R + 3 * r] * x + solids[k, R + 3 * r + 1] * y + solids[k, R + 3 * r + 2] * z


@njit(cache=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _nearest_on_segment(s, i, j, weight):
    """Weights of corners i, j of the simplex s whose sum is the point of the segment nearest to the origin."""
    square, along = 0.0, 0.0
    for r in range(3):
        e = s[j, r] - s[i, r]
        square += e * e
        along -= e * s[i, r]
    t = 0.0 if square <= 0.0 else min(1.0, max(0.0, along / square))
    weight[i], weight[j] = 1.0 - t, t


@njit(cache=True)
def _nearest_on_triangle(s, i, j, k, weight):
    """The same for a triangle (Ericson, Real-Time Collision Detection, 5.1.5)."""
    ab, ac = s[j] - s[i], s[k] - s[i]
    d1, d2 = -_dot(ab, s[i]), -_dot(ac, s[i])
    d3, d4 = -_dot(ab, s[j]), -_dot(ac, s[j])
    d5, d6 = -_dot(ab, s[k]), -_dot(ac, s[k])
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    total = va + vb + vc
    if va > 0.0 and vb > 0.0 and vc > 0.0 and total > 1e-30:
        weight[i], weight[j], weight[k] = va / total, vb / total, vc / total
        return
    best = np.inf
    trial = np.empty(4)
    for a, b in ((i, j), (j, k), (i, k)):
        trial[:] = 0.0
        _nearest_on_segment(s, a, b, trial)
        square = 0.0
        for r in range(3):
            c = trial[a] * s[a, r] + trial[b] * s[b, r]
            square += c * c
        if square < best:
            best = square
            weight[:] = trial


@njit(cache=True)
def _nearest_on_tetrahedron(s, weight):
    """The same for a tetrahedron. False if the origin lies inside."""
    best = np.inf
    trial, c = np.empty(4), np.empty(3)
    for i, j, k, m in ((0, 1, 2, 3), (0, 1, 3, 2), (0, 2, 3, 1), (1, 2, 3, 0)):
        normal = np.cross(s[j] - s[i], s[k] - s[i])
        beyond, here = -_dot(normal, s[i]), _dot(normal, s[m] - s[i])
        if beyond * here > 0.0 and abs(here) > 1e-16:
            continue
        trial[:] = 0.0
        _nearest_on_triangle(s, i, j, k, trial)
        for r in range(3):
            c[r] = trial[i] * s[i, r] + trial[j] * s[j, r] + trial[k] * s[k, r]
        if _dot(c, c) < best:
            best = _dot(c, c)
            weight[:] = trial
    return best < np.inf


@njit(cache=True)
def _reduce(s, size, v):
    """Keep of the simplex s (size corners) what is nearest to the origin; write that point to v.

    The number of corners kept; 4 means that the origin lies inside.
    """
    weight = np.zeros(4)
    if size == 1:
        weight[0] = 1.0
    elif size == 2:
        _nearest_on_segment(s, 0, 1, weight)
    elif size == 3:
        _nearest_on_triangle(s, 0, 1, 2, weight)
    elif not _nearest_on_tetrahedron(s, weight):
        return 4
    kept = 0
    v[:] = 0.0
    for n in range(size):
        if weight[n] > 0.0:
            for r in range(3):
                v[r] += weight[n] * s[n, r]
                s[kept, r] = s[n, r]
            kept += 1
    return kept


@njit(cache=True)
def surely_apart(first, i, first_corners, second, j, second_corners, margin):
    """Are solid i of `first` and j of `second`, both placed in W, surely further apart than `margin`?"""
    if first[i, KIND] == SPHERE:
        margin += first[i, HALF]
    if second[j, KIND] == SPHERE:
        margin += second[j, HALF]
    if margin < 0.0:
        return _faces_apart(first, i, first_corners, second, j, second_corners, margin) or _faces_apart(
            second, j, second_corners, first, i, first_corners, margin
        )
    p = PLACE + 9
    v, w, a = np.empty(3), np.empty(3), np.empty(3)
    simplex = np.empty((4, 3))
    size = 0
    for r in range(3):
        v[r] = first[i, p + r] - second[j, p + r]
    for _ in range(STEPS):
        length = np.sqrt(_dot(v, v))
        if length < 1e-9:
            return False
        _support(first, i, first_corners, -v[0], -v[1], -v[2], a)
        _support(second, j, second_corners, v[0], v[1], v[2], w)
        for r in range(3):
            w[r] = a[r] - w[r]
        gap = _dot(v, w) / length
        if gap > margin:
            return True
        if size > 0 and (length <= margin or length * (length - gap) < CONVERGED):
            return False
        simplex[size] = w
        size = _reduce(simplex, size + 1, v)
        if size == 4:
            return False
    return False


@njit(cache=True)
def _faces_apart(first, i, first_corners, second, j, second_corners, margin):
    """Is there a flat face of solid i beyond which solid j lies, by more than `margin` (below zero)?"""
    R = PLACE
    kind = first[i, KIND]
    count = int(first[i, FACES]) if kind == HULL else 0 if kind == SPHERE else 6
    start = int(first[i, FIRST] + first[i, COUNT]) if kind == HULL else 0
    a, b = np.empty(3), np.empty(3)
    for face in range(count):
        if kind == HULL:
            x, y, z = first_corners[start + face, 0], first_corners[start + face, 1], first_corners[start + face, 2]
        elif kind == CYLINDER and face < 4:
            continue
        else:
            sign = 1.0 if face % 2 == 0 else -1.0
            x, y, z = sign * (face // 2 == 0), sign * (face // 2 == 1), sign * (face // 2 == 2)
        nx = first[i, R] * x + first[i, R + 1] * y + first[i, R + 2] * z
        ny = first[i, R + 3] * x + first[i, R + 4] * y + first[i, R + 5] * z
        nz = first[i, R + 6] * x + first[i, R + 7] * y + first[i, R + 8] * z
        _support(first, i, first_corners, nx, ny, nz, a)
        _support(second, j, second_corners, -nx, -ny, -nz, b)
        if nx * (b[0] - a[0]) + ny * (b[1] - a[1]) + nz * (b[2] - a[2]) > margin:
            return True
    return False
