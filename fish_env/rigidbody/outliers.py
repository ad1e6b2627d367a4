"""Outliers of a channel and a bound on its white noise, by interpolation from the samples around.

A sample is predicted from its neighbours by a symmetric linear filter whose weights are fitted to
the channel itself, so a beat of any frequency is predicted as well as a glide (the best linear
interpolator of a stationary series: Kolmogorov, 1941; Grenander and Rosenblatt, 1957, section
1.10). A step or kink of the motion is badly predicted from both sides; an outlier stands alone: put
the prediction in its place, and its neighbours are predicted well again. Weights are fitted with
Tukey's biweight, so outliers do not choose them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from fish_env.rigidbody.recording import RecordedRun, Recording

REACH = 4
"""Neighbours on each side that predict a sample."""
FEWEST = 60
"""Samples with all neighbours that the weights need, ten for each number and more."""
GATE = 6.0
"""Standard deviations from which a sample is an outlier: of 500 million normal ones, one."""
BIWEIGHT = 4.685
"""Tuning constant with 95 % efficiency for normal noise (Holland and Welsch, 1977)."""
ROUNDS = 8
SETTLED = 2.5
"""Samples after a jump of a command in which a spike of a rate may be motion."""
_ANGLES = ("roll", "yaw")
_NORMAL = 0.6745
"""Median of the absolute value of a standard normal number."""


@dataclass(frozen=True, eq=False)
class Outliers:
    """Outliers of one channel.

    Attributes:
        channel: its name.
        unit: SI.
        flagged: by run, (n,) whether a sample is one.
        noise_sd: bound on the white noise without them (SI): what the neighbours do not predict;
            None with too few samples.
        sizes: (k,) their distances from the predictions (SI).
    """

    channel: str
    unit: str
    flagged: tuple[BoolArray, ...]
    noise_sd: float | None
    sizes: FloatArray

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.sizes)

    @property
    def share(self) -> float:
        """Share of the samples of the channel."""
        return self.count / max(sum(len(own) for own in self.flagged), 1)


@dataclass(frozen=True, eq=False)
class _Interpolator:
    """Weights (REACH,) of pairs of neighbours, beside their nearest mean, and the error's scale."""

    weights: FloatArray
    scale: float

    def errors(self, values: FloatArray, windows: FloatArray) -> FloatArray:
        """Sample less prediction, shape (m,), for values (m,) amid windows (m, 2 REACH + 1)."""
        near, pairs = _pairs(windows)
        return values - near - pairs @ self.weights

    @property
    def gain(self) -> float:
        """Standard deviation of the error over that of white noise in the samples."""
        own = self.weights.copy()
        own[0] = 0.5 * (1.0 - 2.0 * self.weights[1:].sum())
        return float(np.sqrt(1.0 + 2.0 * own @ own))


def outliers_of(recording: Recording) -> tuple[Outliers, ...]:
    """Outliers of every channel of a recording, in its order."""
    return tuple(_outliers(recording, channel) for channel in recording.channels)


def _outliers(recording: Recording, channel: str) -> Outliers:
    series = [_unwrapped(channel, run.channels[channel]) for run in recording.runs]
    even = [_even(run.time_s) for run in recording.runs]
    unit = recording.units.get(channel, "")
    # A jerk is a spike of rates; a pose has not moved yet.
    judged = [_calm(run) if unit.endswith("/s") else np.ones(len(run.time_s), bool)
              for run in recording.runs]  # fmt: skip
    flagged = [np.zeros(len(values), bool) for values in series]
    sizes: list[float] = []
    known = _fitted([_windows(v, e)[1] for v, e in zip(series, even, strict=True)])
    if known is None:
        return Outliers(channel, unit, tuple(flagged), None, np.zeros(0))
    for values, regular, own, calm in zip(series, even, flagged, judged, strict=True):
        sizes += _flag(values, regular, own, calm, known)
    # Without the outliers, which are gaps or predictions now.
    clean = [_windows(np.where(f, np.nan, v), e)[1]
             for v, e, f in zip(series, even, flagged, strict=True)]  # fmt: skip
    again = _fitted(clean) or known
    every = np.concatenate([again.errors(w[:, REACH], w) for w in clean])
    noise = float(np.sqrt(np.mean(every**2)) / again.gain) if every.size else None
    return Outliers(channel, unit, tuple(flagged), noise, np.array(sizes))


def _unwrapped(channel: str, values: FloatArray) -> FloatArray:
    """A copy, of angles that wind without jumps by a turn."""
    values = values.copy()
    if channel in _ANGLES:
        measured = np.isfinite(values)
        values[measured] = np.unwrap(values[measured])
    return values


def _even(time_s: FloatArray) -> BoolArray:
    """(n,) whether the samples about each one are spaced as most are."""
    steps = np.diff(time_s)
    odd = np.abs(steps - np.median(steps)) > 0.4 * np.median(steps)
    count = np.convolve(odd, np.ones(2 * REACH), "full")[: len(steps) + 2 * REACH - 1]
    around = np.r_[count, 0.0][REACH - 1 : REACH - 1 + len(time_s)]
    return np.asarray(around < 0.5)


def _calm(run: RecordedRun) -> BoolArray:
    """(n,) whether no jerk of a command may show in a sample: then a spike is no motion."""
    time_s, events = run.time_s, np.sort(np.r_[run.jumps_s, run.jerks_s])
    step = float(np.median(np.diff(time_s)))
    last = np.r_[-np.inf, events][np.searchsorted(events, time_s + step)]
    return np.asarray(time_s - last > SETTLED * step)


def _windows(values: FloatArray, even: BoolArray) -> tuple[np.ndarray, FloatArray]:
    """Indices (m,) of samples with all neighbours, and the windows (m, 2 REACH + 1)."""
    width = 2 * REACH + 1
    if len(values) < width:
        return np.zeros(0, int), np.zeros((0, width))
    every = np.lib.stride_tricks.sliding_window_view(values, width)
    at = np.flatnonzero(np.isfinite(every).all(axis=1) & even[REACH:-REACH])
    return at + REACH, every[at]


def _pairs(windows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of the nearest neighbours (m,), and by how much wider pairs' means differ from it."""
    offsets = np.arange(1, REACH + 1)
    sums = windows[:, REACH + offsets] + windows[:, REACH - offsets]
    near = 0.5 * sums[:, 0]
    return near, sums - sums[:, :1]


def _fitted(windows: Sequence[FloatArray]) -> _Interpolator | None:
    """The interpolator of largest robust likelihood; None with too few windows."""
    every = np.concatenate(windows)
    if len(every) < FEWEST:
        return None
    near, pairs = _pairs(every)
    target = every[:, REACH] - near
    weights = np.zeros(REACH)
    trust = np.ones(len(every))
    scale = 0.0
    for _ in range(ROUNDS):
        weights[1:] = np.linalg.lstsq(
            pairs[:, 1:] * np.sqrt(trust)[:, None], target * np.sqrt(trust), rcond=1e-10
        )[0]
        errors = target - pairs @ weights
        scale = max(float(np.median(np.abs(errors))) / _NORMAL, 1e-12)
        trust = np.maximum(1.0 - (errors / (BIWEIGHT * scale)) ** 2, 0.0) ** 2
    return _Interpolator(weights, scale)


def _flag(
    values: FloatArray, even: BoolArray, flagged: BoolArray, calm: BoolArray, known: _Interpolator
) -> list[float]:
    """Mark outliers of one run, put predictions in their places, and return their sizes."""
    sizes: list[float] = []
    for _ in range(len(values)):
        at, windows = _windows(values, even)
        errors = np.zeros(len(values))
        errors[at] = known.errors(windows[:, REACH], windows)
        found = False
        for i in np.argsort(-np.abs(errors)):
            if abs(errors[i]) < GATE * known.scale:
                break
            around = slice(max(i - REACH, 0), i + REACH + 1)
            if (
                not calm[i]
                or flagged[around].any()
                or abs(errors[i]) < np.abs(errors[around]).max()
            ):
                continue
            if _alone(values, errors[i], i, known):
                values[i] -= errors[i]
                flagged[i], found = True, True
                sizes.append(abs(float(errors[i])))
        if not found:
            return sizes
    return sizes


def _alone(values: FloatArray, error: float, i: int, known: _Interpolator) -> bool:
    """Whether the neighbours of a sample are well predicted once it is in line with them."""
    around = values[max(i - 2 * REACH, 0) : i + 2 * REACH + 1].copy()
    own = i - max(i - 2 * REACH, 0)
    around[own] -= error
    at, windows = _windows(around, np.ones(len(around), bool))
    left = known.errors(windows[:, REACH], windows)[at != own]
    local = float(np.sqrt(np.mean(left**2))) if left.size else 0.0
    return bool(abs(error) > GATE * max(known.scale, local))


def as_dict(found: Sequence[Outliers]) -> Mapping[str, Mapping[str, float | int | None]]:
    """What ``diagnosis.json`` holds under ``outliers``: by channel, where there are any."""
    return {
        one.channel: {
            "count": one.count,
            "share": one.share,
            "median_size": float(np.median(one.sizes)),
        }
        for one in found
        if one.count
    }
