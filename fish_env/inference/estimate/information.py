"""What residuals say about parameters: information with the prior, and scores summed over time."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.estimate.products import inner
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.policy import POLICY
from fish_env.inference.vehicle import Coefficients


def prior_precision(
    baseline: Coefficients, further: int, released: Iterable[Coefficient]
) -> FloatArray:
    """Precision of the prior of each free parameter, baseline first, in units of its own spread.

    Args:
        baseline: coefficients with a prior.
        further: number of parameters without one, such as those of effects.
        released: coefficients whose prior is lifted, but for a trace that keeps a
            parameter without effect in place.
    """
    prior = np.concatenate([np.ones(len(baseline)), np.zeros(further)])
    for coefficient in released:
        prior[baseline.ids.index(coefficient)] = POLICY.lifted_prior_precision
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


def leverage(slopes: FloatArray, prior: FloatArray) -> FloatArray:
    """Share of each residual that the parameters follow (D,): the diagonal of the hat matrix.

    Args:
        slopes: (D, n) derivative of whitened residuals.
        prior: (n,) precision.
    """
    spread = np.linalg.solve(information(slopes, prior), slopes.T)
    return np.asarray(np.einsum("ij,ji->i", slopes, spread))


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


def block_index(
    run_of: IntArray, time_of: FloatArray, length_s: float = POLICY.score_block_s
) -> IntArray:
    """(D,) number of the block of time that each residual lies in, counted over all runs."""
    block = run_of * 10_000 + np.floor(time_of / length_s).astype(np.int64)
    return np.unique(block, return_inverse=True)[1]


def sums_over(index: IntArray, scores: FloatArray) -> FloatArray:
    """Scores (D, m) summed over the blocks of an index (D,), as many as there are, (blocks, m)."""
    if np.any(index[1:] < index[:-1]):
        order = np.argsort(index, kind="stable")
        index, scores = index[order], scores[order]
    firsts = np.flatnonzero(np.diff(index, prepend=-1))
    return np.asarray(np.add.reduceat(scores, firsts, axis=0))


def eliminated(hessian: FloatArray, own: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Some parameters with all others following them, as a Schur complement.

    Args:
        hessian: (n, n) of all parameters.
        own: (k,) numbers of some of them.

    Returns:
        Numbers of the rest; by how much these go back, (rest, k), for each unit of the k; and the
        information (k, k) that is left about the k.
    """
    rest = np.setdiff1d(np.arange(len(hessian)), own)
    across = hessian[np.ix_(rest, own)]
    along = np.linalg.solve(hessian[np.ix_(rest, rest)], across)
    return rest, np.asarray(along), np.asarray(hessian[np.ix_(own, own)] - across.T @ along)
