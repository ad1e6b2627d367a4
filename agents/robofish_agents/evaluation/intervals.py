"""Confidence intervals of means over episodes and training seeds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest

from fish_env.arrays import FloatArray

CONFIDENCE = 0.95
RESAMPLES = 2000
SEED = 20_261_120
"""Of the resampling, so that the same episodes give the same interval."""


class Interval(NamedTuple):
    """A mean with its 95 % interval."""

    mean: float
    low: float
    high: float


def bootstrap(values: FloatArray) -> Interval:
    """Computes the percentile bootstrap of the mean over training seeds and episodes.

    Both are drawn with replacement, each seed together with the same drawn episodes, as all seeds
    swim the same ones (Efron and Tibshirani, An Introduction to the Bootstrap, chapters 8 and 13).

    Args:
        values: (seeds, episodes); NaN where a metric does not apply.

    Returns:
        NaN throughout if it applies to no episode.
    """
    episodes = np.flatnonzero(np.isfinite(values).any(axis=0))
    if not episodes.size:
        return Interval(np.nan, np.nan, np.nan)
    known = values[:, episodes]
    rng = np.random.default_rng(SEED)
    rows = rng.integers(len(known), size=(RESAMPLES, len(known), 1))
    columns = rng.integers(known.shape[1], size=(RESAMPLES, 1, known.shape[1]))
    drawn = known[rows, columns].reshape(RESAMPLES, -1)
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.nanquantile(np.nanmean(drawn, axis=1), [tail, 1.0 - tail])
    return Interval(float(np.nanmean(known)), float(low), float(high))


def rate(values: FloatArray) -> Interval:
    """Computes the interval of a share of episodes, from zeros and ones (seeds, episodes).

    The wider of the bootstrap and Wilson's interval for the number of episodes: a hundred successes
    in a hundred leave no width to a bootstrap, but are no certainty.
    """
    mean, low, high = bootstrap(values)
    count = values.shape[1]
    wilson = binomtest(round(mean * count), count).proportion_ci(CONFIDENCE, "wilson")
    return Interval(mean, min(low, float(wilson.low)), max(high, float(wilson.high)))
