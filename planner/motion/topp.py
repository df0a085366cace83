"""Time-optimal rate along a given path, by reachability (Pham, Pham: A new approach to time-optimal path
parameterization based on reachability analysis, IEEE Transactions on Robotics 34(3), 2018).

On a path q(s) let x = ṡ² and u = s̈. Between grid points u is constant, so x changes by 2 u Δs. The joints'
limits are linear in (x, u): |q′| √x ≤ v, |q′ u + q″ x| ≤ a, the latter at both ends of each interval.
Backwards from rest, each grid point gets the largest x from which the rest of the path can be
done; forwards, the rate grows as fast as these bounds admit. The set of good x is an interval that
begins at 0 (standing still is always possible), so its upper end is found by bisection.
"""

import numpy as np
from numba import njit

_BISECTIONS = 45


@njit(cache=True)
def _accelerations(x, i, step, d1, d2, a_max, x_next):
    """Smallest and largest u at grid point i for this x, with x at the next point between 0 and x_next."""
    low, high = -x / (2 * step), (x_next - x) / (2 * step)
    for j in range(d1.shape[1]):
        for end in range(2):
            # q′ u + q″ x here, and q′ u + q″ (x + 2 u Δs) at the next point.
            slope = d1[i + end, j] + 2 * step * end * d2[i + end, j]
            offset = d2[i + end, j] * x
            if abs(slope) < 1e-12:
                if abs(offset) > a_max[j]:
                    return 1.0, -1.0
                continue
            first, second = (-a_max[j] - offset) / slope, (a_max[j] - offset) / slope
            low, high = max(low, min(first, second)), min(high, max(first, second))
    return low, high


@njit(cache=True)
def fastest_rates(grid, d1, d2, v_max, a_max, most):
    """Highest rates ṡ (n,) from rest to rest at the grid points s (n,), rising.

    d1, d2 (n,7): first and second derivative of the path by s at the grid points. v_max, a_max (7,): limits.
    most (n,): what else bounds the rate at each grid point.
    """
    n = grid.shape[0]
    bound = np.empty(n)
    for i in range(n):
        bound[i] = most[i] ** 2
        for j in range(d1.shape[1]):
            speed = abs(d1[i, j])
            if speed > 1e-12:
                bound[i] = min(bound[i], (v_max[j] / speed) ** 2)
    bound[n - 1] = 0.0
    for i in range(n - 2, -1, -1):
        step = grid[i + 1] - grid[i]
        good, bad = 0.0, bound[i]
        low, high = _accelerations(bad, i, step, d1, d2, a_max, bound[i + 1])
        if low > high:
            for _ in range(_BISECTIONS):
                x = (good + bad) / 2
                low, high = _accelerations(x, i, step, d1, d2, a_max, bound[i + 1])
                if low > high:
                    bad = x
                else:
                    good = x
            bound[i] = good
    rates = np.zeros(n)
    x = 0.0
    for i in range(n - 1):
        step = grid[i + 1] - grid[i]
        _, high = _accelerations(x, i, step, d1, d2, a_max, bound[i + 1])
        x = min(max(x + 2 * step * high, 0.0), bound[i + 1])
        rates[i + 1] = np.sqrt(x)
    return rates
