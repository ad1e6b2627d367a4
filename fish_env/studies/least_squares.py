"""Small pieces of least squares: what some columns cannot follow, and steps within bounds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


def without(mine: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (N, m) less what a run's own numbers, with slopes (N, k), can follow."""
    basis, triangle = np.linalg.qr(mine)
    basis = basis[:, np.abs(np.diag(triangle)) > 1e-10]
    return np.asarray(columns - basis @ (basis.T @ columns))


def bounded_step(
    left: FloatArray, right: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Solution of a quadratic problem within bounds, by holding what hits one."""
    free = np.ones(len(right), bool)
    move = np.zeros(len(right))
    for _ in range(len(right)):
        rest = right[free] - left[np.ix_(free, ~free)] @ move[~free]
        move[free] = np.linalg.solve(left[np.ix_(free, free)], rest)
        out = free & ((move < lower) | (move > upper))
        if not out.any():
            break
        move[out] = np.clip(move[out], lower[out], upper[out])
        free &= ~out
    return move
