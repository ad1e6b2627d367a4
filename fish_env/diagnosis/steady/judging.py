"""What an extension gains on conditions that chose nothing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fish_env.diagnosis.gain import Gain, Pair
from fish_env.diagnosis.steady.fitting import SteadyFit, lines, measured
from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.diagnosis.steady.scatter import Scatter, push_variances, response

FloatArray = npt.NDArray[np.float64]
RESAMPLES = 2000


def predictions(problem: SteadyProblem, known: SteadyFit) -> FloatArray:
    """Averages that a fit predicts for the conditions of a problem, shape (C, K)."""
    return np.asarray(problem.means(problem.orbits([known.point]))[0])


def noise_on(problem: SteadyProblem, known: SteadyFit) -> Scatter:
    """Noise of a fit under the conditions of a problem."""
    orbits = problem.orbits([known.point])
    return known.scatter.on(push_variances(response(problem, known.point, orbits)))


def measure_gain(
    problem: SteadyProblem, baseline: SteadyFit, extended: SteadyFit, rng: np.random.Generator
) -> Gain:
    """Compare two fits on final conditions.

    Args:
        problem: the final conditions.
        baseline: refitted baseline, from other conditions.
        extended: extended model, from the same other conditions.
        rng: for the interval over conditions.
    """
    table = problem.table
    noise = noise_on(problem, extended)
    means = [predictions(problem, known) for known in (baseline, extended)]
    errors = [table.values - m[table.condition_of] for m in means]
    rmse = {
        name: Pair(*(float(np.sqrt(np.nanmean(e[:, k] ** 2))) for e in errors))
        for k, name in enumerate(table.observations)
    }
    whitened = [measured(problem, noise) - lines(problem, m, noise) for m in means]
    column = np.nonzero(table.present)[1]
    misfit = {
        name: Pair(*(float(np.sqrt(np.mean(w[column == k] ** 2))) for w in whitened))
        for k, name in enumerate(table.observations)
    }
    condition = table.condition_of[np.nonzero(table.present)[0]]
    share, interval = _share(whitened, condition, rng)
    fit_percent = Pair(*(_fit_percent(table.values, e) for e in errors))
    return Gain(table.conditions, fit_percent, rmse, misfit, share, interval)


def _fit_percent(values: FloatArray, errors: FloatArray) -> float:
    """Mean over observations of 100 (1 - error / size of what was measured)."""
    size = np.sqrt(np.nanmean(values**2, axis=0))
    return float(np.mean(100.0 * (1.0 - np.sqrt(np.nanmean(errors**2, axis=0)) / size)))


def _share(
    whitened: list[FloatArray], condition: npt.NDArray[np.intp], rng: np.random.Generator
) -> tuple[float | None, tuple[float, float] | None]:
    """Share of the gap from the baseline to the floor that was closed, with an interval."""
    count = int(condition.max()) + 1
    lines_in = np.bincount(condition, minlength=count)
    before, after = (np.bincount(condition, w**2, count) for w in whitened)
    if before.sum() / lines_in.sum() < 1.01:
        return None, None
    drawn = rng.integers(0, count, (RESAMPLES, count))
    gap = (before[drawn] - lines_in[drawn]).sum(axis=1)
    closed = (before[drawn] - after[drawn]).sum(axis=1)
    shares = closed[gap > 0] / gap[gap > 0]
    low, high = np.quantile(shares, [0.025, 0.975])
    whole = float((before - after).sum() / (before - lines_in).sum())
    return whole, (float(low), float(high))


def misfit_of(baseline: SteadyFit, extended: SteadyFit) -> dict[str, Pair]:
    """Whitened errors by observation of two fits, both by the noise of the second."""
    problem, noise = extended.problem, extended.scatter
    column = np.nonzero(problem.table.present)[1]
    whitened = [
        measured(problem, noise) - lines(problem, f.means, noise) for f in (baseline, extended)
    ]
    return {
        name: Pair(*(float(np.sqrt(np.mean(w[column == k] ** 2))) for w in whitened))
        for k, name in enumerate(problem.table.observations)
    }
