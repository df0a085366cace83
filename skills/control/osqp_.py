"""One persistent OSQP workspace for a small dense QP that is solved again and again.

    minimise ½ xᵀ P x + gᵀ x   subject to   lower ≤ x ≤ upper,  row_lower ≤ R x ≤ row_upper

Setting up anew costs fifteen times as much as updating the numbers of a fixed dense pattern.
"""

import numpy as np
import osqp
from scipy import sparse

SOLVED = "solved"

_SETTINGS = {
    "verbose": False,
    # The caller brings rows of comparable size; OSQP would scale anew at each update.
    "scaling": 0,
    "rho": 1.0,
    # Counted in iterations, never in seconds: the same numbers give the same answer on any machine.
    "adaptive_rho_interval": 50,
    "check_termination": 5,
    "eps_abs": 1e-7,
    "eps_rel": 1e-7,
    "max_iter": 2000,
}


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
        self._lower = np.empty(size + rows)
        self._upper = np.empty(size + rows)
        self._size = size
        self._no_multipliers = np.zeros(size + rows)
        self._set_up()

    def _set_up(self) -> None:
        self._solver = osqp.OSQP()
        bound = np.ones(len(self._lower))
        self._solver.setup(self._pattern_P, np.zeros(self._size), self._pattern_A, -bound, bound, **self._settings)

    def solve(
        self,
        P: np.ndarray,
        g: np.ndarray,
        bounds: tuple[np.ndarray, np.ndarray],
        rows: tuple[np.ndarray, np.ndarray, np.ndarray],
    ) -> tuple[np.ndarray, str]:
        """Solve with P (n,n) positive definite, g (n,), bounds (lower, upper) (n,) each and
        rows (R (m,n), row_lower (m,), row_upper (m,)).

        Returns x (n,) and OSQP's status in words; x means nothing unless that is "solved".
        """
        R, row_lower, row_upper = rows
        n = self._size
        self._lower[:n], self._lower[n:] = bounds[0], row_lower
        self._upper[:n], self._upper[n:] = bounds[1], row_upper
        # OSQP ignores bounds that cross and answers with the previous problem's optimum; a NaN
        # stays in its iterates for good.
        if np.any(self._lower > self._upper):
            return np.zeros(n), "primal infeasible"
        if not (np.isfinite(P).all() and np.isfinite(g).all() and np.isfinite(R).all()):
            return np.zeros(n), "problem not finite"
        self._solver.update(
            q=g, l=self._lower, u=self._upper, Px=P[self._triangle], Ax=R.T.ravel(), Ax_idx=self._row_entries
        )
        self._start_from_free_optimum(P, g, R)
        result = self._solver.solve(raise_error=False)
        status = result.info.status
        if status != SOLVED:
            self._set_up()
            return np.zeros(n), status
        return np.array(result.x), SOLVED

    def _start_from_free_optimum(self, P: np.ndarray, g: np.ndarray, R: np.ndarray) -> None:
        """Most of the time no limit is active; then the start is already the optimum. Otherwise
        the last solution is the better start."""
        try:
            x = np.linalg.solve(P, -g)
        except np.linalg.LinAlgError:
            return
        n = self._size
        row = R @ x
        lower, upper = self._lower, self._upper
        if (x >= lower[:n]).all() and (x <= upper[:n]).all() and (row >= lower[n:]).all() and (row <= upper[n:]).all():
            self._solver.warm_start(x, self._no_multipliers)
