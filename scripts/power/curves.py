"""A psychometric curve through counts: the share found against the size, and where it is 0.8."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, logit, xlog1py, xlogy
from scipy.stats import chi2

POWER = 0.8
SIZES = np.linspace(np.log(0.2), np.log(5.0), 644)
"""Logarithms of the sizes tried for the power 0.8, half a per cent apart."""
STEEPNESS = np.geomspace(1.5, 30.0, 40)
EXPECTED, SPREAD = 7.0, 0.5
"""A chi-squared test at the screen's threshold has about this steepness; a prior on its logarithm
with this spread keeps a handful of counts from asking for a cliff."""


@dataclass(frozen=True)
class Curve:
    """share(size) = expit(logit(0.8) + steepness * log(size / at)).

    Attributes:
        at: size that is found with power 0.8.
        low, high: its 95 % interval, by profile likelihood; the edge of what was tried where the
            counts do not bound it.
        steepness: of the curve.
        looks: number of data sets.
    """

    at: float
    low: float
    high: float
    steepness: float
    looks: int

    def share(self, size: np.ndarray) -> np.ndarray:
        """Share found at sizes."""
        return expit(logit(POWER) + self.steepness * np.log(np.asarray(size) / self.at))


def fit_curve(sizes: Sequence[float], found: Sequence[bool]) -> Curve:
    """Likelihood over a grid, which never fails, not even where all or none are found.

    Args:
        sizes: size of each data set, above zero.
        found: whether it was found.
    """
    size, hit = np.unique(np.asarray(sizes, float)), np.asarray(found, bool)
    index = np.searchsorted(size, np.asarray(sizes, float))
    yes = np.bincount(index, hit, len(size))
    no = np.bincount(index, ~hit, len(size))
    lifted = np.log(size) - SIZES[:, None]
    share = expit(logit(POWER) + STEEPNESS[:, None, None] * lifted)
    prior = -0.5 * (np.log(STEEPNESS / EXPECTED) / SPREAD) ** 2
    likelihood = (xlogy(yes, share) + xlog1py(no, -share)).sum(axis=2) + prior[:, None]
    steepest, middle = np.unravel_index(np.argmax(likelihood), likelihood.shape)
    profile = likelihood.max(axis=0)
    inside = SIZES[profile > profile[middle] - 0.5 * chi2.isf(0.05, 1)]
    return Curve(
        float(np.exp(SIZES[middle])),
        float(np.exp(inside[0])),
        float(np.exp(inside[-1])),
        float(STEEPNESS[steepest]),
        len(hit),
    )


def strength(
    over: Sequence[float], expected: Sequence[float], freedom: Sequence[int]
) -> dict[str, float]:
    """Size of signals against what was expected of them, from the statistics themselves.

    A statistic is noncentral chi-squared; its noncentrality grows with the square of the size. So
    the ratio of sizes is the root of the ratio of the sums, which uses more than counts do.

    Args:
        over: statistic of the screen's test less its degrees of freedom, one a data set.
        expected: noncentrality that the published size promises for each.
        freedom: degrees of freedom of each.
    """
    promised, seen = float(np.sum(expected)), max(float(np.sum(over)), 0.0)
    error = np.sqrt(2.0 * float(np.sum(freedom)) + 4.0 * seen)
    edges = np.sqrt(np.maximum(seen + np.array([-1.96, 0.0, 1.96]) * error, 0.0) / promised)
    return {"ratio": float(edges[1]), "low": float(edges[0]), "high": float(edges[2])}
