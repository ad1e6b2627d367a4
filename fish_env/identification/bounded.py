"""A Gauss-Newton step that stays within bounds: a small quadratic programme by active sets.

Clipping a step instead changes its direction, and a fit with one coefficient at its bound then
stops far from where the others want to be.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
ROUNDS = 40
ROUNDING = 1e-10


def bounded_minimum(
    hessian: FloatArray,
    gradient: FloatArray,
    vector: FloatArray,
    rows: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> tuple[FloatArray, dict[int, bool]]:
    """The vector that minimises the quadratic model with ``low <= rows @ vector <= high``.

    Args:
        hessian: (n, n) positive definite.
        gradient: (n,) at the vector.
        vector: (n,) where the model is centred.
        rows: (m, n) what is bounded, independent.
        low: (m,) lower bounds.
        high: (m,) upper bounds.

    Returns:
        The vector (n,), and the rows it is pressed against, each with whether that is its upper
        bound. Should the set of active bounds not settle, the last set's answer.
    """
    inverse = np.asarray(np.linalg.inv(hessian), float)
    free = vector - inverse @ gradient
    deviation = spread(rows, inverse)
    active: dict[int, bool] = {}
    result = free
    for _ in range(ROUNDS):
        held = list(active)
        bounds = np.array([high[i] if active[i] else low[i] for i in held])
        result, pressure = _held(free, inverse, rows[held], bounds)
        inward = [p if active[i] else -p for i, p in zip(held, pressure, strict=True)]
        if inward and min(inward) < -ROUNDING:
            del active[held[int(np.argmin(inward))]]
            continue
        values = rows @ result
        over = np.maximum(low - values, values - high) / np.maximum(deviation, 1e-300)
        over[held] = 0.0
        worst = int(np.argmax(over))
        if over[worst] <= ROUNDING:
            break
        active[worst] = bool(values[worst] > high[worst])
    return result, active


def spread(rows: FloatArray, covariance: FloatArray) -> FloatArray:
    """Standard deviation (m,) of what rows (m, n) make of a vector with a covariance (n, n)."""
    return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", rows, covariance, rows)))


def _held(
    free: FloatArray, inverse: FloatArray, rows: FloatArray, bounds: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The minimum with some rows held at their bounds, and what presses against each."""
    if not len(rows):
        return free, np.zeros(0)
    across = inverse @ rows.T
    pressure = np.asarray(np.linalg.solve(rows @ across, rows @ free - bounds), float)
    return free - across @ pressure, pressure
