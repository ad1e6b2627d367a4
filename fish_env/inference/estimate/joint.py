"""Gauss-Newton on what all runs share and on each run's own numbers, in the same steps.

Taken in turns, either would first explain what belongs to the other: a coefficient that is off
looks like trim in every run, and a late sensor like a clock. So each step is that of one linear
model of both. Its equations have an arrow's shape: a run's own numbers are eliminated run by run,
the shared ones are solved for within their bounds, and the own ones follow. Both then go the same
part of the way, as far as the joint likelihood rises. Source: Lindstrom and Bates (1990),
Biometrics 46, 673; the elimination is the Schur complement of bundle adjustment (Triggs and
others, 2000).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.free import Free
from fish_env.inference.estimate.gauss_newton import (
    AS_PROMISED,
    LEAST_KEPT,
    kept_of,
    most_gained,
)
from fish_env.inference.estimate.joint_model import Joint, Model, evaluated
from fish_env.inference.estimate.own_steps import ENOUGH, with_own_steps
from fish_env.inference.estimate.run_variation import Marginal
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.problem import Problem

TRIALS = ((0.0, 1.0), (0.0, 0.4), (0.03, 1.0), (0.3, 1.0), (3.0, 1.0), (30.0, 1.0))
"""Damping and share of the way: the whole step, then part of it, then damped ones (Marquardt, 1963,
J. SIAM 11, 431)."""
UNDAMPED = sum(damping == 0.0 for damping, _ in TRIALS)


def descend_jointly(
    problem: Problem,
    slopes: Slopes,
    vector: FloatArray,
    iterations: int,
    tolerance: float,
    give_up_above: float = np.inf,
) -> tuple[Problem, FloatArray, float, Sequence[Evaluation], Marginal]:
    """Estimate shared parameters together with the numbers of every run.

    Args:
        problem: the runs, with the numbers to begin from.
        slopes: the shared parameters, the noise model with the spreads of the runs' numbers, and
            the slopes on the way.
        vector: (n,) where they begin.
        iterations: most steps.
        tolerance: stop when no combination of parameters would move by more of its standard
            deviation.
        give_up_above: stop where the objective will not get below this.

    Returns:
        The problem with the runs' numbers, the vector, the objective with these integrated out, the
        evaluation, and how to integrate them out.

    Raises:
        LinAlgError: the simulation diverges where the steps begin.
    """
    at = _begun(problem, slopes.free, vector, slopes.noise)
    left, exact, first, kept = iterations, True, 0, 1.0
    model: Model | None = None
    while left:
        near = None if exact or model is None else model.own
        model = None  # it takes much memory, and goes before the next is worked out
        model = Model(slopes, at, near)
        predicted = at.value - model.foreseen(*model.step(0.0))
        # What promised more than it kept will do so again.
        least = at.marginal_value(model.own) if np.isfinite(give_up_above) else -np.inf
        if least - left * kept * predicted > give_up_above:
            break
        better, used = None, first
        if predicted >= tolerance**2:
            better, used = _better(model, slopes.noise, at, first)
        gained = 0.0 if better is None else at.value - better.value
        at = better or at
        del better  # an evaluation takes much memory
        if exact and gained < max(ENOUGH, LEAST_KEPT * predicted):
            break
        kept = kept_of(gained, predicted)
        nearly_linear = gained > 0.0 and gained >= AS_PROMISED * predicted
        left -= int(exact or nearly_linear)
        first = max(used - 1, 0)
        exact = not nearly_linear or first >= UNDAMPED
    if model is not None and model.exact and model.at is at:
        marginal: Marginal | None = model.own
    else:
        marginal = slopes.marginal(at.problem, at.vector, at.filtered)
    assert marginal is not None
    return at.problem, at.vector, at.marginal_value(marginal), at.filtered, marginal


def _begun(problem: Problem, free: Free, vector: FloatArray, noise: Any) -> Joint:
    """Where steps begin.

    Raises:
        LinAlgError: the simulation diverges there.
    """
    at = evaluated(problem, free, vector, noise)
    if not np.isfinite(at.value):
        at = _without_lost_numbers(at, free, noise)
    if not np.isfinite(at.value):
        raise np.linalg.LinAlgError("the simulation diverges at the start of the fit")
    return _agreed(at, free, noise)


def _without_lost_numbers(at: Joint, free: Free, noise: Any) -> Joint:
    """The same with usual runs in place of those that diverge.

    Numbers that suit another model may be where this one has no motion.
    """
    lost = ~np.isfinite(at.of_runs)
    numbers = np.where(lost[:, None], 0.0, at.problem.variation)
    if np.array_equal(numbers, at.problem.variation):
        return at
    usual = at.problem.with_variation(numbers, free.unpack(at.vector), noise)
    return evaluated(usual, free, at.vector, noise)


def _agreed(at: Joint, free: Free, noise: Any) -> Joint:
    """The same numbers, with what follows from the motion nearer to that motion.

    The value may rise by that. Where that of a run rises by more than the noise of its residuals,
    the motion and what follows from it drive each other away, and both stay as they are.
    """
    if not (at.problem.variation.any() or at.problem.samples_follow):
        return at
    problem, point = at.problem, free.unpack(at.vector)
    try:
        moved = problem.with_variation(problem.variation, point, noise, at.filtered)
        agreed = at if moved is problem else evaluated(moved, free, at.vector, noise)
    except np.linalg.LinAlgError:
        return at
    noise_of_runs = np.array([len(run.residuals) for run in at.filtered])
    stays = ~(agreed.of_runs < at.of_runs + noise_of_runs)
    if agreed is at or not stays.any():
        return agreed
    pairs = list(zip(stays.tolist(), at.filtered, agreed.filtered, strict=True))
    near = [None if still else before for still, before, _ in pairs]
    moved = problem.with_variation(problem.variation, point, noise, near)
    filtered = [before if still else after for still, before, after in pairs]
    return at if moved is problem else Joint.of(moved, free, at.vector, filtered, noise)


def _better(model: Model, noise: Any, at: Joint, first: int) -> tuple[Joint | None, int]:
    """The boldest step that leads to a lower value, None where none does, and its number.

    It counts with what follows from the motion after it: what a sensor makes of the motion before
    may seem to explain more.

    Args:
        model: about where steps begin; where its slopes are not exact, no damped one is tried.
        noise: noise model.
        at: where steps begin.
        first: number of the first to try. After one that needed so much damping, bolder ones lead
            nowhere, often to where the simulation diverges.
    """
    last = len(TRIALS) if model.exact else UNDAMPED
    best, used = at, first
    lost: list[tuple[float, float]] = []
    for number in range(first, last):
        vector, own = model.step(*TRIALS[number])
        foreseen = at.value - model.foreseen(vector, own)
        if number > first and foreseen < max(ENOUGH, at.value - best.value):
            break  # a decrease that would end the steps anyway, or one that was reached
        if not at.problem.baseline.possible(vector[: model.free.count]):
            continue
        try:
            tried = with_own_steps(model, noise, at, vector, own)
        except np.linalg.LinAlgError:
            continue
        if tried.value < best.value:
            tried = _agreed(tried, model.free, noise)
        if tried.value < best.value:
            best, used = tried, number
        elif best is not at:
            break
        lost.append((TRIALS[number][1], tried.value - at.value))
        if best is at and number + 1 == UNDAMPED and most_gained(lost) < ENOUGH:
            break  # it is the minimum, but for what slopes leave out: how gains change
        if best is not at and not (model.exact and at.value - best.value < LEAST_KEPT * foreseen):
            break
    return (None if best is at else best), used
