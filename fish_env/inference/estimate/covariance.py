"""Covariance of estimates from what is left of the residuals."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri, ndtri, stdtrit

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.estimate.free import Linearised
from fish_env.inference.estimate.information import block_index, sums_over
from fish_env.inference.policy import POLICY


def sandwich(
    lin: Linearised, inverse: FloatArray, prior: FloatArray, clusters: IntArray | None = None
) -> FloatArray:
    """Covariance corrected for residuals that are still coloured (Morelli and Klein, 1995).

    Scores are summed over clusters that err independently; where their spread exceeds what white
    residuals give, the covariance grows by that much. It never shrinks. What is wrong for a whole
    run stays so over all its clusters: where the sums over runs spread by more than those over
    clusters say, and by more than chance makes them, they count, with the quantile of Student's t
    for so few. Source: Cameron and Miller (2015), "A practitioner's guide to cluster-robust
    inference", Journal of Human Resources 50, sections II and VI.

    Args:
        lin: residuals and slopes at the estimates.
        inverse: (n, n) inverse of the information.
        prior: (n,) precision.
        clusters: (D,) number of the cluster of each residual; default: blocks of time.
    """
    index = block_index(lin.run_of, lin.time_of) if clusters is None else clusters
    scores = lin.slopes * lin.residuals[:, None]
    widened = np.maximum(_widened(scores, inverse, prior, index), 1.0)
    count = len(np.unique(lin.run_of))
    if count >= POLICY.fewest_runs_for_interval:
        by_run = _widened(scores, inverse, prior, lin.run_of)
        by_chance = chdtri(count - 1, POLICY.run_errors_level) / (count - 1)
        end = POLICY.interval_ends[1]
        few = float(stdtrit(count - 1, end) / ndtri(end)) ** 2
        widened = np.where(by_run > by_chance * widened, few * by_run, widened)
    inflation = np.sqrt(widened)
    return np.asarray(inverse * np.outer(inflation, inflation))


def _widened(
    scores: FloatArray, inverse: FloatArray, prior: FloatArray, index: IntArray
) -> FloatArray:
    """Variance (n,) over that in white residuals, by sums of scores (D, n) over an index (D,)."""
    sums = sums_over(index, scores)
    sums -= sums.mean(axis=0)
    meat = sums.T @ sums * len(sums) / max(len(sums) - 1, 1)
    robust = inverse @ (meat + np.diag(prior)) @ inverse
    return np.asarray(np.diag(robust) / np.diag(inverse))
