"""Covariance of estimates from what is left of the residuals."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.estimate.free import Linearised
from fish_env.inference.estimate.information import block_index, sums_over


def sandwich(
    lin: Linearised, inverse: FloatArray, prior: FloatArray, clusters: IntArray | None = None
) -> FloatArray:
    """Covariance corrected for residuals that are still coloured (Morelli and Klein, 1995).

    Scores are summed over clusters that err independently; where their spread exceeds what white
    residuals give, the covariance grows by that much. It never shrinks.

    Args:
        lin: residuals and slopes at the estimates.
        inverse: (n, n) inverse of the information.
        prior: (n,) precision.
        clusters: (D,) number of the cluster of each residual; default: blocks of time.
    """
    index = block_index(lin.run_of, lin.time_of) if clusters is None else clusters
    sums = sums_over(index, lin.slopes * lin.residuals[:, None])
    sums -= sums.mean(axis=0)
    meat = sums.T @ sums * len(sums) / max(len(sums) - 1, 1)
    robust = inverse @ (meat + np.diag(prior)) @ inverse
    inflation = np.sqrt(np.maximum(np.diag(robust) / np.diag(inverse), 1.0))
    return np.asarray(inverse * np.outer(inflation, inflation))
