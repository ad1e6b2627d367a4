"""How much better one model is to learn on than another: differences with intervals.

The hidden fish are the units of replication: they stand for all fish that a designer may have, so
the spread of a difference from fish to fish says how sure its mean is. Seeds only make each fish's
number more exact. Policies trained without measurements are the same for all hidden fish, so what
chance made of them is common to all and does not show in that spread; it is added.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import t as student

from fish_env.arrays import FloatArray
from robofish_agents.evaluation.intervals import CONFIDENCE, Interval
from scripts.loop.training import BASELINE, TRUTH, WITHOUT_MEASUREMENTS

Scores = Mapping[str, FloatArray]
"""Arm -> (fish, seeds) of one metric."""


def per_fish(scores: Scores, arm: str, reference: str) -> FloatArray:
    """Difference of the means over seeds, (fish,)."""
    return np.asarray(scores[arm].mean(axis=1) - scores[reference].mean(axis=1))


def difference(scores: Scores, arm: str, reference: str) -> Interval:
    """Mean difference over the fish, with Student's interval.

    Args:
        scores: of one metric.
        arm: what is looked at.
        reference: what it is compared with.
    """
    values = per_fish(scores, arm, reference)
    common = {arm, reference} & set(WITHOUT_MEASUREMENTS)
    shared = sum(_shared(scores, name) for name in common)
    width = _quantile(len(values)) * np.sqrt(values.var(ddof=1) / len(values) + shared)
    mean = float(values.mean())
    return Interval(mean, mean - float(width), mean + float(width))


def share_closed(scores: Scores, arm: str) -> Interval:
    """Share of the gap between baseline and truth that an arm closes, with Fieller's interval.

    The share is the mean gain over the mean gap. Its interval holds every share s for which the
    mean of gain - s gap could be zero (Fieller, Journal of the Royal Statistical Society B 16,
    1954). Infinite where the gap itself could be zero.
    """
    gain, gap = per_fish(scores, arm, BASELINE), per_fish(scores, TRUTH, BASELINE)
    covariance = np.cov(gain, gap) / len(gain) + _shared(scores, BASELINE)
    t2 = _quantile(len(gain)) ** 2
    mean, full = float(gain.mean()), float(gap.mean())
    # (mean - s full)^2 <= t2 var(gain - s gap) is a quadratic in s: a s^2 - 2 b s + c <= 0.
    a = full**2 - t2 * covariance[1, 1]
    b = mean * full - t2 * covariance[0, 1]
    c = mean**2 - t2 * covariance[0, 0]
    share = mean / full if full else np.nan
    if not a > 0.0:
        return Interval(share, -np.inf, np.inf)
    root = np.sqrt(max(b * b - a * c, 0.0))
    return Interval(share, float((b - root) / a), float((b + root) / a))


def over_seeds(scores: Scores, arm: str, reference: str, fish: int) -> Interval:
    """Difference on one fish, with Student's interval over the seeds; the same seed is a pair."""
    values = scores[arm][fish] - scores[reference][fish]
    width = _quantile(len(values)) * values.std(ddof=1) / np.sqrt(len(values))
    mean = float(values.mean())
    return Interval(mean, mean - float(width), mean + float(width))


def _shared(scores: Scores, arm: str) -> float:
    """Variance of an arm's mean that all fish share: that of its policies."""
    policies = scores[arm].mean(axis=0)
    return float(policies.var(ddof=1) / len(policies))


def _quantile(units: int) -> float:
    return float(student.ppf((1.0 + CONFIDENCE) / 2.0, units - 1))
