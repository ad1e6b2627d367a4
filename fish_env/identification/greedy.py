"""Effects added one by one, as long as conditions that were left out are predicted better."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from fish_env.arrays import FloatArray
from fish_env.effects import catalogue
from fish_env.identification.left_out import RunErrors, left_out_errors
from fish_env.identification.objectives import Objective
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.whole_runs.problem import WholeRunProblem
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.explanation import reached
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report, silent

COARSE_STEPS = 4


@dataclass(frozen=True)
class EffectStep:
    """One effect that was judged on what was left out.

    Attributes:
        effect: its name.
        gain: share by which it lowers the held-out error, in root mean square of all quantities.
        p_value: of so large a gain by chance, over groups.
        added: whether it was added.
    """

    effect: str
    gain: float
    p_value: float
    added: bool


def add_effects(
    objective: Objective,
    base: Fit,
    groups: dict[str, list[int]],
    report: Report = silent,
    candidates: Sequence[str] | None = None,
) -> tuple[Fit, tuple[RunErrors, ...], tuple[EffectStep, ...]]:
    """Add effects to a fit while one predicts groups left out better.

    Every candidate is fitted coarsely; the leaders are fitted in full and judged on each group by
    a fit that has not seen it.

    Args:
        objective: how runs are fitted and judged.
        base: fit without further effects.
        groups: label -> numbers of runs that are left out together.
        report: told what is being done.
        candidates: effects to try; default: all of the catalogue.

    Returns:
        The last fit, its held-out errors, and every effect that was judged, in order.
    """
    best, steps = base, list[EffectStep]()
    errors = left_out_errors(objective, base, groups, report)
    untried = [n for n in (candidates or catalogue()) if n not in base.effects]
    while len(best.effects) < IDENTIFICATION.most_added_effects:
        leaders = _leaders(best, untried, report)
        judged = []
        for name, begin in leaders:
            report(f"judging {name}")
            problem = with_effects(best, (*best.effects, name))
            full = reached(lambda p=problem, b=begin: objective.fit(p, b, report))  # type: ignore[misc]
            if full is not None:
                trial = left_out_errors(objective, full, groups, report)
                gain, p = held_out_gain(errors, trial)
                judged.append((gain, p, name, full, trial))
        judged.sort(key=lambda one: -one[0])
        for i, (gain, p, name, full, trial) in enumerate(judged):
            added = i == 0 and gain > 0.0 and p < IDENTIFICATION.held_out_level
            steps.append(EffectStep(name, gain, p, added))
            if added:
                best, errors = full, trial
                untried.remove(name)
        if not any(s.added for s in steps[-len(judged) :]) or not judged:
            break
    return best, errors, tuple(steps)


def with_effects(found: Fit, names: Sequence[str]) -> Problem:
    """The problem of a fit with other effects, its runs as they were found."""
    other = copy(found.problem)
    other.effects = tuple(names)
    if isinstance(other, WholeRunProblem):
        return other.started([e.own for e in found.filtered])
    return other


def _leaders(base: Fit, names: Sequence[str], report: Report) -> list[tuple[str, Point]]:
    """The effects that a coarse fit gains most by, with where that fit ended."""
    found = []
    for name in names:
        report(f"trying {name}")
        problem = with_effects(base, (*base.effects, name))
        begin = Point(base.point.z, {**_switched_on(problem, name), **base.point.effects})
        coarse = reached(
            lambda p=problem, b=begin: fit(  # type: ignore[misc]
                p, p.effects, b, base.noise, refit_noise=False, iterations=COARSE_STEPS
            )
        )
        gain = 0.0 if coarse is None else 2.0 * (coarse.log_likelihood - base.log_likelihood)
        if coarse is not None and gain > IDENTIFICATION.least_coarse_gain:
            found.append((gain, name, coarse.point))
    found.sort(key=lambda one: -one[0])
    return [(name, point) for _, name, point in found[: IDENTIFICATION.most_judged_effects]]


def _switched_on(problem: Problem, name: str) -> dict[EffectParameterId, float]:
    """Values of an effect a little away from neutral, where many an effect is flat."""
    values = problem.beginning([name])
    for p in problem.known[name].parameters:
        id = EffectParameterId(name, p.name)
        values[id] += 0.3 * (p.far_end(values[id]) - values[id])
    return values


def held_out_gain(before: Sequence[RunErrors], after: Sequence[RunErrors]) -> tuple[float, float]:
    """Share by which a mean square falls, and its p-value over groups by a paired t-test.

    Every quantity counts in units of its own root mean square before.

    Args:
        before: held-out errors of one fit.
        after: of the other, of the same runs.
    """
    names = sorted(set.intersection(*(set(run.errors) for run in (*before, *after))))
    first, second = _table(before, names), _table(after, names)
    scale = np.sqrt(np.mean(first**2, axis=0))
    scores = [np.mean((table / scale) ** 2, axis=1) for table in (first, second)]
    labels = [run.group for run in before]
    falls = np.array(
        [
            np.mean([a - b for a, b, own in zip(*scores, labels, strict=True) if own == label])
            for label in dict.fromkeys(labels)
        ]
    )
    spread = float(np.std(falls, ddof=1)) / np.sqrt(len(falls)) if len(falls) > 1 else np.inf
    t = float(falls.mean()) / max(spread, 1e-12)
    return 1.0 - float(np.sqrt(scores[1].mean() / scores[0].mean())), float(
        stdtr(max(len(falls) - 1, 1), -t)
    )


def _table(runs: Sequence[RunErrors], names: Sequence[str]) -> FloatArray:
    return np.array([[run.errors[name] for name in names] for run in runs])
