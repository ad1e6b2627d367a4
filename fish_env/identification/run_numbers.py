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
from fish_env.identification.runs import RunData
from fish_env.identification.sensor_errors import known_slopes
from fish_env.identification.variation import IN_SAMPLES, VARIATIONS
from fish_env.inference.problem import Point

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


def in_late_rows(problem: N, point: Point) -> N:
    """The problem with its samples in rows that suit how late devices are in all runs.

    Args:
        problem: the runs.
        point: values of the shared parameters.
    """
    late = problem.lane(point)[1].device_ages[:, 0]
    if all(np.array_equal(run.late, late) for run in problem.runs):
        return problem
    return problem.with_runs([run.with_late(late) for run in problem.runs])


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
    problem = in_late_rows(problem, point)
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
    changed = []
    for i, run in enumerate(runs):
        if not np.array_equal(_numbers([run])[0], values[i]):
            changed.append(i)
            runs[i] = run.with_numbers(own[i], errors[i])
    if not errors[changed][:, IN_SAMPLES].any():
        return runs
    moved, seen = [runs[i] for i in changed], [problem.runs[i] for i in changed]
    for _ in range(MOST_TURNS):
        filtered = problem.with_runs(seen).filtered(point, noise, (), True)
        turn = zip(moved, seen, filtered, strict=True)
        before, seen = seen, [_undone(run, s, f, problem.channels) for run, s, f in turn]
        if _agree(before, seen, problem.sensor_sd):
            break
    for i, run in zip(changed, seen, strict=True):
        runs[i] = run
    return runs


def _undone(run: RunData, seen: RunData, filtered: Filtered, channels: Sequence[str]) -> RunData:
    """A run with what its errors do to its samples, by the motion that these samples showed.

    Args:
        run: with its errors.
        seen: the run as its motion was filtered.
        filtered: that motion, with its slopes.
        channels: names of its channels.
    """
    slopes = known_slopes(seen, filtered, channels)
    return replace(run, distortion=_in_samples(slopes, run.sensor_errors))


def _moved(run: RunData, seen: RunData, filtered: Filtered, channels: Sequence[str]) -> RunData:
    """A run with what its errors do to its samples, by the change from other errors alone.

    Args:
        run: with its errors.
        seen: the run with other errors, and what they do to its samples.
        filtered: its motion, with its slopes.
        channels: names of its channels.
    """
    slopes = known_slopes(seen, filtered, channels)
    change = _in_samples(slopes, run.sensor_errors - seen.sensor_errors)
    return replace(run, distortion=change if seen.distortion is None else seen.distortion + change)


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
