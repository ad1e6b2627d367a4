"""Recorded runs on even grids, on which many readings of the columns are tried at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.rigidbody.recording import RecordedRun, Recording

BRIDGED_S, BRIDGED_STEPS = 0.35, 3.5
"""s, and usual intervals: the longer of the two is the longest gap that is interpolated."""
FEWEST = 4
"""Samples of a channel that a run needs to be interpolated."""
LARGEST = 4000
"""Points of a run's grid; a run with more samples is read more coarsely."""
WINDING = ("roll", "yaw")


@dataclass(frozen=True, eq=False)
class GridRun:
    """One run on an even grid.

    Attributes:
        id: its name.
        begin_s: time of the first point on the run's own clock, s.
        step_s: interval, s.
        channels: values by channel, each (n,), NaN in gaps; angles that wind are unwrapped.
    """

    id: str
    begin_s: float
    step_s: float
    channels: Mapping[str, FloatArray]

    @cached_property
    def size(self) -> int:
        """Number of points."""
        return len(next(iter(self.channels.values())))

    @property
    def since_s(self) -> FloatArray:
        """(n,) time since the run began, s."""
        return self.step_s * np.arange(self.size, dtype=np.float64)

    def steps(self, seconds: float) -> int:
        """The whole number of intervals that is nearest to a time, at least one."""
        return max(1, round(seconds / self.step_s))


def gridded(recording: Recording) -> tuple[GridRun, ...]:
    """All runs on even grids, each at its usual interval."""
    return tuple(grid_run(run) for run in recording.runs)


def grid_run(run: RecordedRun) -> GridRun:
    """One run on an even grid."""
    step = float(np.median(np.diff(run.time_s)))
    lasts = float(run.time_s[-1] - run.time_s[0])
    step = max(step, lasts / LARGEST)
    at = run.time_s[0] + step * np.arange(int(lasts / step + 1e-6) + 1)
    channels = {name: _interpolated(run, name, at, step) for name in run.channels}
    return GridRun(run.id, float(run.time_s[0]), step, channels)


def _interpolated(run: RecordedRun, name: str, at: FloatArray, step: float) -> FloatArray:
    values = run.channels[name]
    measured = np.isfinite(values)
    if measured.sum() < FEWEST:
        return np.full(len(at), np.nan)
    time, known = run.time_s[measured], values[measured]
    if name in WINDING:
        known = np.unwrap(known)
    result = np.interp(at, time, known, left=np.nan, right=np.nan)
    longest = max(BRIDGED_S, BRIDGED_STEPS * step)
    after = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    result[time[after] - time[after - 1] > longest] = np.nan
    return result


def grown(values: FloatArray, stride: int) -> FloatArray:
    """Increase over a stride of intervals, NaN where it cannot be told, (n - stride,)."""
    if len(values) <= stride:
        return np.zeros(0)
    increase: FloatArray = values[stride:] - values[:-stride]
    return increase


def integrated(run: GridRun, rate: FloatArray, stride: int) -> FloatArray:
    """Integral of a rate over a stride of intervals by the trapezoidal rule, (n - stride,)."""
    if len(rate) <= stride:
        return np.zeros(0)
    measured = np.isfinite(rate)
    known = np.where(measured, rate, 0.0)
    path = run.step_s * np.concatenate([[0.0], np.cumsum(0.5 * (known[1:] + known[:-1]))])
    missing = np.concatenate([[0], np.cumsum(~measured)])
    gaps = missing[stride + 1 :] - missing[: -stride - 1]
    return np.where(gaps == 0, path[stride:] - path[:-stride], np.nan)


def averaged(values: FloatArray, stride: int) -> FloatArray:
    """Mean over a stride of intervals, NaN where a value is missing, (n - stride,)."""
    if len(values) <= stride:
        return np.zeros(0)
    total = np.concatenate([[0.0], np.cumsum(np.where(np.isfinite(values), values, 0.0))])
    missing = np.concatenate([[0], np.cumsum(~np.isfinite(values))])
    count = stride + 1
    mean = (total[count:] - total[:-count]) / count
    return np.where(missing[count:] == missing[:-count], mean, np.nan)
