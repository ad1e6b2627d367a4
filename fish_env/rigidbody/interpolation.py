"""Best linear interpolation of a sample from its neighbours, with weights from the series itself.

A symmetric filter of the neighbours predicts a sample (Kolmogorov, 1941; Grenander and Rosenblatt,
1957, section 1.10). Its weights are fitted to the channel, so a beat of any frequency is predicted
as well as a glide, and what is left is white noise and what jerks. They are fitted with Tukey's
biweight, so outliers do not choose them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.rigidbody.policy import RECORDINGS

REACH = 4
"""Neighbours on each side that predict a sample."""
BIWEIGHT = 4.685
"""Tuning constant with 95 % efficiency for normal noise (Holland and Welsch, 1977)."""
ROUNDS = 8
_ANGLES = ("roll", "yaw")
NORMAL_MEDIAN = 0.6745
"""Median of the absolute value of a standard normal number."""


@dataclass(frozen=True, eq=False)
class Interpolator:
    """Predicts a sample from its neighbours.

    Attributes:
        weights: (REACH,) of the pairs of neighbours, beside the mean of the nearest two.
        scale: standard deviation of the error, robust (SI).
    """

    weights: FloatArray
    scale: float

    def errors(self, windows: FloatArray) -> FloatArray:
        """Sample less prediction, shape (m,), for windows (m, 2 REACH + 1) about samples."""
        near, pairs = _pairs(windows)
        return np.asarray(windows[:, REACH] - near - pairs @ self.weights)

    @property
    def gain(self) -> float:
        """Standard deviation of the error over that of white noise in the samples."""
        return float(np.linalg.norm(self.weights_of_sample))

    @property
    def weights_of_sample(self) -> FloatArray:
        """(2 REACH + 1,) weights of a sample and its neighbours in the error."""
        own = self.weights.copy()
        own[0] = 0.5 - self.weights[1:].sum()
        return np.concatenate([-own[::-1], [1.0], -own])


def interpolator_of(windows: Sequence[FloatArray]) -> Interpolator | None:
    """The interpolator of least robust error; None with too few windows.

    Args:
        windows: of each run, (m, 2 REACH + 1).
    """
    every = np.concatenate(windows)
    if len(every) < RECORDINGS.fewest_interpolated_samples:
        return None
    near, pairs = _pairs(every)
    target = every[:, REACH] - near
    weights = np.zeros(REACH)
    trust = np.ones(len(every))
    scale = 0.0
    for _ in range(ROUNDS):
        root = np.sqrt(trust)
        weights[1:] = np.linalg.lstsq(pairs[:, 1:] * root[:, None], target * root, rcond=1e-10)[0]
        errors = target - pairs @ weights
        scale = max(float(np.median(np.abs(errors))) / NORMAL_MEDIAN, 1e-12)
        trust = np.maximum(1.0 - (errors / (BIWEIGHT * scale)) ** 2, 0.0) ** 2
    return Interpolator(weights, scale)


def windows_of(values: FloatArray, even: BoolArray) -> tuple[IntArray, FloatArray]:
    """Indices (m,) of samples with all neighbours, and the windows (m, 2 REACH + 1).

    Args:
        values: (n,), NaN where a sample is missing.
        even: (n,) whether the samples about each one are evenly spaced.
    """
    width = 2 * REACH + 1
    if len(values) < width:
        return np.zeros(0, np.int64), np.zeros((0, width))
    every = np.lib.stride_tricks.sliding_window_view(values, width)
    at = np.flatnonzero(np.isfinite(every).all(axis=1) & even[REACH:-REACH])
    return at + REACH, every[at]


def evenly_spaced(time_s: FloatArray) -> BoolArray:
    """(n,) whether the samples about each one are spaced as most are."""
    steps = np.diff(time_s)
    odd = np.abs(steps - np.median(steps)) > 0.4 * np.median(steps)
    count = np.convolve(odd, np.ones(2 * REACH), "full")[: len(steps) + 2 * REACH - 1]
    around = np.r_[count, 0.0][REACH - 1 : REACH - 1 + len(time_s)]
    return np.asarray(around < 0.5)


def without_turns(channel: str, values: FloatArray) -> FloatArray:
    """A copy, of angles that wind without jumps by a turn."""
    values = values.copy()
    if channel in _ANGLES:
        measured = np.isfinite(values)
        values[measured] = np.unwrap(values[measured])
    return values


def _pairs(windows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of the nearest two (m,), and how far sums of wider pairs are from theirs (m, REACH)."""
    offsets = np.arange(1, REACH + 1)
    sums = windows[:, REACH + offsets] + windows[:, REACH - offsets]
    return 0.5 * sums[:, 0], sums - sums[:, :1]
