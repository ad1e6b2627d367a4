"""What settings of effects change in the residuals of a fit, by simulating them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import diverged
from fish_env.inference.estimate.run_variation import Marginal
from fish_env.inference.hypotheses import effects_of
from fish_env.inference.probes import Probe, effect_values
from fish_env.inference.problem import Problem

LANES_AT_ONCE = 96
SETTINGS_AT_ONCE = LANES_AT_ONCE - 1
"""One lane is that of the fit itself."""
Jobs = Sequence[tuple[str, Probe]]
"""Effects and their settings."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of a fit, or some of them.

    Attributes:
        fit: the fit.
        comparing: its problem in the steps that causes are compared in.
        problem: the same in its own steps.
        filtered: evaluation of the runs.
        marginal: integrates out what they differ in; None for nothing.
        count: number of their residuals.
    """

    fit: Fit
    comparing: Problem
    problem: Problem
    filtered: Sequence[Any]
    marginal: Marginal | None
    count: int

    @classmethod
    def of(cls, fit: Fit, runs: Sequence[int] | None = None) -> Runs:
        """All runs of a fit, or those of some numbers."""
        lin, problem, comparing = fit.linearised, fit.problem, fit.comparing
        if runs is None:
            all_of_them = fit.filtered, lin.marginal, len(lin.residuals)
            return cls(fit, comparing, problem, *all_of_them)
        own = problem.some(runs)
        long = own if comparing is problem else comparing.some(runs)
        filtered = [fit.filtered[i] for i in runs]
        marginal = None if lin.marginal is None else lin.marginal.some(runs)
        return cls(fit, long, own, filtered, marginal, int(np.isin(lin.run_of, runs).sum()))


def residual_changes(
    fit: Fit, jobs: Jobs, z: FloatArray | None = None, runs: Sequence[int] | None = None
) -> FloatArray:
    """Change of the residuals (D, n) with each setting of an effect.

    Not a number where the simulation diverges.

    Args:
        fit: what the change is from.
        jobs: effect and setting, n of them.
        z: (coefficients, n) where to simulate each; default: where the fit is.
        runs: numbers of the runs whose residuals are asked for; default: all.
    """
    if z is None:
        z = np.repeat(fit.point.z[:, None], len(jobs), axis=1)
    own = Runs.of(fit, runs)
    rows = _of_kinds(own, own.comparing, jobs, z)
    lost = np.flatnonzero(diverged(rows)).tolist()
    if lost and own.comparing is not own.problem:
        rows[lost] = _of_kinds(own, own.problem, [jobs[i] for i in lost], z[:, lost])
    rows[diverged(rows)] = np.nan
    return (rows if own.marginal is None else own.marginal.rows(rows)).T


def _of_kinds(own: Runs, problem: Problem, jobs: Jobs, z: FloatArray) -> FloatArray:
    """The changes (n, D) of all jobs, each computed by the quickest kernel that can."""
    rows = np.empty((len(jobs), own.count))
    for alike in kinds(own.fit, [name for name, _ in jobs], len(jobs)):
        for first in range(0, len(alike), SETTINGS_AT_ONCE):
            part = alike[first : first + SETTINGS_AT_ONCE]
            rows[part] = _at_once(own, problem, [jobs[i] for i in part], z[:, part])
    return rows


def kinds(fit: Fit, names: Sequence[str], settings: int) -> list[list[int]]:
    """Numbers of effects that one kernel computes, so that none pays for effects of another kind.

    A few settings stay together: kernels take whole blocks of lanes, however few are filled.
    """
    if settings <= SETTINGS_AT_ONCE:
        return [list(range(len(names)))]
    found: dict[object, list[int]] = {}
    for i, name in enumerate(names):
        key = fit.problem.batch_key([*effects_of(fit.point.effects), name])
        found.setdefault(key, []).append(i)
    return list(found.values())


def _at_once(own: Runs, problem: Problem, jobs: Jobs, z: FloatArray) -> FloatArray:
    point = own.fit.point
    base = {**problem.neutral(dict.fromkeys(name for name, _ in jobs)), **point.effects}
    values = [base, *(effect_values(problem, name, probe) for name, probe in jobs)]
    lanes = {id: np.array([own.get(id, base[id]) for own in values]) for id in base}
    start = np.column_stack([point.z, z])
    return problem.changes(start, lanes, own.fit.noise, own.filtered)
