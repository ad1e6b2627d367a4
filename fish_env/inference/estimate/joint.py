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
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.free import (
    Free,
    least_of,
    objective_with,
    own_objectives,
    quadratic,
    spread_of,
)
from fish_env.inference.estimate.gauss_newton import AS_PROMISED
from fish_env.inference.estimate.run_variation import Marginal
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.problem import Problem

TRIALS = ((0.0, 1.0), (0.0, 0.4), (0.03, 1.0), (0.3, 1.0), (3.0, 1.0), (30.0, 1.0))
"""Damping and share of the way: the whole step, then part of it, then damped ones (Marquardt, 1963,
J. SIAM 11, 431)."""
UNDAMPED = sum(damping == 0.0 for damping, _ in TRIALS)
OWN_SHARES = (0.4, 0.0)
"""Parts of its own step that a run goes which loses by the whole."""
ENOUGH, FORESEEN = 1.0, 0.1
"""Decrease of -2 log likelihood below which steps follow its roughness, and the share of what the
linear model foresees below which it is of no use: where one run has a sharp corner, most of what is
foreseen lies beyond it."""


@dataclass(frozen=True, eq=False)
class Joint:
    """Shared parameters and the runs' own numbers, and what they leave.

    Attributes:
        problem: with the runs' own numbers in place.
        vector: (n,) shared parameters.
        filtered: evaluation there.
        value: -2 log likelihood + both priors.
        of_runs: (R,) -2 log likelihood + prior of its own numbers, of each run; infinite where it
            diverges.
    """

    problem: Problem
    vector: FloatArray
    filtered: Sequence[Evaluation]
    value: float
    of_runs: FloatArray

    @property
    def residuals(self) -> FloatArray:
        """(D,) whitened."""
        return np.concatenate([run.residuals for run in self.filtered])


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
    free, noise = slopes.free, slopes.noise
    at = _evaluated(problem, free, vector, noise)
    if not np.isfinite(at.value):
        at = _without_lost_numbers(at, free, noise)
    if not np.isfinite(at.value):
        raise np.linalg.LinAlgError("the simulation diverges at the start of the fit")
    at = _agreed(at, free, noise)
    left, exact, first, kept = iterations, True, 0, 1.0
    model: _Model | None = None
    while left:
        model = _Model(slopes, at, None if exact else model)
        predicted = at.value - model.foreseen(*model.step(0.0))
        # What promised more than it kept will do so again.
        if at.value - left * kept * predicted > give_up_above:
            break
        better, used = None, first
        if predicted >= tolerance**2:
            better, used = _better(model, noise, at, first)
        gained = 0.0 if better is None else at.value - better.value
        at = better or at
        del better  # an evaluation takes much memory
        if exact and gained < max(ENOUGH, FORESEEN * predicted):
            break
        if predicted > 0.0:
            kept = min(max(gained / predicted, FORESEEN), 1.0)
        nearly_linear = gained > 0.0 and gained >= AS_PROMISED * predicted
        left -= int(exact or nearly_linear)
        first = max(used - 1, 0)
        exact = not nearly_linear or first >= UNDAMPED
    if model is not None and model.exact and model.at is at:
        marginal: Marginal | None = model.own
    else:
        marginal = slopes.marginal(at.problem, at.vector, at.filtered)
    assert marginal is not None
    value = objective_with(free, at.vector, at.filtered, marginal)
    return at.problem, at.vector, value, at.filtered, marginal


def _evaluated(problem: Problem, free: Free, vector: FloatArray, noise: Any) -> Joint:
    """Everything at a point; infinite where no vehicle can be so, or the simulation diverges."""
    if not problem.baseline.possible(vector[: free.count]):
        return Joint(problem, vector, (), np.inf, np.full(problem.run_count, np.inf))
    filtered = problem.filtered(free.unpack(vector), noise)
    of_runs = own_objectives(problem, filtered, noise)
    value = _with_prior(free, vector, of_runs)
    return Joint(problem, vector, filtered, value, of_runs)


def _without_lost_numbers(at: Joint, free: Free, noise: Any) -> Joint:
    """The same with usual runs in place of those that diverge.

    Numbers that suit another model may be where this one has no motion.
    """
    lost = ~np.isfinite(at.of_runs)
    numbers = np.where(lost[:, None], 0.0, at.problem.variation)
    if np.array_equal(numbers, at.problem.variation):
        return at
    usual = at.problem.with_variation(numbers, free.unpack(at.vector), noise)
    return _evaluated(usual, free, at.vector, noise)


def _agreed(at: Joint, free: Free, noise: Any) -> Joint:
    """The same numbers, with what follows from the motion nearer to that motion.

    The value may rise by that. Where it rises by more than the noise of all residuals, the motion
    and what follows from it drive each other away, and stay as they are.
    """
    problem = at.problem
    if not problem.variation.any():
        return at
    point = free.unpack(at.vector)
    try:
        moved = problem.with_variation(problem.variation, point, noise, at.filtered)
        agreed = at if moved is problem else _evaluated(moved, free, at.vector, noise)
    except np.linalg.LinAlgError:
        return at
    return agreed if agreed.value < at.value + len(at.residuals) else at


class _Model:
    """The linear model of residuals about a point, by shared parameters and by own numbers.

    Args:
        slopes: the shared parameters, the noise model, and the slopes on the way.
        at: the point.
        near: a model whose slopes by own numbers and coefficients are near enough; None to work
            out all of them.
    """

    def __init__(self, slopes: Slopes, at: Joint, near: _Model | None) -> None:
        problem, free, noise = at.problem, slopes.free, slopes.noise
        self.free, self.at, self.exact = free, at, near is None
        self.bounds = free.bounds.beside(at.vector)
        self.active = np.flatnonzero(spread_of(problem, noise))
        self.spread = spread_of(problem, noise)[self.active]
        self.least = least_of(problem, self.active)
        linearise = slopes.exact if near is None else slopes.quick
        self.lin = linearise(problem, at.vector, at.filtered)
        own: Marginal | None
        if near is None:
            own = slopes.marginal(problem, at.vector, at.filtered)
        else:
            moved = replace(near.own, at=problem.variation[:, self.active] / self.spread)
            own = slopes.alike(moved, problem, self.lin)
        assert own is not None
        self.own: Marginal = own
        # A number that is held at zero is none that the shared parameters can count on.
        held = (own.at <= self.least) & (own.predicted(self.lin.residuals, 0.0, self.least) <= 0.0)
        movable = replace(own, slopes=np.where(held[own.run_of], 0.0, own.slopes))
        whitened = movable.rows(self.lin.slopes.T.copy())
        left = movable.residuals(self.lin.residuals.copy())
        reduced = replace(self.lin, residuals=left, slopes=whitened.T)
        self.hessian, self.gradient = quadratic(free, at.vector, reduced)

    def step(self, damping: float, share: float = 1.0) -> tuple[FloatArray, FloatArray]:
        """A vector (n,), and the own numbers (R, K) that suit it best, in units of their spread.

        Args:
            damping: by how much more curvature than there is both are held where they are.
            share: how much of the way both go.
        """
        bounds, vector = self.bounds, self.at.vector
        stiff = self.hessian + damping * np.diag(np.diag(self.hessian))
        moved = bounds.clip(vector + bounds.step(stiff, self.gradient, vector))
        left = self.lin.residuals + self.lin.slopes @ (moved - vector)
        own = self.own.predicted(left, damping, self.least)
        begun = self.own.at
        return bounds.clip(vector + share * (moved - vector)), begun + share * (own - begun)

    def foreseen(self, vector: FloatArray, own: FloatArray) -> float:
        """The value that the linear model foresees of a step."""
        before, at = self.lin.residuals, self.at.vector
        shift = np.einsum("dk,dk->d", self.own.slopes, (own - self.own.at)[self.own.run_of])
        after = before + self.lin.slopes @ (vector - at) + shift
        prior = self.free.prior @ (vector * vector - at * at) + np.sum(own**2 - self.own.at**2)
        return float(self.at.value + after @ after - before @ before + prior)

    def numbers(self, own: FloatArray) -> FloatArray:
        """The runs' own numbers (R, all) with those that vary (R, K) in their place."""
        found = self.at.problem.variation.copy()
        found[:, self.active] = own * self.spread
        return found


def _better(model: _Model, noise: Any, at: Joint, first: int) -> tuple[Joint | None, int]:
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
            tried = _with_own_steps(model, noise, at, vector, own)
        except np.linalg.LinAlgError:
            continue
        if tried.value < best.value:
            tried = _agreed(tried, model.free, noise)
        if tried.value < best.value:
            best, used = tried, number
        elif best is not at:
            break
        lost.append((TRIALS[number][1], tried.value - at.value))
        if best is at and number + 1 == UNDAMPED and _most_gained(lost) < ENOUGH:
            break  # it is the minimum, but for what slopes leave out: how gains change
        if best is not at and not (model.exact and at.value - best.value < FORESEEN * foreseen):
            break
    return (None if best is at else best), used


def _most_gained(lost: Sequence[tuple[float, float]]) -> float:
    """The most that a line gains, by the parabola through its begin and two points.

    Args:
        lost: share of the way along it, and what the objective rises by, of each point.
    """
    if len(lost) < 2 or not np.isfinite(lost).all():
        return np.inf
    (far, more), (near, less) = lost
    curvature = (more / far - less / near) / (far - near)
    slope = more / far - curvature * far
    if curvature <= 0.0:
        return np.inf
    return slope**2 / (4.0 * curvature) if slope < 0.0 else 0.0


def _with_own_steps(
    model: _Model, noise: Any, at: Joint, vector: FloatArray, own: FloatArray
) -> Joint:
    """Everything at a step, each run as far along its own part of it as its likelihood rises.

    A run with a sharp corner stays, and does not hold back the others. Where most runs lose, it is
    the step that is wrong.

    Args:
        model: about where the step begins.
        noise: noise model.
        at: where it begins.
        vector: (n,) shared parameters after it.
        own: (R, K) the runs' own numbers after it, in units of their spread.
    """
    free, point = model.free, model.free.unpack(vector)
    moved = at.problem.with_variation(model.numbers(own), point, noise, at.filtered)
    tried = _evaluated(moved, free, vector, noise)
    worse = np.flatnonzero(~(tried.of_runs < at.of_runs + ENOUGH)).tolist()
    if not worse or not tried.filtered or 2 * len(worse) > at.problem.run_count:
        return tried
    chosen, filtered, values = own.copy(), list(tried.filtered), tried.of_runs.copy()
    for share in OWN_SHARES:
        less = model.own.at + share * (own - model.own.at)
        near = [at.filtered[i] for i in worse]
        part = at.problem.some(worse).with_variation(model.numbers(less)[worse], point, noise, near)
        found = part.filtered(point, noise)
        pairs = zip(worse, found, own_objectives(part, found, noise), strict=True)
        for i, evaluation, value in pairs:
            if value < values[i]:
                chosen[i], filtered[i], values[i] = less[i], evaluation, value
        worse = [i for i in worse if not values[i] < at.of_runs[i] + ENOUGH]
        if not worse:
            break
    mixed = at.problem.with_variation(model.numbers(chosen), point, noise, at.filtered)
    value = _with_prior(free, vector, values)
    return Joint(mixed, vector, filtered, value, values)


def _with_prior(free: Free, vector: FloatArray, of_runs: FloatArray) -> float:
    """-2 log likelihood + both priors, from what each run (R,) has of it."""
    return float(free.prior @ (vector * vector) + of_runs.sum())
