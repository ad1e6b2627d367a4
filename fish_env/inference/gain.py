"""How much better an explanation predicts held-out runs than the refitted baseline does.

The measure is the mean squared one-step prediction error, whitened with the noise that the
explanation found. Its floor is 1: what sensor noise and disturbance leave.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.settle import evaluated
from fish_env.inference.over_runs import Interval, over_runs
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem


@dataclass(frozen=True)
class ClosedGap:
    """Share of the gap between baseline and floor that an explanation closes.

    Attributes:
        share: 1 closes the whole gap; None where the baseline leaves no gap.
        interval: 95 % interval over runs; None with too few of them.
    """

    share: float | None
    interval: Interval | None


def gap_closed(held_out: Problem, baseline: Fit, accepted: Fit) -> ClosedGap:
    """Compare two fits on runs that neither was fitted to.

    Args:
        held_out: these runs.
        baseline: refitted baseline.
        accepted: fit with causes, to the same runs as the baseline.
    """
    noise = held_out.noise_of(accepted)  # fits can be compared only under one noise model
    squares = [squared_errors(held_out, fit.point, noise) for fit in (accepted, baseline)]
    after, before = (by_window(held_out, values, np.nanmean) for values in squares)
    return ClosedGap(*reachable_share(before, after))


def squared_errors(problem: Problem, point: Point, noise: object) -> FloatArray:
    """Squared whitened one-step errors (D,), NaN where nothing was measured.

    A model that diverges is taken to be wrong by ``largest_squared_error``.

    Args:
        problem: the runs.
        point: values of the parameters.
        noise: noise model.
    """
    _, evaluations = evaluated(problem, point, noise)
    residuals = np.concatenate([evaluation.residuals for evaluation in evaluations])
    return np.where(problem.measured, np.fmin(residuals**2, POLICY.largest_squared_error), np.nan)


def by_window(
    problem: Problem, values: FloatArray, combine: Callable[[FloatArray], float]
) -> list[FloatArray]:
    """One number for each window of each run.

    Args:
        problem: the runs.
        values: (D,) one for each residual, NaN where nothing was measured.
        combine: makes one number of the values in a window.
    """
    run_of, time_of = problem.groups()
    row = np.floor(time_of / POLICY.prediction_window_s).astype(np.int64)
    result = []
    for run in range(problem.run_count):
        own, rows = values[run_of == run], row[run_of == run]
        parts = [own[rows == k] for k in np.unique(rows)]
        result.append(np.array([combine(p) for p in parts if np.isfinite(p).any()]))
    return result


def reachable_share(
    baseline: Sequence[FloatArray], extended: Sequence[FloatArray]
) -> tuple[float | None, Interval | None]:
    """Share of the gap to the floor of 1 that was closed, with an interval over runs.

    Args:
        baseline: mean squared whitened errors of each run's windows.
        extended: the same of the extended model.
    """
    sizes = np.array([len(own) for own in baseline], float)
    before, after = (np.array([own.sum() for own in errors]) for errors in (baseline, extended))
    if before.sum() / sizes.sum() - 1.0 <= POLICY.smallest_gap:
        return None, None

    def share(runs: IntArray) -> FloatArray:
        gap = float((before - sizes)[runs].sum())
        return np.array([(before - after)[runs].sum() / gap if gap > 0.0 else np.nan])

    interval = over_runs(share, len(sizes))
    return float(share(np.arange(len(sizes)))[0]), interval[0] if interval else None
