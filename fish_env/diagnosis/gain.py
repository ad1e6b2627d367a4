"""How much better the extended model is, on runs that chose nothing, than the refitted baseline.

Two measures. *Fit*: open-loop predictions over windows of three seconds, from filtered states, in
percent of the spread of the channel within the window (100: perfect). *Share of the reachable
gap*: mean squared one-step prediction errors, whitened with the noise that the extended model
found; the floor is 1, what its own sensor noise and disturbance leave.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fish_env.diagnosis import open_loop
from fish_env.identification.estimator import Fit
from fish_env.identification.filtering import Filtered
from fish_env.identification.phases import in_step
from fish_env.identification.problem import Problem
from fish_env.identification.runs import RunData

FloatArray = npt.NDArray[np.float64]
OneStep = tuple[list[Filtered], list[Filtered]]
WINDOW_S = 3.0
RESAMPLES = 2000
ANGLES = ("roll", "yaw")


@dataclass(frozen=True)
class Pair:
    """One number of the refitted baseline and of the extended model."""

    baseline: float
    extended: float


@dataclass(frozen=True)
class Gain:
    """What the extension gained.

    Attributes:
        runs: ids of the runs judged on.
        fit_percent: mean over channels and runs of open-loop predictions over windows.
        rmse: channel -> error of these predictions, in the channel's unit.
        misfit: channel -> root mean square of whitened one-step errors; 1 is the floor.
        share: share of the gap between baseline and floor that the extension closed; None where
            the baseline leaves no gap.
        share_ci95: its interval over runs and windows.
    """

    runs: tuple[str, ...]
    fit_percent: Pair
    rmse: dict[str, Pair]
    misfit: dict[str, Pair]
    share: float | None
    share_ci95: tuple[float, float] | None


def measure_gain(problem: Problem, baseline: Fit, extended: Fit, rng: np.random.Generator) -> Gain:
    """Compare two fits on runs.

    Args:
        problem: final runs, fresh.
        baseline: refitted baseline, from other runs.
        extended: extended model, from the same other runs.
        rng: for the interval.
    """
    judged = one_step(problem, baseline, extended)
    before_any = in_step(problem, baseline.point, baseline.noise)
    own = [_open_loop(problem, baseline, before_any), _open_loop(problem, extended, judged[1])]
    fit_percent = Pair(*(_fit_percent(errors, problem) for errors, problem in own))
    rmse = {
        name: Pair(*(_rms([e[:, i] for e in errors]) for errors, _ in own))
        for i, name in enumerate(problem.channels)
    }
    before, after = (
        by_window(problem.runs, [f.innovations**2 for f in filtered], np.nanmean)
        for filtered in judged
    )
    share, interval = reachable_share(before, after, rng)
    ids = tuple(run.id for run in problem.runs)
    return Gain(ids, fit_percent, rmse, misfit_of(problem, judged), share, interval)


def one_step(problem: Problem, baseline: Fit, extended: Fit) -> OneStep:
    """The runs of a problem filtered with each of two fits, both under the second one's noise."""
    after = in_step(problem, extended.point, extended.noise)
    if extended is baseline:
        return after, after
    return in_step(problem, baseline.point, extended.noise), after


def misfit_of(problem: Problem, judged: OneStep) -> dict[str, Pair]:
    """Whitened one-step errors by channel, baseline and extended."""
    return {
        name: Pair(*(_rms(_present(problem.runs, f, i)) for f in judged))
        for i, name in enumerate(problem.channels)
    }


def _open_loop(
    problem: Problem, fit: Fit, filtered: list[Filtered]
) -> tuple[list[FloatArray], Problem]:
    """Errors over windows that begin from filtered states, and the windows."""
    pieces = [
        window
        for run, result in zip(problem.runs, filtered, strict=True)
        for window in open_loop.windows(run, result, WINDOW_S)
    ]
    cut = problem.with_runs(pieces)
    return open_loop.errors(cut, fit.point, fit.noise), cut


def _fit_percent(errors: list[FloatArray], problem: Problem) -> float:
    """Mean over channels and runs of 100 (1 - error / spread within the window)."""
    totals: dict[tuple[str, str], list[float]] = {}
    for window, error in zip(problem.runs, errors, strict=True):
        for i, name in enumerate(problem.channels):
            measured = window.measured[:, i]
            good = np.isfinite(measured)
            if good.sum() < 3:
                continue
            values = np.unwrap(measured[good]) if name in ANGLES else measured[good]
            entry = totals.setdefault((window.id, name), [0.0, 0.0])
            entry[0] += float(np.sum(error[good, i] ** 2))
            entry[1] += float(np.sum((values - values.mean()) ** 2))
    return float(np.mean([100.0 * (1.0 - np.sqrt(e / s)) for e, s in totals.values() if s > 0.0]))


def _present(runs: Sequence[RunData], filtered: Sequence[Filtered], i: int) -> list[FloatArray]:
    return [
        result.innovations[np.isfinite(run.measured[:, i]), i]
        for run, result in zip(runs, filtered, strict=True)
    ]


def _rms(parts: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.nanmean(np.concatenate(parts) ** 2)))


def by_window(
    runs: Sequence[RunData], values: Sequence[FloatArray], combine: Callable[[FloatArray], float]
) -> list[FloatArray]:
    """One number for each window of each run.

    Args:
        runs: the runs.
        values: (T, C) of each.
        combine: of the values in a window, NaN where nothing was measured.
    """
    result = []
    for run, own in zip(runs, values, strict=True):
        present = np.where(np.isfinite(run.measured), own, np.nan)
        row = np.floor(run.clock / WINDOW_S).astype(np.int64)
        parts = [present[row == k] for k in np.unique(row)]
        result.append(np.array([combine(p) for p in parts if np.isfinite(p).any()]))
    return result


def reachable_share(
    baseline: Sequence[FloatArray], extended: Sequence[FloatArray], rng: np.random.Generator
) -> tuple[float | None, tuple[float, float] | None]:
    """Share of the gap to the floor of 1 that was closed, with an interval.

    Args:
        baseline: mean squared whitened errors of each run's windows.
        extended: the same of the extended model.
        rng: draws runs, and windows within them.
    """
    gap = float(np.mean(np.concatenate(baseline))) - 1.0
    if gap <= 0.01:
        return None, None
    share = float(np.mean(np.concatenate(baseline)) - np.mean(np.concatenate(extended))) / gap
    draws = []
    for _ in range(RESAMPLES):
        left = right = 0.0
        for i in rng.integers(0, len(baseline), len(baseline)):
            chosen = rng.integers(0, len(baseline[i]), len(baseline[i]))
            left += float(baseline[i][chosen].mean() - extended[i][chosen].mean())
            right += float(baseline[i][chosen].mean() - 1.0)
        draws.append(left / right if right > 0 else np.nan)
    low, high = np.nanquantile(draws, [0.025, 0.975])
    return share, (float(low), float(high))
