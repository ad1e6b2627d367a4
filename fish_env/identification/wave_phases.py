"""The phase in which a wave meets each run: the likeliest of a circle of them.

Runs begin at any time of the wave's period. From a phase more than a quarter of a period off, a fit
would let the wave fade instead of turning it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol, TypeVar

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.by_run import squares_by_run
from fish_env.identification.filtering import Filtered, Measurement, RunFilter
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.runs import RunData
from fish_env.identification.variation import COUNT, WAVE
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point

AMPLITUDE = EffectParameterId("wave", "amplitude")
TURNS = np.arange(12, dtype=np.float64) * (np.pi / 6.0)
"""Tried beside a run's own phase (rad): a fit comes from half of such a step to any phase."""


class Waving(Protocol):
    """Runs, and the filter on them."""

    runs: tuple[RunData, ...]

    def lanes(
        self, z: FloatArray, effects: Mapping[EffectParameterId, FloatArray]
    ) -> tuple[FloatArray, Measurement]:
        """Parameter records (parameters, N) and what the sensors do, for N points."""
        ...

    def filter_for(self, effects: Iterable[EffectParameterId]) -> RunFilter:
        """The quickest filter that computes with these effect parameters."""
        ...

    def filtered(self, point: Point, noise: NoiseModel) -> list[Filtered]:
        """Every run filtered."""
        ...

    def with_runs(self: W, runs: Sequence[RunData]) -> W:
        """The same on other runs."""
        ...


W = TypeVar("W", bound=Waving)


def settle_wave_phases(problem: W, point: Point, noise: NoiseModel) -> W:
    """The problem with the likeliest phase of the wave in every run.

    Only where there is a wave, and runs have numbers of their own. The gains of the filter are held
    while phases are compared.

    Args:
        problem: the runs, with the phases that they have.
        point: parameters to judge by.
        noise: noise model to judge by, with the spread of the phases.
    """
    if not (noise.spread[WAVE] > 0.0 and point.effects.get(AMPLITUDE, 0.0) != 0.0):
        return problem
    count = len(TURNS)
    more = np.zeros((COUNT, count))
    more[WAVE] = TURNS
    effects = {id: np.full(count, value) for id, value in point.effects.items()}
    lanes = problem.lanes(np.repeat(point.z[:, None], count, axis=1), effects)
    filtered = problem.filtered(point, noise)
    judge = problem.filter_for(effects)
    rows = judge.innovations(*lanes, noise, filtered, variation=more)
    runs = []
    for run, left in zip(problem.runs, squares_by_run(rows, problem.runs).T, strict=True):
        phases = _around_zero(run.variation[WAVE] + TURNS)
        likeliest = int(np.argmin(left + (phases / noise.spread[WAVE]) ** 2))
        runs.append(_in_phase(run, float(phases[likeliest])) if likeliest else run)
    return problem.with_runs(runs)


def _around_zero(phases: FloatArray) -> FloatArray:
    """The same phases within half a turn of zero (rad)."""
    return np.asarray((phases + np.pi) % (2.0 * np.pi) - np.pi)


def _in_phase(run: RunData, phase: float) -> RunData:
    variation = run.variation.copy()
    variation[WAVE] = phase
    return replace(run, variation=variation)
