"""Flaws of a recording that a file alone does not show: stuck sensors, and clocks that jump."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from fish_env.errors import DatasetError
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import RecordedRun

SIDE = 6
"""Samples on either side of a gap."""
_TURNING = ("roll", "yaw")


def check_stuck(place: str, run: RecordedRun, channel: str) -> None:
    """Refuse a stretch in which a sensor holds one value, or writes zeros for what it missed.

    Of a body at rest coarse digits show one value: not where nothing drives the vehicle.

    Raises:
        DatasetError: Names the channel, the value and the times.
    """
    measured = np.isfinite(run.channels[channel])
    values, time = run.channels[channel][measured], run.time_s[measured]
    if len(values) < 2 * RECORDINGS.fewest_stuck_samples:
        return
    steps = np.diff(values)
    coarse = len(np.unique(values)) < RECORDINGS.coarse_digits * len(values)
    at_rest = _during(run.still_s, time) & coarse
    begin, length = _longest_row((steps == 0.0) & ~(at_rest[1:] & at_rest[:-1]))
    rows = length + 1
    resting = run.from_rest and begin == 0
    if rows < RECORDINGS.fewest_stuck_samples or resting:
        return
    others = np.delete(steps, np.s_[begin : begin + length])
    repeated = max(float(np.mean(others == 0.0)) if others.size else 1.0, 1.0 / len(values))
    moving = np.abs(others[others != 0.0])
    by_chance = repeated**length * len(values)
    if by_chance > RECORDINGS.stuck_level or not moving.size:
        return
    beside = [steps[i] for i in (begin - 1, begin + length) if 0 <= i < len(steps)]
    if not beside or max(np.abs(beside)) < RECORDINGS.least_leap * np.median(moving):
        return
    raise DatasetError(
        f"{place}: {channel} is stuck at {values[begin]:g} for {rows} samples in a row, from t = "
        f"{time[begin]:.4g} s to {time[begin + length]:.4g} s; leave its cells empty there"
    )


def _during(stretches: FloatArray, time_s: FloatArray) -> BoolArray:
    """Which times (n,) lie within one of some stretches (k, 2)."""
    begin, end = stretches[:, :1], stretches[:, 1:]
    return np.asarray(((time_s >= begin) & (time_s <= end)).any(axis=0))


def _longest_row(same: BoolArray) -> tuple[int, int]:
    """Begin and length of the longest row of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int)))
    begins, ends = edges[::2], edges[1::2]
    if not begins.size:
        return 0, 0
    longest = int(np.argmax(ends - begins))
    return int(begins[longest]), int(ends[longest] - begins[longest])


def check_clock_jumps(place: str, run: RecordedRun) -> None:
    """Refuse a gap across which the motion goes on as if no time had passed.

    Raises:
        DatasetError: Names the time.
    """
    times = run.time_s
    step = float(np.median(np.diff(times)))
    for index in np.flatnonzero(np.diff(times) > RECORDINGS.clock_gap * step):
        span = float(times[index + 1] - times[index])
        verdicts = [_goes_on(run, name, times[index], span, step) for name in run.channels]
        known = [v for v in verdicts if v is not None]
        if len(known) >= 2 and all(fits for fits, _ in known) and any(moved for _, moved in known):
            raise DatasetError(
                f"{place}: the clock jumps by {span:.4g} s at t = {times[index]:.4g} s, but the "
                "motion continues as if no time had passed; correct the clock, or split the run"
            )


def _goes_on(
    run: RecordedRun, channel: str, at: float, span: float, step: float
) -> tuple[bool, bool] | None:
    """Whether a channel goes on as after one step, and whether it moves in such a time elsewhere.

    A line through the samples before and one through those after meet half a step from each. None
    where there are too few samples.
    """
    measured = np.isfinite(run.channels[channel])
    time, values = run.time_s[measured], run.channels[channel][measured]
    if channel in _TURNING:
        values = np.unwrap(values)
    first = int(np.searchsorted(time, at, side="right"))
    if first < SIDE or first + SIDE > len(time):
        return None
    before, after = slice(first - SIDE, first), slice(first, first + SIDE)
    left, left_error = _extrapolated(time[before], values[before], time[first - 1] + 0.5 * step)
    right, right_error = _extrapolated(time[after], values[after], time[first] - 0.5 * step)
    error = float(np.hypot(left_error, right_error))
    later = np.searchsorted(time, time + span)
    pairs = np.flatnonzero(later < len(time))
    if not pairs.size or error == 0.0:
        return None
    usual = float(np.median(np.abs(values[later[pairs]] - values[pairs])))
    fits = abs(right - left) < RECORDINGS.clock_jump_fits_sd * error
    return fits, usual > RECORDINGS.clock_jump_excludes_sd * error


def _extrapolated(time: FloatArray, values: FloatArray, at: float) -> tuple[float, float]:
    """Value of a parabola at a time, and its standard error."""
    t = (time - at) / max(float(np.ptp(time)), 1e-12)
    design = np.vander(t, 3)
    solution, *_ = np.linalg.lstsq(design, values, rcond=None)
    left = values - design @ solution
    variance = float(left @ left) / (len(values) - 3)
    return float(solution[-1]), float(np.sqrt(variance * np.linalg.pinv(design.T @ design)[-1, -1]))
