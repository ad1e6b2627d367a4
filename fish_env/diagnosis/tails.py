"""Logarithms of p-values, also of those too small for a number: overwhelming evidence still ranks.

Source: Abramowitz and Stegun (1964), 6.5.32 (the incomplete gamma function of large arguments).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc, gammaln

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
    y = np.maximum(0.5 * values, -0.5 * SMALL)
    term = series = np.ones(np.broadcast_shapes(y.shape, half.shape))
    for k in range(1, TERMS):
        term = term * (half - k) / y
        series = series + term
    far = (half - 1.0) * np.log(y) - y - gammaln(half) + np.log(series)
    return np.asarray(np.where(direct > SMALL, direct, far))
