"""Outliers of a channel, and a bound on its white noise, by interpolation from the samples around.

A step or kink of the motion is badly predicted from both sides; an outlier stands alone: put the
prediction in its place, and its neighbours are predicted well again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from fish_env.rigidbody.interpolation import (
    REACH,
    Interpolator,
    evenly_spaced,
    interpolator_of,
    windows_of,
    without_turns,
)
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import RecordedRun, Recording


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


def outliers_of(recording: Recording) -> tuple[Outliers, ...]:
    """Outliers of every channel of a recording, in its order."""
    return tuple(_outliers(recording, channel) for channel in recording.channels)


def _outliers(recording: Recording, channel: str) -> Outliers:
    series = [without_turns(channel, run.channels[channel]) for run in recording.runs]
    even = [evenly_spaced(run.time_s) for run in recording.runs]
    unit = recording.units.get(channel, "")
    # A jerk is a spike of rates; a pose has not moved yet.
    judged = [_calm(run) if unit.endswith("/s") else np.ones(len(run.time_s), bool)
              for run in recording.runs]  # fmt: skip
    flagged = [np.zeros(len(values), bool) for values in series]
    sizes: list[float] = []
    known = interpolator_of([windows_of(v, e)[1] for v, e in zip(series, even, strict=True)])
    if known is None:
        return Outliers(channel, unit, tuple(flagged), None, np.zeros(0))
    for values, regular, own, calm in zip(series, even, flagged, judged, strict=True):
        sizes += _flag(values, regular, own, calm, known)
    # Without the outliers, which are gaps or predictions now.
    clean = [windows_of(np.where(f, np.nan, v), e)[1]
             for v, e, f in zip(series, even, flagged, strict=True)]  # fmt: skip
    again = interpolator_of(clean) or known
    every = np.concatenate([again.errors(w) for w in clean])
    gate = RECORDINGS.outlier_gate_sd * again.scale
    every = every[np.abs(every) < gate]  # not jerks, nor outliers side by side
    noise = float(np.sqrt(np.mean(every**2)) / again.gain) if every.size else None
    return Outliers(channel, unit, tuple(flagged), noise, np.array(sizes))


def _calm(run: RecordedRun) -> BoolArray:
    """(n,) whether no jerk of a command may show in a sample: then a spike is no motion."""
    time_s, events = run.time_s, np.sort(np.r_[run.jumps_s, run.jerks_s])
    step = float(np.median(np.diff(time_s)))
    last = np.r_[-np.inf, events][np.searchsorted(events, time_s + step)]
    return np.asarray(time_s - last > RECORDINGS.jump_settles_samples * step)


def _flag(
    values: FloatArray, even: BoolArray, flagged: BoolArray, calm: BoolArray, known: Interpolator
) -> list[float]:
    """Mark outliers of one run, put predictions in their places, and return their sizes."""
    sizes: list[float] = []
    for _ in range(len(values)):
        at, windows = windows_of(values, even)
        errors = np.zeros(len(values))
        errors[at] = known.errors(windows)
        found = False
        for i in np.argsort(-np.abs(errors)):
            if abs(errors[i]) < RECORDINGS.outlier_gate_sd * known.scale:
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


def _alone(values: FloatArray, error: float, i: int, known: Interpolator) -> bool:
    """Whether the neighbours of a sample are well predicted once it is in line with them."""
    around = values[max(i - 2 * REACH, 0) : i + 2 * REACH + 1].copy()
    own = i - max(i - 2 * REACH, 0)
    around[own] -= error
    at, windows = windows_of(around, np.ones(len(around), bool))
    left = known.errors(windows)[at != own]
    local = float(np.sqrt(np.mean(left**2))) if left.size else 0.0
    return bool(abs(error) > RECORDINGS.outlier_gate_sd * max(known.scale, local))


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
