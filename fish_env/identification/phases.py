"""The tail's phase at the start of a run, where the record does not say: the likeliest of many.

The filter follows a phase that is nearly right by itself; one that is half a beat off it never
puts right. So each run's beginning is filtered from phases all round and then around the best.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Protocol, TypeVar

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Measurement, RunFilter
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.runs import FREQUENCY, RunData
from fish_env.identification.state_blocks import PHASE_COLUMN
from fish_env.identification.variation import START
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point

COARSE = np.arange(24, dtype=np.float64) * (np.pi / 12.0)
FINE = np.arange(-2, 3, dtype=np.float64) * 0.065
NEAR = np.arange(-3, 4, dtype=np.float64) * (np.pi / 12.0)
"""Phases tried: all round, then around the best (rad); around the present one instead, where a
change of the parameters by what an effect usually is does not turn it further."""
COARSE_SD, FINE_SD = 0.15, 0.08
"""How far the filter may take the phase to be off (rad). Where that is much, the first samples turn
it by what else they do not fit, and it has been settled wrongly before they are understood."""
WINDOW_S = 3.0
AMPLITUDE, PHASE = 1, 13


class Filtering(Protocol):
    """Runs and the filter on them."""

    runs: tuple[RunData, ...]
    channels: tuple[str, ...]

    def lane(self, point: Point) -> tuple[FloatArray, Measurement]:
        """Parameter record (parameters, 1) of a point, and what its sensors do."""
        ...

    def filter_for(self, effects: Iterable[EffectParameterId]) -> RunFilter:
        """The quickest filter that computes with these effect parameters."""
        ...

    def with_runs(self: S, runs: Sequence[RunData]) -> S:
        """The same on other runs."""
        ...


S = TypeVar("S", bound=Filtering)


def settle_phases(problem: S, point: Point, noise: NoiseModel, nearby: bool = False) -> S:
    """The problem with the likeliest starting phase of every run whose phase is unknown.

    Where runs have numbers of their own, one of these is the phase: once a beginning has told it
    roughly, the whole run tells it better, and it is only taken on from there.

    Args:
        problem: its runs' own phases are used only as centres of what is near them.
        point: parameters to judge by.
        noise: noise model to judge by.
        nearby: try only phases near those of the runs, and all where the outermost is best.
    """
    unknown = [i for i, run in enumerate(problem.runs) if not run.phase_known]
    if not unknown:
        return problem
    runs = list(problem.runs)
    if noise.spread[START] > 0.0:
        for i in unknown:
            runs[i] = _taken_on(runs[i])
        unknown = [i for i in unknown if not runs[i].phase_found]
        if not unknown:
            return problem.with_runs(runs)
    own = [runs[i] for i in unknown]
    found = _nearest(problem, point, noise, own) if nearby else None
    if found is None:
        found = _likeliest(problem, point, noise, [(run, COARSE) for run in own], COARSE_SD)
    close = [(runs[i], phase + FINE) for i, phase in zip(unknown, found, strict=True)]
    for i, phase in zip(unknown, _likeliest(problem, point, noise, close, FINE_SD), strict=True):
        runs[i] = _starting(runs[i], phase, FINE_SD)
    return problem.with_runs(runs)


def _nearest(
    problem: Filtering, point: Point, noise: NoiseModel, runs: Sequence[RunData]
) -> list[float] | None:
    """The likeliest phase near each run's own; None where one is not between those tried."""
    begun = [float(run.state0[PHASE]) for run in runs]
    tried = [(run, phase + NEAR) for run, phase in zip(runs, begun, strict=True)]
    found = _likeliest(problem, point, noise, tried, COARSE_SD)
    reach = 0.99 * NEAR[-1]
    inside = [abs(phase - own) < reach for phase, own in zip(found, begun, strict=True)]
    return found if all(inside) else None


def _likeliest(
    problem: Filtering,
    point: Point,
    noise: NoiseModel,
    tried: Sequence[tuple[RunData, FloatArray]],
    spread: float,
) -> list[float]:
    """The likeliest of the phases tried for each run."""
    trials = [_starting(_beginning(run), phase, spread) for run, own in tried for phase in own]
    judge = RunFilter(problem.filter_for(point.effects).model, trials, problem.channels)
    record, measurement = problem.lane(point)
    values = [r.log_likelihood for r in judge.run(record, measurement, noise)]
    best = np.argmax(np.reshape(values, (len(tried), -1)), axis=1)
    return [float(own[i]) for (_, own), i in zip(tried, best, strict=True)]


def _starting(run: RunData, phase: float, spread: float) -> RunData:
    """The run with a starting phase (rad), known to within a spread (rad)."""
    state, covariance = run.state0.copy(), run.covariance0.copy()
    state[PHASE] = phase
    covariance[PHASE_COLUMN, PHASE_COLUMN] = spread**2
    return replace(run, state0=state, covariance0=covariance, phase_found=True)


def _taken_on(run: RunData) -> RunData:
    """The run with its own number for the phase in its initial state."""
    if not (run.phase_found and run.variation[START]):
        return run
    state, variation = run.state0.copy(), run.variation.copy()
    state[PHASE] += variation[START]
    variation[START] = 0.0
    return replace(run, state0=state, variation=variation)


def _beginning(run: RunData) -> RunData:
    """The beginning of a run, up to some seconds after its tail starts to beat."""
    beats = run.command_values[:, AMPLITUDE] * run.command_values[:, FREQUENCY] > 0
    first = max(0.0, float(run.command_times[np.argmax(beats)])) if beats.any() else 0.0
    return run.until(first + WINDOW_S)
