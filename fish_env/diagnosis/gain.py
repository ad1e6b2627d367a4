"""How much better the extended model is, on runs that chose nothing, than the refitted baseline.

Two measures. *Fit*: open-loop predictions over windows of three seconds, from filtered states, in
percent of the spread of the channel within the window (100: perfect). *Share of the reachable
gap*: mean squared one-step prediction errors, whitened with the noise that the extended model
found; see :mod:`fish_env.inference.gain`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification import open_loop
from fish_env.identification.filtering import Filtered
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.runs import RunData
from fish_env.identification.series import SeriesProblem, series_of
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.settle import evaluated
from fish_env.inference.gain import ClosedGap

OneStep = tuple[Sequence[Filtered], Sequence[Filtered]]
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
        share_ci95: its interval over runs; None with fewer than three, or where one decides.
    """

    runs: tuple[str, ...]
    fit_percent: Pair
    rmse: dict[str, Pair]
    misfit: dict[str, Pair]
    share: float | None
    share_ci95: tuple[float, float] | None

    @property
    def is_useless(self) -> bool:
        """Whether the extended model predicts no better than the mean of the data, or diverges."""
        return not self.fit_percent.extended > 0.0


def measure_gain(problem: SeriesProblem, baseline: Fit, extended: Fit, gap: ClosedGap) -> Gain:
    """Compare two fits on runs.

    Args:
        problem: final runs, fresh.
        baseline: refitted baseline, from other runs.
        extended: extended model, from the same other runs.
        gap: what the extension closes of the reachable gap, on the same runs.
    """
    before, after = (
        evaluated(problem, fit.point, extended.noise)[1] for fit in (baseline, extended)
    )
    own = [_open_loop(problem, fit) for fit in (baseline, extended)]
    fit_percent = Pair(*(_fit_percent(errors, problem) for errors, problem in own))
    rmse = {
        name: Pair(*(_rms([e[:, i] for e in errors]) for errors, _ in own))
        for i, name in enumerate(problem.channels)
    }
    ids = tuple(run.id for run in problem.runs)
    misfit = misfit_of(problem, (before, after))
    return Gain(ids, fit_percent, rmse, misfit, gap.share, gap.interval)


def one_step(baseline: Fit, extended: Fit) -> OneStep:
    """The runs of two fits, filtered with each and the numbers of their own that it has found.

    Both are under the second one's noise.
    """
    after = _as_fitted(extended, extended.noise)
    return after if extended is baseline else _as_fitted(baseline, extended.noise), after


def _as_fitted(fit: Fit, noise: NoiseModel) -> Sequence[Filtered]:
    return series_of(fit).in_usual_steps().filtered(fit.point, noise)


def misfit_of(problem: SeriesProblem, judged: OneStep) -> dict[str, Pair]:
    """Whitened one-step errors by channel, baseline and extended."""
    return {
        name: Pair(*(_rms(_present(problem.runs, f, i)) for f in judged))
        for i, name in enumerate(problem.channels)
    }


def _open_loop(problem: SeriesProblem, fit: Fit) -> tuple[list[FloatArray], SeriesProblem]:
    """Errors over windows that begin from filtered states, and the windows."""
    problem, filtered = evaluated(problem, fit.point, fit.noise)
    pieces = [
        window
        for run, result in zip(problem.runs, filtered, strict=True)
        for window in open_loop.windows(run, result, problem.channels)
    ]
    cut = problem.with_runs(pieces)
    return open_loop.errors(cut, fit.point, fit.noise), cut


def _fit_percent(errors: list[FloatArray], problem: SeriesProblem) -> float:
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
