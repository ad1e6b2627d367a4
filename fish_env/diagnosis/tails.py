"""Logarithms of p-values, also of those too small for a number: overwhelming evidence still ranks.

Sources: Abramowitz and Stegun (1964), 6.5.32 (incomplete gamma function at large arguments) and
26.5.4 (incomplete beta function).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import betaln, chdtrc, fdtrc, gammaln, hyp2f1

FloatArray = npt.NDArray[np.float64]
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
    y = np.maximum(0.5 * values, -SMALL / 2.0)
    term = series = np.ones(np.broadcast_shapes(y.shape, half.shape))
    for k in range(1, TERMS):
        term = term * (half - k) / y
        series = series + term
    far = (half - 1.0) * np.log(y) - y - gammaln(half) + np.log(series)
    return np.asarray(np.where(direct > SMALL, direct, far))


def f_log_tail(statistic: npt.ArrayLike, freedom: npt.ArrayLike) -> FloatArray:
    """Log probability that F with 1 and some degrees of freedom exceeds a statistic.

    Args:
        statistic: not negative; shapes are broadcast.
        freedom: of the denominator, at most 20 000.
    """
    values, spread = np.asarray(statistic, float), np.asarray(freedom, float)
    half, rest = 0.5 * spread, spread / (spread + values)
    with np.errstate(divide="ignore"):
        direct = np.log(fdtrc(1.0, spread, values))
        series = np.log(hyp2f1(half + 0.5, 1.0, half + 1.0, rest))
        far = half * np.log(rest) + 0.5 * np.log1p(-rest) - np.log(half) - betaln(half, 0.5)
    return np.asarray(np.where(direct > SMALL, direct, far + series))
