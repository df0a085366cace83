"""Broad phase of the exact model: where solids are, and which pairs of them are near by their world bounds."""

import numpy as np
from numba import njit


@njit(cache=True)
def place_solids(links, link, p_local, R_local, half):
    """Solids (m) riding on links, at n configurations: centres, lower and upper world bounds (n,m,3), and rotations.

    links (n,8,12): placements. link, p_local, half (m,…): each solid's link, centre in it and half
    extents. The last r solids have rotations R_local (r,3,3) in their link, those returned are (n,r,3,3) in W;
    the solids before are spheres.
    """
    n, m, r = links.shape[0], link.shape[0], R_local.shape[0]
    p, lower, upper = np.empty((n, m, 3)), np.empty((n, m, 3)), np.empty((n, m, 3))
    R = np.empty((n, r, 3, 3))
    for k in range(n):
        for s in range(m):
            X = links[k, link[s]]
            rider = s - (m - r)
            for i in range(3):
                a, b, c = X[3 * i], X[3 * i + 1], X[3 * i + 2]
                centre = X[9 + i] + a * p_local[s, 0] + b * p_local[s, 1] + c * p_local[s, 2]
                reach = half[s, i]
                if rider >= 0:
                    reach = 0.0
                    for j in range(3):
                        entry = a * R_local[rider, 0, j] + b * R_local[rider, 1, j] + c * R_local[rider, 2, j]
                        R[k, rider, i, j] = entry
                        reach += abs(entry) * half[s, j]
                p[k, s, i], lower[k, s, i], upper[k, s, i] = centre, centre - reach, centre + reach
    return p, lower, upper, R


@njit(cache=True)
def _near(lower, upper, a, other_lower, other_upper, b, margin):
    """Do bounds a of lower, upper (m,3) come nearer to bounds b of the others than the margin?"""
    for i in range(3):
        if lower[a, i] - margin >= other_upper[b, i] or upper[a, i] + margin <= other_lower[b, i]:
            return False
    return True


@njit(cache=True)
def _swept(lower, upper):
    """Bounds (m,3) around all n bounds (n,m,3)."""
    low, high = np.empty(lower.shape[1:]), np.empty(lower.shape[1:])
    for s in range(lower.shape[1]):
        for i in range(3):
            low[s, i], high[s, i] = np.inf, -np.inf
            for k in range(lower.shape[0]):
                low[s, i], high[s, i] = min(low[s, i], lower[k, s, i]), max(high[s, i], upper[k, s, i])
    return low, high


@njit(cache=True)
def near_pairs(lower, upper, other_lower, other_upper, first, second, margin):
    """Rows (index, pair) of the pairs whose world bounds come nearer than their margin, sorted by index.

    lower, upper (n,m,3): bounds of moving solids; other_lower, other_upper (n or 1, o,3): of what they
    are held against. first, second, margin (k,): the pairs' numbers in these, and their margins.
    """
    low, high = _swept(lower, upper)
    other_low, other_high = _swept(other_lower, other_upper)
    kept = np.empty(first.shape[0], dtype=np.int64)
    count = 0
    for k in range(first.shape[0]):
        if _near(low, high, first[k], other_low, other_high, second[k], margin[k]):
            kept[count] = k
            count += 1
    rows = np.empty((lower.shape[0] * count, 2), dtype=np.int64)
    found = 0
    for index in range(lower.shape[0]):
        other = min(index, other_lower.shape[0] - 1)
        for k in kept[:count]:
            if _near(
                lower[index], upper[index], first[k], other_lower[other], other_upper[other], second[k], margin[k]
            ):
                rows[found, 0], rows[found, 1] = index, k
                found += 1
    return rows[:found]
