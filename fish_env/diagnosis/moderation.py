"""How far the colour of residuals widens each of many tests: its own spread and that of all.

The spread of a score is read off its sums over blocks of time. A force that acts in a few of them
only, such as one that grows with the depth where one run dives, tells little of its own spread; all
tests together tell what spreads to expect. Each gets the mean of both, weighted by what they know,
and Student's tail for what is still unknown. Source: Smyth (2004), "Linear models and empirical
Bayes methods for assessing differential expression in microarray experiments", Statistical
Applications in Genetics and Molecular Biology 3(1), article 3, sections 4 and 6.2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import digamma, polygamma

FloatArray = npt.NDArray[np.float64]
ENDLESS = 1e4
"""Degrees of freedom of a spread that is known."""


class Spreads(NamedTuple):
    """Estimated variances, in units of what white residuals give.

    Attributes:
        variance: (n,).
        freedom: (n,) degrees of freedom.
    """

    variance: FloatArray
    freedom: FloatArray


def spreads(energy: FloatArray, sums: FloatArray) -> Spreads:
    """Of scores, from their sums over blocks of time.

    The freedom is that of a weighted sum of squares (Satterthwaite, 1946), less the one that it
    took to fit the signal.

    Args:
        energy: (blocks, n) variance of the sums if residuals are white.
        sums: (blocks, n) scores without what the signal itself explains.
    """
    total = energy.sum(axis=0)
    effective = np.maximum(total**2 / np.sum(energy**2, axis=0), 1.0 + 1e-3)
    variance = np.sum(sums**2, axis=0) / (total * (1.0 - 1.0 / effective))
    return Spreads(variance, effective - 1.0)


def moderated(own: Spreads) -> Spreads:
    """Each spread drawn towards those of all, the more so the less is known of it."""
    half = 0.5 * own.freedom
    # Logarithms of variances: mean and variance of what chi-squared leaves unexplained.
    excess = np.log(np.maximum(own.variance, 1e-12)) - digamma(half) + np.log(half)
    weight = 1.0 / polygamma(1, half)
    mean = float(weight @ excess / weight.sum())
    beyond = float(weight @ ((excess - mean) ** 2 - polygamma(1, half)) / weight.sum())
    prior = 2.0 * _inverse_trigamma(beyond) if beyond > 0.0 else ENDLESS
    usual = float(np.exp(mean + digamma(0.5 * prior) - np.log(0.5 * prior)))
    freedom = prior + own.freedom
    return Spreads((prior * usual + own.freedom * own.variance) / freedom, freedom)


def _inverse_trigamma(value: float) -> float:
    """Where the trigamma function has a value, by Newton's method (Smyth, 2004, appendix)."""
    if value < 2.0 / ENDLESS:
        return 0.5 * ENDLESS
    y = 0.5 + 1.0 / value
    for _ in range(50):
        trigamma = float(polygamma(1, y))
        change = trigamma * (1.0 - trigamma / value) / float(polygamma(2, y))
        y += change
        if -change < 1e-8 * y:
            break
    return y
