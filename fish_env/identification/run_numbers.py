"""Runs with other numbers of their own, and what errors of sensors then do to their samples.

What an error does to the samples follows from the motion, and the estimated motion from the samples
without it. The two are worked out in turns until they agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol, Self, TypeVar

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Filtered, Measurement
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.predicted_motion import predicted_motion
from fish_env.identification.runs import RunData
from fish_env.identification.sensor_errors import known_slopes
from fish_env.identification.shared_filter import smoothing
from fish_env.identification.variation import IN_SAMPLES, VARIATIONS
from fish_env.inference.problem import Point
from fish_env.sensing.devices import seen_cutoff

MOST_TURNS, AGREED = 6, 0.05
"""In which errors and motion are worked out, and what they may differ by, in units of the noise."""


class Numbered(Protocol):
    """Runs with numbers of their own, and the filter on them."""

    runs: tuple[RunData, ...]
    channels: tuple[str, ...]
    sensor_sd: FloatArray

    def filtered(
        self, point: Point, noise: NoiseModel, near: Sequence[Filtered], keep_slopes: bool
    ) -> list[Filtered]:
        """Every run filtered."""
        ...

    def lane(self, point: Point) -> tuple[FloatArray, Measurement]:
        """Parameters, and what the sensors do, at a point."""
        ...

    def with_runs(self, runs: Sequence[RunData]) -> Self:
        """The same on other runs."""
        ...


N = TypeVar("N", bound=Numbered)


def as_devices_record(problem: N, point: Point, noise: NoiseModel) -> N:
    """The problem with samples as devices record them that are late and smooth in all runs alike.

    Args:
        problem: the runs.
        point: values of the shared parameters.
        noise: noise model.

    Raises:
        LinAlgError: the simulation diverges where a filter asks for its motion.
    """
    moved = _in_late_rows(problem, point)
    if not any(run.is_smoothed for run in (*moved.runs, *problem.runs)):
        return moved
    runs = renumbered(problem, _numbers(problem.runs), point, noise)
    same = all(a is b for a, b in zip(runs, problem.runs, strict=True))
    return problem if same else problem.with_runs(runs)


def _in_late_rows(problem: N, point: Point) -> N:
    """The problem with its samples in rows that suit how late devices are in all runs."""
    sensors = problem.lane(point)[1]
    late = sensors.device_ages[:, 0]
    cutoff = seen_cutoff(np.inf if sensors.cutoff is None else float(sensors.cutoff[0]))
    if all(np.array_equal(run.late, late) and run.cutoff_hz == cutoff for run in problem.runs):
        return problem
    return problem.with_runs([run.with_devices(late, cutoff) for run in problem.runs])


def renumbered(
    problem: Numbered,
    values: FloatArray,
    point: Point,
    noise: NoiseModel,
    near: Sequence[Filtered | None] = (),
) -> list[RunData]:
    """The runs with other numbers. A run that keeps its numbers stays as it is.

    Args:
        problem: the runs.
        values: (R, K) the numbers.
        point: values of the shared parameters.
        noise: noise model.
        near: the runs filtered at numbers close by, with their slopes; what other errors do to
            samples then changes as that motion says, and where all runs keep their numbers it comes
            nearer to what that motion says, unless it agrees already. None of a run that stays as
            it is.

    Raises:
        LinAlgError: a number is not finite, or the simulation diverges.
    """
    if not np.isfinite(values).all():
        raise np.linalg.LinAlgError("numbers of runs have diverged")
    filters = [run.cutoff_hz for run in problem.runs]
    problem = _in_late_rows(problem, point)
    runs = list(problem.runs)
    own, errors = np.split(values, [len(VARIATIONS)], axis=1)
    if near:
        numbered = [run.with_numbers(*n) for run, *n in zip(runs, own, errors, strict=True)]
        kept = np.array_equal(values, _numbers(runs))
        change = _undone if kept else _moved
        triples = zip(numbered, runs, near, strict=True)
        found = [
            before if f is None else change(run, before, f, problem.channels)
            for run, before, f in triples
        ]
        return runs if kept and _agree(runs, found, problem.sensor_sd) else found
    follow: list[int] = []
    for i, run in enumerate(problem.runs):
        same = filters[i] == run.cutoff_hz and np.array_equal(_numbers([run])[0], values[i])
        if not same:
            runs[i] = run.with_numbers(own[i], errors[i])
        if run.is_smoothed or (not same and errors[i, IN_SAMPLES].any()):
            follow.append(i)
    put_right = _put_right(problem, [runs[i] for i in follow], follow, point, noise)
    for i, run in zip(follow, put_right, strict=True):
        runs[i] = run
    return runs


def _put_right(
    problem: Numbered, moved: Sequence[RunData], at: Sequence[int], point: Point, noise: NoiseModel
) -> list[RunData]:
    """Runs with what errors and filters do to their samples, by the motion these then show.

    Args:
        problem: all runs, as they were.
        moved: some of them with other numbers; one that is as it was stays so if it agrees.
        at: places of these among all runs.
        point: values of the shared parameters.
        noise: noise model.

    Raises:
        LinAlgError: the simulation diverges.
    """
    seen = first = [problem.runs[i] for i in at]
    for turn in range(MOST_TURNS if at else 0):
        filtered = problem.with_runs(seen).filtered(point, noise, (), True)
        each = zip(moved, seen, filtered, strict=True)
        before, seen = seen, [_undone(run, s, f, problem.channels) for run, s, f in each]
        if _agree(before, seen, problem.sensor_sd):
            if turn == 0:
                pairs = zip(moved, first, seen, strict=True)
                seen = [own if own is run else other for own, run, other in pairs]
            break
    return seen


def _undone(run: RunData, seen: RunData, filtered: Filtered, channels: Sequence[str]) -> RunData:
    """A run with what its errors do to its samples, by the motion that these samples showed.

    Args:
        run: with its errors.
        seen: the run as its motion was filtered.
        filtered: that motion, with its slopes.
        channels: names of its channels.
    """
    if not run.is_smoothed:
        slopes = known_slopes(seen, filtered, channels)
        return replace(run, distortion=_in_samples(slopes, run.sensor_errors))
    found = smoothing(run, predicted_motion(run.clock, filtered), channels)
    if run.sensor_errors[IN_SAMPLES].any():
        found += _in_samples(known_slopes(seen, filtered, channels), run.sensor_errors)
    return replace(run, distortion=found)


def _moved(run: RunData, seen: RunData, filtered: Filtered, channels: Sequence[str]) -> RunData:
    """A run with what its errors do to its samples, by the change from other errors alone.

    Args:
        run: with its errors.
        seen: the run with other errors, and what they do to its samples.
        filtered: its motion, with its slopes.
        channels: names of its channels.
    """
    slopes = known_slopes(seen, filtered, channels)
    found = _in_samples(slopes, run.sensor_errors - seen.sensor_errors)
    if seen.distortion is not None:
        found += seen.distortion
    return replace(run, distortion=seen.moved_on(found, run.moved))


def _in_samples(slopes: FloatArray, errors: FloatArray) -> FloatArray:
    """What errors (K,) with slopes (T, C, K) do to samples (T, C) beside what the filter knows."""
    return np.asarray(slopes[:, :, IN_SAMPLES] @ errors[IN_SAMPLES])


def _numbers(runs: Sequence[RunData]) -> FloatArray:
    """(R, K) numbers of runs."""
    return np.array([np.r_[run.variation, run.sensor_errors] for run in runs])


def _agree(before: Sequence[RunData], after: Sequence[RunData], sensor_sd: FloatArray) -> bool:
    """Whether samples of runs are the same, but for a small part of the noise (C,)."""
    return max(_apart(*pair, sensor_sd) for pair in zip(before, after, strict=True)) < AGREED


def _apart(before: RunData, after: RunData, sensor_sd: FloatArray) -> float:
    """Root mean square of what the same samples differ by, in units of the noise (C,)."""
    apart = (before.corrected - after.corrected) / sensor_sd
    return float(np.sqrt(np.nanmean(apart**2)))
