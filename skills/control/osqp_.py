"""One persistent OSQP workspace for a small dense QP that is solved again and again, where it needs solving.

    minimise ½ xᵀ P x + gᵀ x   subject to   lower ≤ x ≤ upper,  row_lower ≤ R x ≤ row_upper

Setting up anew costs fifteen times as much as updating the numbers of a fixed dense pattern. Where no limit is
active the optimum is that of P x = −g, found by Cholesky, and OSQP is left alone.
"""

import math
from typing import Any, NamedTuple, Protocol

import numpy as np
import osqp
from numba import njit
from scipy import sparse

SOLVED = "solved"

_SETTINGS = {
    "verbose": False,
    "rho": 1.0,
    # Counted in iterations, never in seconds: the same numbers give the same answer on any machine.
    "adaptive_rho_interval": 50,
    "check_termination": 5,
    "eps_abs": 1e-7,
    "eps_rel": 1e-7,
    "max_iter": 4000,
}


class _LeanOSQP(osqp.OSQP):
    """OSQP without the bookkeeping of its Python layer, which takes longer than the solver."""

    _solver: Any

    def load(
        self, g: np.ndarray, lower: np.ndarray, upper: np.ndarray, P: np.ndarray, A: np.ndarray, entries: np.ndarray
    ) -> None:
        """Replace the numbers: all of P's upper triangle, those `entries` of A, column by column."""
        self._solver.update_data_vec(q=g, l=lower, u=upper)
        self._solver.update_data_mat(P_x=P, P_i=None, A_x=A, A_i=entries)

    def run(self, x: np.ndarray) -> str:
        """Solve, fill in x and return the status in words."""
        self._solver.solve()
        x[:] = self._solver.solution.x
        return self._solver.info.status


class Problem(NamedTuple):
    """A QP in numbers: P (n,n) positive definite, g (n,), R (m,n); lower and upper (n + m,) bound x, then R x."""

    P: np.ndarray
    g: np.ndarray
    R: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


class Solver(Protocol):
    """Solves the controller's QP."""

    def solve(self, problem: Problem) -> tuple[np.ndarray, str]:
        """A new x (n,) and a status in words; x means nothing unless that is "solved"."""
        ...


class Workspace:
    """A QP in `size` variables with bounds on all of them and `rows` dense constraint rows."""

    def __init__(self, size: int, rows: int, **settings: float) -> None:
        self._settings = _SETTINGS | settings
        self._pattern_P = sparse.csc_matrix(np.triu(np.ones((size, size))))
        self._pattern_A = sparse.csc_matrix(np.vstack([np.eye(size), np.ones((rows, size))]))
        columns = np.repeat(np.arange(size), np.arange(1, size + 1))
        self._triangle = (self._pattern_P.indices, columns)
        per_column = rows + 1
        is_row = np.arange(per_column * size) % per_column > 0
        self._row_entries = np.flatnonzero(is_row).astype(np.int32)
        self._size, self._bounds = size, size + rows
        self._resting: np.ndarray | None = None
        self._no_multipliers = np.zeros(size + rows)
        self._set_up()

    def _set_up(self) -> None:
        self._solver = _LeanOSQP()
        bound = np.ones(self._bounds)
        self._solver.setup(self._pattern_P, np.zeros(self._size), self._pattern_A, -bound, bound, **self._settings)

    def solve(self, problem: Problem) -> tuple[np.ndarray, str]:
        """Returns x (n,) and OSQP's status in words; x means nothing unless that is "solved"."""
        x = np.zeros(self._size)
        start = _examine(*problem, x)
        # OSQP ignores bounds that cross and answers with the previous problem's optimum; a NaN
        # stays in its iterates for good.
        if start == _CROSSED:
            return x, "primal infeasible"
        if start == _NOT_FINITE:
            return x, "problem not finite"
        if start == _FREE:
            # Exact, and most ticks are like this: the solver is for those on which a limit matters.
            self._resting = x
            return x, SOLVED
        P, g, R, lower, upper = problem
        self._solver.load(g, lower, upper, P[self._triangle], R.T.ravel(), self._row_entries)
        if self._resting is not None:
            self._solver.warm_start(self._resting, self._no_multipliers)
            self._resting = None
        status = self._solver.run(x)
        if status != SOLVED:
            self._set_up()
        return x, status


_FREE, _LIMITED, _CROSSED, _NOT_FINITE = range(4)


@njit(cache=True)
def _examine(P: np.ndarray, g: np.ndarray, R: np.ndarray, lower: np.ndarray, upper: np.ndarray, x: np.ndarray) -> int:
    """Look at a problem before it is solved. `_FREE`: no limit is active and x now holds the optimum.
    `_LIMITED`: the unconstrained optimum breaks a limit."""
    n, m = len(g), len(lower)
    total = 0.0
    for i in range(m):
        if lower[i] > upper[i]:
            return _CROSSED
        total += lower[i] - upper[i]
    for i in range(n):
        total += g[i]
        for j in range(n):
            total += P[i, j]
    for i in range(m - n):
        for j in range(n):
            total += R[i, j]
    if not math.isfinite(total):
        return _NOT_FINITE
    # Cholesky: P = L Lᵀ, then L (Lᵀ x) = −g.
    L = np.zeros((n, n))
    for j in range(n):
        for i in range(j, n):
            rest = P[i, j]
            for k in range(j):
                rest -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = rest / L[j, j]
            elif rest > 0.0:
                L[j, j] = math.sqrt(rest)
            else:
                return _LIMITED
    for i in range(n):
        rest = -g[i]
        for k in range(i):
            rest -= L[i, k] * x[k]
        x[i] = rest / L[i, i]
    for i in range(n - 1, -1, -1):
        rest = x[i]
        for k in range(i + 1, n):
            rest -= L[k, i] * x[k]
        x[i] = rest / L[i, i]
    for i in range(m):
        value = 0.0
        if i < n:
            value = x[i]
        else:
            for k in range(n):
                value += R[i - n, k] * x[k]
        if value < lower[i] or value > upper[i]:
            return _LIMITED
    return _FREE
