"""Tails of chi-squared: p-values, also those too small for a number, and what a test can find.

Overwhelming evidence still ranks. Source: Abramowitz and Stegun (1964), 6.5.32 (the incomplete
gamma function of large arguments).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc, chdtri, chndtrinc, gammaln

from fish_env.arrays import FloatArray

SMALL = -600.0
"""Logarithm of what scipy still has in full precision."""
TERMS = 8


def chi2_log_tail(statistic: npt.ArrayLike, freedom: npt.ArrayLike) -> FloatArray:
    """Log probability that chi-squared exceeds a statistic; shapes are broadcast.

    Args:
        statistic: not negative.
        freedom: degrees of freedom, at most some tens.
    """
    values, half = np.asarray(statistic, float), 0.5 * np.asarray(freedom, float)
    with np.errstate(divide="ignore"):
        direct = np.log(chdtrc(2.0 * half, values))
    y = np.maximum(0.5 * values, -0.5 * SMALL)
    term = series = np.ones(np.broadcast_shapes(y.shape, half.shape))
    for k in range(1, TERMS):
        term = term * (half - k) / y
        series = series + term
    far = (half - 1.0) * np.log(y) - y - gammaln(half) + np.log(series)
    return np.asarray(np.where(direct > SMALL, direct, far))


def noncentrality(log_p: float, freedom: int, power: float) -> float:
    """Noncentrality of a chi-squared statistic that exceeds a threshold with some power.

    Args:
        log_p: log p-value at the threshold.
        freedom: degrees of freedom.
        power: probability to exceed it.
    """
    return float(chndtrinc(chdtri(freedom, np.exp(log_p)), freedom, 1.0 - power))
