"""Covariance of estimates from what is left of the residuals."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.free import Linearised
from fish_env.inference.estimate.information import block_sums


def sandwich(lin: Linearised, inverse: FloatArray, prior: FloatArray) -> FloatArray:
    """Covariance corrected for residuals that are still coloured (Morelli and Klein, 1995).

    Scores are summed over blocks longer than the correlation; where their spread exceeds what
    white residuals give, the covariance grows by that much. It never shrinks.
    """
    sums = block_sums(lin.slopes * lin.residuals[:, None], lin.run_of, lin.time_of)
    sums -= sums.mean(axis=0)
    meat = sums.T @ sums * len(sums) / max(len(sums) - 1, 1)
    robust = inverse @ (meat + np.diag(prior)) @ inverse
    inflation = np.sqrt(np.maximum(np.diag(robust) / np.diag(inverse), 1.0))
    return np.asarray(inverse * np.outer(inflation, inflation))
