"""Which causes explain the misfit: full refits of a shortlist, ranked on left-out conditions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fish_env.diagnosis.causes import (
    Cause,
    Probe,
    combined,
    effect_values,
    mirrored,
    same_causes,
)
from fish_env.diagnosis.steady.fitting import (
    SteadyFit,
    fit,
    lines,
    measured,
    noise_of,
    with_scatter,
)
from fish_env.diagnosis.steady.freedoms import freedoms_of
from fish_env.diagnosis.steady.scatter import Scatter, push_variances, response
from fish_env.diagnosis.steady.screening import Screen, Signal, screen
from fish_env.diagnosis.tails import chi2_log_tail
from fish_env.errors import DatasetError
from fish_env.identification.problem import Point

FloatArray = npt.NDArray[np.float64]
MOST_CAUSES = 3
CERTAIN = 10.0
"""Gap of the left-out log score beyond which one explanation is better, whatever its spread."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """A fit with some causes in it.

    Attributes:
        causes: names, in the order they were added.
        fit: the fit.
        scores: log score of each condition when it is left out, shape (C,).
    """

    causes: tuple[str, ...]
    fit: SteadyFit
    scores: FloatArray

    @property
    def score(self) -> float:
        """Sum over the conditions."""
        return float(self.scores.sum())


@dataclass(frozen=True, eq=False)
class Attribution:
    """Result of the search.

    Attributes:
        baseline: refitted baseline, judged by the accepted explanation's noise.
        screens: of the baseline, then of each accepted explanation.
        accepted: explanation of the last step, the baseline itself when nothing was added.
        rivals: explanations that predict as well as the accepted one.
        ranking: (name, log score on left-out conditions above the baseline's) of the first step.
    """

    baseline: Explanation
    screens: tuple[Screen, ...]
    accepted: Explanation
    rivals: tuple[Explanation, ...]
    ranking: tuple[tuple[str, float], ...]


def explained(causes: tuple[str, ...], fit: SteadyFit) -> Explanation:
    """A fit with its scores."""
    return Explanation(causes, fit, left_out_scores(fit))


def left_out_scores(fit: SteadyFit) -> FloatArray:
    """Log density of each condition's averages, predicted by a fit to all others, shape (C,).

    By the linearised fit: without its own lines a condition's residuals become (1 - H)^-1 of
    what they are, with that covariance, H being its block of the hat matrix.
    """
    problem = fit.problem
    basis, _ = np.linalg.qr(fit.slopes)
    row, column = np.nonzero(problem.table.present)
    condition = problem.table.condition_of[row]
    scores = np.empty(len(problem.table.conditions))
    for i in range(len(scores)):
        own = np.flatnonzero(condition == i)
        left = np.eye(len(own)) - basis[own] @ basis[own].T + 1e-9 * np.eye(len(own))
        predicted = np.linalg.solve(left, fit.residuals[own])
        sizes = fit.scatter.sd[i, column[own]]
        # The covariance is (1 - H)^-1, so its inverse weighs and its determinant is 1 over.
        scores[i] = -0.5 * (
            predicted @ left @ predicted
            - np.linalg.slogdet(left)[1]
            + 2.0 * np.log(sizes).sum()
            + len(own) * np.log(2.0 * np.pi)
        )
    return scores


def attribute(
    baseline: SteadyFit,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    shortlist: int,
    report: Callable[[str], None],
) -> Attribution:
    """Add causes while one is significant, keep all that predict the data alike.

    Args:
        baseline: refitted baseline.
        causes: causes to consider.
        rng: for null distributions.
        shortlist: causes refitted in full at each step.
        report: told what is being done.
    """
    current = explained((), baseline)
    screens = [screen(baseline, causes, rng)]
    rivals: tuple[Explanation, ...] = ()
    ranking: tuple[tuple[str, float], ...] = ()
    while len(current.causes) < MOST_CAUSES:
        tried = []
        for signal in shortlisted(baseline, screens[-1], shortlist):
            report(f"refitting with {signal.cause.name}")
            found = _refit(current, signal)
            if found is not None:
                tried.append(found)
        if not tried:
            break
        tried, before = _ranked(current, tried)
        if not ranking:
            ranking = tuple((e.causes[-1], e.score - before.score) for e in tried)
        best = tried[0]
        if not worth_it(before, best, screens[-1].threshold):
            break
        screens.append(screen(best.fit, causes, rng))
        rivals = tuple(
            e
            for e in tried[1:]
            if worth_it(before, e, screens[-2].threshold)
            and alike(best, e)
            and not same_causes(best.fit.problem.known, best.causes, e.causes)
            and explained_away(e.causes[-1], screens[-2], screens[-1])
        )
        current = best
        if rivals:
            break
    judged = with_scatter(baseline, current.fit.scatter)
    return Attribution(explained((), judged), tuple(screens), current, rivals, ranking)


def shortlisted(fit: SteadyFit, screen: Screen, count: int) -> list[Signal]:
    """The most significant causes, and among the others those known to look like the first."""
    leading = [s for s in screen.best() if s.log_p < screen.threshold]
    if not leading:
        return []
    first = fit.problem.known.get(leading[0].cause.name)
    alike_names = set(first.confusable_with) if first else set()
    return leading[:count] + [s for s in leading[count:] if s.cause.name in alike_names]


def worth_it(before: Explanation, after: Explanation, threshold: float) -> bool:
    """Whether the refit gained what the screen promised, on left-out conditions, too."""
    added = len(after.fit.names) + len(after.fit.released)
    added -= len(before.fit.names) + len(before.fit.released)
    gained = before.fit.objective - after.fit.objective
    return bool(chi2_log_tail(gained, added) < threshold and after.score > before.score)


def alike(best: Explanation, other: Explanation) -> bool:
    """Whether two explanations predict left-out conditions alike, within one standard error."""
    gaps = best.scores - other.scores
    error = gaps.std(ddof=1) * np.sqrt(len(gaps))
    return bool(gaps.sum() < min(error, CERTAIN))


def explained_away(cause: str, before: Screen, after: Screen) -> bool:
    """Whether a cause lost most of its evidence when another was accepted.

    If it did not, the two explain different parts of the data: it is a further cause, no rival.
    """
    evidence = {s.cause.name: s.statistic for s in before.best()}
    left = {s.cause.name: s.statistic for s in after.best()}
    return left.get(cause, 0.0) < 0.5 * evidence.get(cause, np.inf)


def _refit(current: Explanation, signal: Signal) -> Explanation | None:
    """Full refit with one more cause, from the best of several starts; None if none swims."""
    base, cause = current.fit, signal.cause
    names = (*current.causes, cause.name)
    if not cause.is_effect:
        released = (*base.released, cause.path or "")
        return explained(
            names,
            fit(base.problem, base.effects, base.point, base.orbits, base.scatter, released),
        )
    effects = (*base.effects, cause.name)
    tried = []
    for start in starts(base, signal):
        try:
            tried.append(
                fit(base.problem, effects, start, None, base.scatter, base.released, steps=10)
            )
        except DatasetError:  # this start does not swim steadily
            continue
    return explained(names, min(tried, key=lambda f: f.objective)) if tried else None


def starts(base: SteadyFit, signal: Signal) -> list[Point]:
    """Where to begin: the linear estimate, and what meets the averages best of every probe.

    Probes of either sign, once with the refitted coefficients and once with the nominal ones: the
    refitted may have gone far to make up for the cause, and meet the averages best without it.
    """
    problem, cause = base.problem, signal.cause
    effect = problem.known[cause.name]
    size = np.linalg.solve(signal.projected, signal.score).tolist()
    linear = combined(effect, cause.probes[signal.probe], size, effect.neutral)
    probes = [probe for alternative in cause.probes for probe in alternative]
    bounds = {f.path: (f.lower, f.upper) for f in freedoms_of(problem, [cause.name])}

    def points(z: FloatArray, settings: Sequence[Probe]) -> list[Point]:
        values = [_within(effect_values(problem, cause.name, s), bounds) for s in settings]
        return [Point(z, {**base.point.effects, **own}) for own in values]

    either = [*probes, *(mirrored(effect, probe) for probe in probes)]
    chosen = [_closest(base, points(z, either)) for z in (base.point.z, 0.0 * base.point.z)]
    return [*points(base.point.z, [linear]), *(point for point in chosen if point)]


def _closest(base: SteadyFit, points: Sequence[Point]) -> Point | None:
    """The point at which the averages are met best; None where none swims steadily."""
    problem = base.problem
    means = problem.means(problem.orbits(points, base.orbits))
    missed = measured(problem, base.scatter) - lines(problem, means, base.scatter)
    values = (missed**2).sum(axis=1)
    return points[int(np.nanargmin(values))] if np.isfinite(values).any() else None


def _within(values: dict[str, float], bounds: dict[str, tuple[float, float]]) -> dict[str, float]:
    return {path: float(np.clip(value, *bounds[path])) for path, value in values.items()}


def _ranked(
    current: Explanation, tried: list[Explanation]
) -> tuple[list[Explanation], Explanation]:
    """Explanations, and the one before them, by a common yardstick: the noise the best leaves."""
    best = min(tried, key=lambda e: e.fit.objective)
    noise = own_noise(best.fit)
    close = sorted(tried, key=lambda e: e.fit.objective)
    again = [
        Explanation(e.causes, f, left_out_scores(f))
        for e in close
        for f in (_polished(e.fit, noise),)
    ]
    before = explained(current.causes, _polished(current.fit, noise))
    return sorted(again, key=lambda e: -e.score), before


def own_noise(fit: SteadyFit) -> Scatter:
    """Noise that the residuals of a fit show."""
    return noise_of(fit, push_variances(response(fit.problem, fit.point, fit.orbits)))


def _polished(old: SteadyFit, noise: Scatter) -> SteadyFit:
    """Refit with another noise."""
    return fit(old.problem, old.effects, old.point, old.orbits, noise, old.released, steps=6)
