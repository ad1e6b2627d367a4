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


def is_driven(recording: Recording) -> bool:
    """Whether something drives the vehicle for most of a run: at rest, noise is all there is."""
    return any(
        np.ptp(run.still_s, axis=1).sum() < 0.5 * np.ptp(run.time_s) for run in recording.runs
    )


def sign_of_motion(recording: Recording) -> float | None:
    """Probability that white noise alone has as strong a sign of motion in any channel.

    None where a channel has too few samples to tell, or only one value.
    """
    p_values = [_whiteness(recording, channel) for channel in recording.channels]
    told = [p for p in p_values if p is not None]
    return min(1.0, len(told) * min(told)) if told and len(told) == len(p_values) else None


def _whiteness(recording: Recording, channel: str) -> float | None:
    """P-value of a channel's correlations with itself over all runs; None where it tells none."""
    lags = RECORDINGS.white_lags
    sums, pairs, square, count = np.zeros(lags), np.zeros(lags), 0.0, 0
    for run in recording.runs:
        values = run.channels[channel]
        present = np.isfinite(values)
        if present.sum() <= RECORDINGS.fewest_noise_samples:
            continue
        left = np.where(present, values - values[present].mean(), 0.0)
        sums += _products(left, lags)
        pairs += _products(present.astype(float), lags)
        square += float(left @ left)
        count += int(present.sum())
    told = pairs > RECORDINGS.fewest_noise_samples
    if not told.any() or square == 0.0:
        return None
    correlations = sums[told] / pairs[told] * (count / square)
    return float(chdtrc(told.sum(), (pairs[told] * correlations**2).sum()))


def _products(values: FloatArray, lags: int) -> FloatArray:
    """Sums of products of values (n,) with those 1, 2, ... samples later."""
    long = np.r_[values, np.zeros(lags)]
    return np.array([values @ long[lag : lag + len(values)] for lag in range(1, lags + 1)])
