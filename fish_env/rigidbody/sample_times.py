"""How early or late samples may be at most, from the series themselves.

A sample that comes early or late by dt is off by dt times the rate of its channel. So what the
neighbours do not predict grows with the rate, and how much it does bounds the jitter. Motion that
they do not predict grows with the rate as well: this is a bound and no estimate.
"""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.rigidbody.interpolation import (
    REACH,
    evenly_spaced,
    interpolator_of,
    windows_of,
    without_turns,
)
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import Recording

ROUNDS = 4
BLOCK = 50
"""Samples whose errors may be alike: those of a block count as one when errors are judged."""


def rate_of(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Rate of change (n,) of a channel, by central differences, in its unit per second.

    At 25 Hz the rate of a beat of 1.5 Hz comes out 2 % small, and sensor noise adds less than a
    hundredth to the noise that a jitter of some milliseconds makes of it.

    Args:
        time_s: (n,) sample times (s).
        values: (n,), NaN where missing: such a sample lies on the line between its neighbours.
    """
    told = np.isfinite(values)
    if told.sum() < 2:
        return np.zeros(len(values))
    return np.asarray(np.gradient(np.interp(time_s, time_s[told], values[told]), time_s))


def largest_jitter_s(recording: Recording) -> float:
    """Largest standard deviation of the times of samples that the channels together allow (s).

    Infinite where no channel says anything.
    """
    found = [_growth(recording, channel) for channel in recording.channels]
    told = [(variance, error) for variance, error in found if np.isfinite(error)]
    if not told:
        return float(np.inf)
    variances, errors = np.array(told).T
    weights = 1.0 / np.maximum(errors, 1e-30) ** 2
    error = float(weights.sum()) ** -0.5
    most = float(np.average(variances, weights=weights)) + RECORDINGS.jitter_bound_sd * error
    return float(np.sqrt(max(most, 0.0)))


def _growth(recording: Recording, channel: str) -> tuple[float, float]:
    """Variance (s^2) of the sample times by one channel alone, and its standard error."""
    series = [without_turns(channel, run.channels[channel]) for run in recording.runs]
    found = [windows_of(v, evenly_spaced(run.time_s))
             for v, run in zip(series, recording.runs, strict=True)]  # fmt: skip
    known = interpolator_of([windows for _, windows in found])
    if known is None:
        return 0.0, float(np.inf)
    squares: list[FloatArray] = []
    shares: list[FloatArray] = []
    blocks: list[IntArray] = []
    for run, values, (at, windows) in zip(recording.runs, series, found, strict=True):
        errors = known.errors(windows)
        shown = np.zeros(len(values))
        speed = rate_of(run.time_s, values) ** 2
        shown[REACH:-REACH] = np.convolve(speed, known.weights_of_sample**2, "valid")
        kept = np.abs(errors) < RECORDINGS.outlier_gate_sd * known.scale
        squares.append(errors[kept] ** 2)
        shares.append(shown[at[kept]])
        blocks.append(at[kept] // BLOCK + len(values) * len(blocks))
    return _slope(np.concatenate(squares), np.concatenate(shares), np.concatenate(blocks))


def _slope(squares: FloatArray, shares: FloatArray, blocks: IntArray) -> tuple[float, float]:
    """How squared errors (n,) grow with the share (n,) that jitter has in them, and its error."""
    design = np.column_stack([np.ones(len(shares)), shares])
    least = 0.2 * float(np.median(squares)) + 1e-30
    weights = np.ones(len(squares))
    for _ in range(ROUNDS):  # the variance of a square grows with its own square
        inverse = np.linalg.pinv((design * weights[:, None]).T @ design)
        found = inverse @ (design.T @ (weights * squares))
        weights = 1.0 / np.maximum(design @ found, least) ** 2
    left = (weights * (squares - design @ found))[:, None] * design
    _, own = np.unique(blocks, return_inverse=True)
    scores = np.array([np.bincount(own, column) for column in left.T])
    covariance = inverse @ (scores @ scores.T) @ inverse
    return float(found[1]), float(np.sqrt(covariance[1, 1]))
