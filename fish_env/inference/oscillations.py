"""Oscillations that meet each run in another phase, each run with a sine and a cosine of its own.

Runs begin at any time of a wave's period. With one phase for all of them, what the runs show adds
up to little; and where a vehicle goes along with a wave, or against it, it meets another frequency.
So frequencies and directions are scanned on a few runs, and the few best are tested on all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.around import turned
from fish_env.inference.changes import SETTINGS_AT_ONCE, residual_changes
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import spread_of
from fish_env.inference.hypotheses import CauseId, EffectName, EffectParameterId
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Cause, Probe, phase_of
from fish_env.inference.projection import Projector, Signal, in_parts

Alternative = tuple[Probe, ...]


def in_each_run(fit: Fit, projector: Projector, causes: Sequence[Cause]) -> list[Signal]:
    """The best alternative of each oscillation whose phase is a run's own.

    The scan compares what alternatives explain before a refit of the other parameters, which can
    only make each of them more significant. The p-value of the best allows for all that were tried.

    Args:
        fit: what is screened.
        projector: of the fit.
        causes: those to screen.
    """
    own = own_phases(fit) if fit.problem.run_count > 1 else frozenset()
    return [s for cause in causes if cause.id in own if (s := _best(fit, projector, cause))]


def own_phases(fit: Fit) -> frozenset[CauseId]:
    """Effects that oscillate with a phase that is one of the runs' own numbers.

    Args:
        fit: its noise model says which numbers runs have.
    """
    problem = fit.problem
    spreads = zip(problem.variations, spread_of(problem, fit.noise).tolist(), strict=True)
    own = {variation.beside for variation, sd in spreads if sd > 0.0}
    phases = {name: phase_of(effect) for name, effect in problem.known.items()}
    turning = {name: EffectParameterId(name, p) for name, p in phases.items() if p is not None}
    return frozenset(EffectName(id.effect) for id in turning.values() if id in own)


def _best(fit: Fit, projector: Projector, cause: Cause) -> Signal | None:
    scanned = turned(fit.problem.known[cause.effect], cause.probes)
    few = fit.problem.spread(POLICY.coarse_fit_runs)
    explained = [
        value
        for part in in_parts(scanned, len, SETTINGS_AT_ONCE)
        for value in _explained(fit, cause, part, few)
    ]
    leading = np.argsort(explained)[::-1][: POLICY.shortlist].tolist()
    signals = [_signal(fit, projector, cause, scanned[i]) for i in leading]
    tested = [replace(s, tries=len(scanned)) for s in signals if s is not None]
    return min(tested, key=lambda s: s.log_p, default=None)


def _explained(
    fit: Fit, cause: Cause, alternatives: Sequence[Alternative], runs: Sequence[int]
) -> list[float]:
    """What each alternative explains with sizes of its own in each run, nothing else moving."""
    jobs = [(cause.effect, probe) for probes in alternatives for probe in probes]
    columns = residual_changes(fit, jobs, runs=runs)
    own = np.isin(fit.linearised.run_of, runs)
    residuals, parts = fit.linearised.residuals[own], _slices(fit.linearised.run_of[own])
    ends = np.cumsum([len(probes) for probes in alternatives])[:-1]
    return [
        sum(_in_run(mine[run], residuals[run]) for run in parts)
        for mine in np.split(columns, ends, axis=1)
    ]


def _in_run(columns: FloatArray, residuals: FloatArray) -> float:
    info = columns.T @ columns
    if not np.isfinite(info).all() or np.any(np.diag(info) < POLICY.smallest_change):
        return 0.0
    score = columns.T @ residuals
    return float(score @ np.linalg.solve(info + 1e-9 * np.diag(np.diag(info)), score))


def _signal(fit: Fit, projector: Projector, cause: Cause, probes: Alternative) -> Signal | None:
    """The signal of an alternative, with sizes of its own in each run that it shows in."""
    columns = residual_changes(fit, [(cause.effect, probe) for probe in probes])
    parts = []
    for run in _slices(fit.linearised.run_of):
        energy = np.einsum("ij,ij->j", columns[run], columns[run])
        if np.all(energy > POLICY.smallest_change):
            part = np.zeros_like(columns)
            part[run] = columns[run]
            parts.append(part)
    if len(parts) < 2:
        return None
    whole = replace(cause, probes=(*cause.probes, probes * len(parts)))
    return projector.signal(whole, len(cause.probes), np.hstack(parts))


def _slices(run_of: IntArray) -> list[slice]:
    """Where the residuals of each run are, runs one after another."""
    edges = [0, *(np.flatnonzero(np.diff(run_of)) + 1).tolist(), len(run_of)]
    return [slice(a, b) for a, b in pairwise(edges)]


def with_columns(tests: Sequence[tuple[Cause, int]]) -> list[tuple[Cause, int, range]]:
    """Tests with the columns of their settings, which follow one another."""
    ends = np.cumsum([len(cause.probes[index]) for cause, index in tests]).tolist()
    rows = [range(first, end) for first, end in zip([0, *ends], ends, strict=False)]
    return [(cause, index, mine) for (cause, index), mine in zip(tests, rows, strict=True)]
