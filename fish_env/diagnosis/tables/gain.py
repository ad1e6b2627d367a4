"""What an extension gains on conditions that chose nothing."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.diagnosis.gain import Gain, Pair
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.tables.scatter import Scatter
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.gain import ClosedGap

Fits = tuple[Fit, Fit]


def predictions(problem: TableProblem, known: Fit) -> FloatArray:
    """Averages that a fit predicts for the conditions of a problem, shape (C, K)."""
    return np.asarray(problem.means(problem.orbits(known.point))[0])


def measure_gain(problem: TableProblem, fits: Fits, gap: ClosedGap) -> Gain:
    """Compare two fits on final conditions.

    Args:
        problem: the final conditions.
        fits: refitted baseline and extended model, both from other conditions.
        gap: share of the reachable gap, on the same conditions.
    """
    table = problem.table
    errors = [table.values - predictions(problem, f)[table.condition_of] for f in fits]
    rmse = {
        name: Pair(*(float(np.sqrt(np.nanmean(e[:, k] ** 2))) for e in errors))
        for k, name in enumerate(table.observations)
    }
    fit_percent = Pair(*(_fit_percent(table.values, e) for e in errors))
    misfit = misfit_of(problem, fits, problem.noise_of(fits[1]))
    return Gain(table.conditions, fit_percent, rmse, misfit, gap.share, gap.interval)


def misfit_of(problem: TableProblem, fits: Fits, noise: Scatter) -> dict[str, Pair]:
    """Whitened errors by observation of two fits.

    Args:
        problem: what was fitted.
        fits: refitted baseline and extended model.
        noise: that both are judged by.
    """
    whitened = [problem.missed(predictions(problem, known), noise) for known in fits]
    column = problem.table.lines[1]
    return {
        name: Pair(*(float(np.sqrt(np.mean(w[column == k] ** 2))) for w in whitened))
        for k, name in enumerate(problem.table.observations)
    }


def _fit_percent(values: FloatArray, errors: FloatArray) -> float:
    """Mean over observations of 100 (1 - error / size of what was measured)."""
    size = np.sqrt(np.nanmean(values**2, axis=0))
    return float(np.mean(100.0 * (1.0 - np.sqrt(np.nanmean(errors**2, axis=0)) / size)))
