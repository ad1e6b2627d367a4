"""Whether a recording holds anything but white noise.

A vehicle that moves leaves neighbouring samples alike: it drifts, turns or sways for longer than a
sample lasts. In white noise the correlations of a channel with itself, some samples later, are
independent of each other and nearly normal with a variance of one over the number of pairs.
Source: Ljung and Box (1978), Biometrika 65, 297; each run with a mean of its own.
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtrc

from fish_env.arrays import FloatArray
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import Recording


def sign_of_motion(recording: Recording) -> float:
    """Probability that white noise alone has as strong a sign of motion in any channel.

    One where no channel has enough samples to tell.
    """
    p_values = [p for channel in recording.channels if (p := _whiteness(recording, channel)) >= 0.0]
    return min(1.0, len(p_values) * min(p_values)) if p_values else 1.0


def _whiteness(recording: Recording, channel: str) -> float:
    """P-value of a channel's correlations with itself over all runs; -1 with too few samples."""
    lags = np.arange(1, RECORDINGS.white_lags + 1)
    sums, pairs, square, count = np.zeros(len(lags)), np.zeros(len(lags)), 0.0, 0
    for run in recording.runs:
        values = run.channels[channel]
        present = np.isfinite(values)
        if present.sum() <= RECORDINGS.fewest_noise_samples:
            continue
        left = np.where(present, values - values[present].mean(), 0.0)
        sums += _products(left, len(lags))
        pairs += _products(present.astype(float), len(lags))
        square += float(left @ left)
        count += int(present.sum())
    told = pairs > RECORDINGS.fewest_noise_samples
    if not told.any() or square == 0.0:
        return -1.0
    correlations = sums[told] / pairs[told] * (count / square)
    return float(chdtrc(told.sum(), (pairs[told] * correlations**2).sum()))


def _products(values: FloatArray, lags: int) -> FloatArray:
    """Sums of products of values (n,) with those 1, 2, ... samples later."""
    long = np.r_[values, np.zeros(lags)]
    return np.array([values @ long[lag : lag + len(values)] for lag in range(1, lags + 1)])
