"""The tail's phase at the start of a run, where the record does not say: the likeliest of twelve.

The filter follows a phase that is roughly right by itself; one that is half a beat off it never
puts right. So each run's beginning is filtered from twelve phases, and the likeliest is kept.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fish_env.identification.filtering import NoiseModel, RunFilter
from fish_env.identification.problem import Point, Problem
from fish_env.identification.runs import FREQUENCY, RunData

PHASES = 12
WINDOW_S = 3.0
AMPLITUDE, PHASE = 1, 13


def settle_phases(problem: Problem, point: Point, noise: NoiseModel) -> Problem:
    """The problem with the likeliest starting phase of every run whose phase is unknown.

    Args:
        problem: its runs' own phases are not used.
        point: parameters to judge by.
        noise: noise model to judge by.
    """
    unknown = [i for i, run in enumerate(problem.runs) if not run.phase_known]
    if not unknown:
        return problem
    trials = [trial for i in unknown for trial in _trials(problem.runs[i])]
    judge = RunFilter(problem.filter_for(point.effects).model, trials, problem.channels)
    record, measurement = problem.lane(point)
    corners = problem.has_corners(point.effects)
    values = [r.log_likelihood for r in judge.run(record, measurement, noise, corners=corners)]
    best = np.argmax(np.reshape(values, (-1, PHASES)), axis=1)
    runs = list(problem.runs)
    for n, i in enumerate(unknown):
        runs[i] = replace(runs[i], state0=trials[n * PHASES + int(best[n])].state0)
    return problem.with_runs(runs)


def _trials(run: RunData) -> list[RunData]:
    """The beginning of a run, up to some seconds after its tail starts to beat, in all phases."""
    beats = run.command_values[:, AMPLITUDE] * run.command_values[:, FREQUENCY] > 0
    first = max(0.0, float(run.command_times[np.argmax(beats)])) if beats.any() else 0.0
    count = max(2, int(np.searchsorted(run.clock, first + WINDOW_S, side="right")))
    trials = []
    for phase in np.arange(PHASES) * 2.0 * np.pi / PHASES:
        state = run.state0.copy()
        state[PHASE] = phase
        short = replace(
            run,
            clock=run.clock[:count],
            substeps=run.substeps[:count],
            measured=np.ascontiguousarray(run.measured[:count]),
            state0=state,
        )
        trials.append(short)
    return trials
