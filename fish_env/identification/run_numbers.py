"""Runs with other numbers of their own, and what errors of sensors then do to their samples.

An error that moves samples far, as a filter in an inertial unit, is not linear in the recorded
motion. Taken off the samples it is, in the motion that they then show. The two follow from each
other, and are worked out in turns until they agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Filtered
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.runs import RunData
from fish_env.identification.sensor_errors import sensor_slopes
from fish_env.identification.variation import VARIATIONS
from fish_env.inference.problem import Point

MOST_TURNS, AGREED = 4, 0.05
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

    def with_runs(self, runs: Sequence[RunData]) -> Numbered:
        """The same on other runs."""
        ...


def renumbered(
    problem: Numbered,
    values: FloatArray,
    point: Point,
    noise: NoiseModel,
    near: Sequence[Filtered] = (),
) -> list[RunData]:
    """The runs with other numbers. A run that keeps its numbers stays as it is.

    Args:
        problem: the runs.
        values: (R, K) the numbers.
        point: values of the shared parameters.
        noise: noise model.
        near: the runs filtered at numbers close by, with their slopes; what errors do to samples
            then follows from that motion, also where a run keeps its numbers.
    """
    runs = list(problem.runs)
    own, errors = np.split(values, [len(VARIATIONS)], axis=1)
    if near:
        every = zip(runs, own, errors, near, strict=True)
        return [_undone(r.with_numbers(o, e), f, problem.channels) for r, o, e, f in every]
    changed = []
    for i, run in enumerate(runs):
        if not np.array_equal(np.r_[run.variation, run.sensor_errors], values[i]):
            changed.append(i)
            runs[i] = run.with_numbers(own[i], errors[i])
    if not errors[changed].any():
        return runs
    moved, seen = [runs[i] for i in changed], [problem.runs[i] for i in changed]
    for _ in range(MOST_TURNS):
        filtered = problem.with_runs(seen).filtered(point, noise, (), True)
        pairs = zip(moved, filtered, strict=True)
        before, seen = seen, [_undone(run, one, problem.channels) for run, one in pairs]
        apart = [_apart(*p, problem.sensor_sd) for p in zip(before, seen, strict=True)]
        if max(apart) < AGREED:
            break
    for i, run in zip(changed, seen, strict=True):
        runs[i] = run
    return runs


def _undone(run: RunData, filtered: Filtered, channels: Sequence[str]) -> RunData:
    """A run with what its errors do to its samples, at its filtered motion."""
    slopes = sensor_slopes(run.clock, filtered, channels)
    return replace(run, distortion=slopes @ run.sensor_errors)


def _apart(before: RunData, after: RunData, sensor_sd: FloatArray) -> float:
    """Root mean square of what the same samples differ by, in units of the noise (C,)."""
    apart = (before.corrected - after.corrected) / sensor_sd
    return float(np.sqrt(np.nanmean(apart**2)))
