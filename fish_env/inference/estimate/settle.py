"""Runs at the numbers of their own that suit given parameters best: predicted, then evaluated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar, cast
from weakref import WeakKeyDictionary

import numpy as np

from fish_env.inference.estimate.free import least_of, marginal_of, own_objectives, spread_of
from fish_env.inference.estimate.run_variation import Marginal
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.problem import Point, Problem

P = TypeVar("P", bound=Problem)
DAMPING = (0.0, 0.3, 3.0, 30.0)
"""Of a run's step to its own numbers, one after another until its likelihood rises."""
MOST_STEPS, NEAR = 6, 0.1
"""To the numbers of runs that no fit has seen, and the step, in spreads, after which they stay."""
_EVALUATED: WeakKeyDictionary[Any, list[tuple[Point, Any, Any, Any]]] = WeakKeyDictionary()
"""Of a problem: points and noise models with what was settled, None for the problem itself, which
must not keep itself alive, and its evaluation."""


def predicted_variation(
    problem: Problem, point: Point, noise: Any, nearby: bool = False
) -> tuple[Problem, Marginal | None]:
    """The problem at the best prediction of what its runs differ in, and how to integrate it out.

    The prediction is of the linear model. Where that lowers a run's likelihood the run goes only
    part of the way, or stays.

    Args:
        problem: the problem, at an earlier prediction.
        point: values of the shared parameters.
        noise: noise model with the spreads.
        nearby: whether the step is so small that what follows from the motion follows from the
            present one.
    """
    spreads = spread_of(problem, noise)
    if not spreads.any():
        return problem, None
    active = np.flatnonzero(spreads)
    filtered = problem.filtered(point, noise)
    marginal = marginal_of(problem, point, noise, filtered)
    assert marginal is not None
    residuals = np.concatenate([f.residuals for f in filtered])
    numbers, before = problem.variation.copy(), own_objectives(problem, filtered, noise)
    worse, least = list(range(problem.run_count)), least_of(problem, active)
    for damping in DAMPING:
        trial = problem.variation.copy()
        trial[:, active] = marginal.predicted(residuals, damping, least) * spreads[active]
        better, near = [], [filtered[i] for i in worse]
        try:
            seen: Sequence[Evaluation] = near if nearby else ()
            part = problem.some(worse).with_variation(trial[worse], point, noise, seen)
            after = own_objectives(part, part.filtered(point, noise, near), noise)
        except np.linalg.LinAlgError:
            continue
        better = [i for i, value in zip(worse, after, strict=True) if value <= before[i]]
        numbers[better] = trial[better]
        worse = [i for i in worse if i not in better]
        if not worse:
            break
    whole = len(better) == problem.run_count  # nothing to work out again
    if not whole:
        seen = filtered if nearby else ()
        part = problem.with_variation(numbers, point, noise, seen)
    problem = part
    return problem, replace(marginal, at=problem.variation[:, active] / spreads[active])


def usual_runs(problem: P, point: Point, noise: Any) -> P:
    """The problem with runs that differ in nothing: every number of their own is zero.

    Args:
        problem: the problem, with what a fit has found of its runs.
        point: values of the shared parameters.
        noise: noise model.
    """
    return cast(P, problem.with_variation(np.zeros_like(problem.variation), point, noise))


def evaluated(problem: P, point: Point, noise: Any) -> tuple[P, Sequence[Any]]:
    """Every run with what is unknown of it where it suits these parameters best, and evaluated.

    Runs that were not fitted, or were fitted with other parameters, have another start or none.
    Gains, errors and shares of the misfit all ask for the same; it is remembered with the problem.

    Args:
        problem: the runs.
        point: values of the shared parameters.
        noise: noise model.
    """
    remembered = _EVALUATED.setdefault(problem, [])
    for at, under, own, filtered in remembered:
        if at is point and under is noise:
            return cast(P, own or problem), filtered
    settled = problem.settled(point, noise)
    spreads = np.maximum(spread_of(problem, noise), 1e-300)
    for _ in range(MOST_STEPS):
        before = settled.variation
        settled, _ = predicted_variation(settled, point, noise)
        if np.all(np.abs(settled.variation - before) < NEAR * spreads):
            break
    filtered = settled.lasting(settled.filtered(point, noise))
    remembered.append((point, noise, None if settled is problem else settled, filtered))
    return cast(P, settled), filtered
