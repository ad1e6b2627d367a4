"""What residuals say about parameters: information with the prior, and scores summed over time."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from fish_env.identification.parameters import Baseline
from fish_env.identification.products import inner

FloatArray = npt.NDArray[np.float64]
BLOCK_S = 3.0
"""Length of the blocks over which scores are summed (s), longer than most disturbances remember."""
LONG_BLOCK_S = 9.0
"""As long as a disturbance may remember; few fit into a run, so their spread is less sure."""


def prior_precision(baseline: Baseline, further: int, released: Iterable[str]) -> FloatArray:
    """Precision of the prior of each free parameter, baseline first, in units of its own spread.

    Args:
        baseline: coefficients with a prior.
        further: number of parameters without one, such as those of effects.
        released: paths of coefficients whose prior is lifted, but for a trace that keeps a
            parameter without effect in place.
    """
    prior = np.concatenate([np.ones(len(baseline)), np.zeros(further)])
    for path in released:
        prior[baseline.paths.index(path)] = 1e-4
    return prior


def information(slopes: FloatArray, prior: FloatArray) -> FloatArray:
    """Information of data and prior (n, n); a parameter without effect keeps a finite inverse.

    Args:
        slopes: (D, n) derivative of whitened residuals.
        prior: (n,) precision.
    """
    of_data = inner(slopes, slopes)
    floor = 1e-9 * np.diag(of_data) + 1e-12
    return np.asarray(of_data + np.diag(prior + floor))


def gradient(
    slopes: FloatArray, residuals: FloatArray, prior: FloatArray, at: FloatArray
) -> FloatArray:
    """Half the gradient (n,) of the squared residuals and the prior.

    Args:
        slopes: (D, n) derivative of whitened residuals.
        residuals: (D,) whitened.
        prior: (n,) precision.
        at: (n,) where the slopes were taken.
    """
    return np.asarray(inner(slopes, residuals[:, None])[:, 0] + prior * at)


def block_sums(
    scores: FloatArray,
    run_of: npt.NDArray[np.int64],
    time_of: FloatArray,
    length_s: float = BLOCK_S,
) -> FloatArray:
    """Scores (D, m) summed over blocks of time of each run, shape (blocks, m)."""
    return sums_over(block_index(run_of, time_of, length_s), scores)


def block_index(
    run_of: npt.NDArray[np.int64], time_of: FloatArray, length_s: float
) -> npt.NDArray[np.int64]:
    """(D,) number of the block of time that each residual lies in, counted over all runs."""
    block = run_of * 10_000 + np.floor(time_of / length_s).astype(np.int64)
    return np.unique(block, return_inverse=True)[1]


def sums_over(index: npt.NDArray[np.int64], scores: FloatArray) -> FloatArray:
    """Scores (D, m) summed over the blocks of an index (D,), shape (blocks, m)."""
    return np.column_stack([np.bincount(index, weights=column) for column in scores.T])
