"""Which causes explain the misfit: full refits of the shortlisted ones, one added at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fish_env.diagnosis.causes import Cause, effect_values
from fish_env.diagnosis.screening import Screen, Signal, screen
from fish_env.identification.estimator import Fit, fit, objective_at
from fish_env.identification.problem import Point, Problem

FloatArray = npt.NDArray[np.float64]
MOST_CAUSES = 3


@dataclass(frozen=True, eq=False)
class Explanation:
    """A fit with some causes in it.

    Attributes:
        causes: names, in the order they were added.
        fit: the fit.
    """

    causes: tuple[str, ...]
    fit: Fit


@dataclass(frozen=True, eq=False)
class Attribution:
    """Result of the search.

    Attributes:
        baseline: refitted baseline.
        screens: screen of the baseline, then of each accepted explanation.
        accepted: explanation of the last step (the baseline itself when nothing was added).
        rivals: explanations that fit as well as the accepted one.
        ranking: (name, score) of the first step, score in -2 log likelihood against the baseline.
    """

    baseline: Explanation
    screens: tuple[Screen, ...]
    accepted: Explanation
    rivals: tuple[Explanation, ...]
    ranking: tuple[tuple[str, float], ...]


def attribute(
    problem: Problem,
    baseline: Fit,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    shortlist: int = 6,
    report: Callable[[str], None] = lambda step: None,
) -> Attribution:
    """Add causes while one is significant, keep all that explain the data alike.

    Args:
        problem: runs used for fitting.
        baseline: refitted baseline.
        causes: causes to consider.
        rng: for null distributions.
        shortlist: causes refitted in full at each step.
        report: told what is being done.
    """
    current = Explanation((), baseline)
    screens = [screen(baseline, causes, rng)]
    rivals: tuple[Explanation, ...] = ()
    ranking: tuple[tuple[str, float], ...] = ()
    while len(current.causes) < MOST_CAUSES:
        chosen = shortlisted(problem, screens[-1], shortlist)
        if not chosen:
            break
        tried = []
        for signal in chosen:
            report(f"refitting with {signal.cause.name}")
            try:
                tried.append(_refit(problem, current, signal))
            except np.linalg.LinAlgError:
                report(f"no refit with {signal.cause.name}: the simulation diverges")
        if not tried:
            break
        tried, noise_fit = _rank(problem, current, tried)
        if not ranking:
            base = noise_fit
            ranking = tuple((e.causes[-1], e.fit.objective - base) for e in tried)
        best = tried[0]
        gain = noise_fit - best.fit.objective
        if gain < penalty(problem, best, current):
            break
        current = best
        screens.append(screen(best.fit, causes, rng))
        rivals = tuple(
            e
            for e in tried[1:]
            if alike(problem, best, e) and explained_away(e.causes[-1], screens[-2], screens[-1])
        )
        if rivals:
            break
    return Attribution(Explanation((), baseline), tuple(screens), current, rivals, ranking)


def shortlisted(problem: Problem, screen: Screen, count: int) -> list[Signal]:
    """The most significant causes, and among the others those known to look like the first.

    A strong effect is screened far from where it is, so its place among its like means little.
    """
    leading = [s for s in screen.best() if s.p_value < screen.threshold]
    if not leading:
        return []
    first = problem.known.get(leading[0].cause.name)
    alike = set(first.confusable_with) if first else set()
    return leading[:count] + [s for s in leading[count:] if s.cause.name in alike]


def penalty(problem: Problem, candidate: Explanation, current: Explanation) -> float:
    """What a cause must gain in -2 log likelihood: Schwarz' penalty for its parameters."""
    added = len(candidate.fit.names) - len(current.fit.names)
    released = len(candidate.fit.released) - len(current.fit.released)
    return (added + released) * float(np.log(problem.samples)) + 6.0


def _refit(problem: Problem, current: Explanation, signal: Signal) -> Explanation:
    """Full refit with one more cause, from the best of several starts."""
    cause, base = signal.cause, current.fit
    names = (*current.causes, cause.name)
    if not cause.is_effect:
        released = (*base.released, cause.path or "")
        result = fit(
            problem, base.effects, base.point, base.noise, released, refit_noise=False, iterations=3
        )
        return Explanation(names, result)
    effects = (*base.effects, cause.name)
    few = problem.subset(3)
    tried = []
    for group in _starts(problem, base, signal):
        values = [objective_at(few, effects, p, base.noise, base.released) for p in group]
        first = group[int(np.argmin(values))]
        tried.append(
            fit(few, effects, first, base.noise, base.released, refit_noise=False, iterations=4)
        )
    start = min(tried, key=lambda f: f.objective).point
    result = fit(
        problem, effects, start, base.noise, base.released, refit_noise=False, iterations=4
    )
    return Explanation(names, result)


def _starts(problem: Problem, base: Fit, signal: Signal) -> list[list[Point]]:
    """Where to begin: the linear estimate and every probe, with baselines near and far.

    A baseline refitted without the cause may have gone far to make up for it, so the nominal one
    is a start of its own.
    """
    cause = signal.cause
    neutral = problem.neutral([cause.name])
    size = np.linalg.solve(signal.projected, signal.score)
    linear = dict(neutral)
    for factor, probe in zip(size, cause.probes[signal.probe], strict=True):
        for path, value in effect_values(problem, cause.name, probe).items():
            finite = np.isfinite(neutral[path])
            linear[path] = linear[path] + factor * (value - neutral[path]) if finite else value
    probes = [effect_values(problem, cause.name, p) for p in cause.probes[signal.probe]]
    bounds = {f.path: (f.lower, f.upper) for f in problem.freedoms([cause.name])}
    clipped = [
        {path: float(np.clip(value, *bounds[path])) for path, value in values.items()}
        for values in (linear, *probes)
    ]
    return [
        [Point(z, {**base.point.effects, **values}) for values in clipped]
        for z in (base.point.z, np.zeros_like(base.point.z))
    ]


def _rank(
    problem: Problem, current: Explanation, tried: list[Explanation]
) -> tuple[list[Explanation], float]:
    """Order explanations by a common yardstick: the disturbance that the best of them leaves."""
    tried = sorted(tried, key=lambda e: e.fit.objective)
    leader = tried[0].fit
    best = fit(problem, leader.effects, leader.point, None, leader.released, rounds=3)
    rest = [
        fit(
            problem, e.fit.effects, e.fit.point, best.noise, e.fit.released, refit_noise=False,
            iterations=3,
        )
        for e in tried[1:3]
    ]  # fmt: skip
    polished = [Explanation(tried[0].causes, best)]
    polished += [Explanation(e.causes, f) for e, f in zip(tried[1:3], rest, strict=True)]
    base = fit(
        problem, current.fit.effects, current.fit.point, best.noise, current.fit.released,
        refit_noise=False, iterations=2,
    )  # fmt: skip
    order = sorted(polished, key=lambda e: e.fit.objective + _size(problem, e))
    return order, base.objective


def _size(problem: Problem, explanation: Explanation) -> float:
    parameters = len(explanation.fit.names) + len(explanation.fit.released)
    return parameters * float(np.log(problem.samples))


def explained_away(cause: str, before: Screen, after: Screen) -> bool:
    """Whether a cause lost most of its evidence when another was accepted.

    If it did not, the two explain different parts of the data: it is a further cause, no rival.
    """
    evidence = {s.cause.name: s.statistic for s in before.best()}
    left = {s.cause.name: s.statistic for s in after.best()}
    return left.get(cause, 0.0) < 0.5 * evidence.get(cause, np.inf)


def alike(problem: Problem, best: Explanation, other: Explanation) -> bool:
    """Whether two explanations cannot be told apart on these runs.

    They are alike when the penalised likelihoods differ by less than 6, or when the difference,
    run by run, is within one standard error of zero.
    """
    gap = (other.fit.objective + _size(problem, other)) - (
        best.fit.objective + _size(problem, best)
    )
    if gap < 6.0:
        return True
    by_run = np.array(
        [
            2.0 * (b.log_likelihood - o.log_likelihood)
            for b, o in zip(best.fit.filtered, other.fit.filtered, strict=True)
        ]
    )
    error = by_run.std(ddof=1) / np.sqrt(len(by_run)) if len(by_run) > 1 else np.inf
    return bool(by_run.mean() < error and gap < 40.0)
