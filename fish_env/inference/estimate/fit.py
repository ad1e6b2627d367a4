"""Gauss-Newton on the whitened prediction errors, under the priors of the coefficients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import ndtri

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.estimate.bounds import coefficients_at_bounds
from fish_env.inference.estimate.covariance import sandwich
from fish_env.inference.estimate.free import (
    Free,
    Linearised,
    objective,
    quadratic,
    spread_of,
)
from fish_env.inference.estimate.gauss_newton import Linearise, Quadratic, descend
from fish_env.inference.estimate.information import gradient, information, leverage, prior_precision
from fish_env.inference.estimate.joint import descend_jointly
from fish_env.inference.estimate.own_steps import ENOUGH
from fish_env.inference.estimate.rounds import Reached, last, noise_of
from fish_env.inference.estimate.run_variation import Marginal
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.hypotheses import Coefficient, ParameterId
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report, silent

SAME = 0.01
"""Root mean square of the difference between whitened residuals below which they are the same."""
MOST_FOLLOWED = 6
"""Descents, and rounds, in turn with samples that follow the motion."""
USUAL_STEPS, FEWER_STEPS = 5, 3
"""Most steps in a round; the fewer are enough to compare causes by, and to go on from a fit."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of an identification.

    Attributes:
        problem: what was fitted.
        effects: names of the effects that were free.
        released: baseline coefficients whose prior was lifted.
        point: estimates.
        noise: noise model.
        ids: free parameters, coefficients first.
        estimates: (n,) in physical units.
        covariance: (n, n) in physical units, corrected for coloured residuals.
        log_likelihood: at the estimates, noise included.
        objective: -2 log likelihood + prior, smaller is better.
        at_bounds: parameters that ended at a bound.
        active: (k, n) gradients of the active constraints (baseline in prior units).
        condition: condition number of the information in prior units.
        filtered: filter results at the estimates.
        linearised: residuals and slopes at the estimates.
        profiles: 95 % intervals by likelihood, of the parameters that have one.
    """

    problem: Problem
    effects: tuple[str, ...]
    released: tuple[Coefficient, ...]
    point: Point
    noise: Any
    ids: tuple[ParameterId, ...]
    estimates: FloatArray
    covariance: FloatArray
    log_likelihood: float
    objective: float
    at_bounds: tuple[ParameterId, ...]
    active: FloatArray
    condition: float
    filtered: Sequence[Any] = field(repr=False)
    linearised: Linearised = field(repr=False)
    profiles: Mapping[ParameterId, tuple[float, float]] = field(default_factory=dict)

    @cached_property
    def leverage(self) -> FloatArray:
        """Share of each residual that the free parameters follow (D,)."""
        baseline = self.problem.baseline
        prior = prior_precision(baseline, len(self.ids) - len(baseline), self.released)
        return leverage(self.linearised.slopes, prior)

    @cached_property
    def _white_variance(self) -> FloatArray:
        """Variance (n,) of the estimates, in physical units, if the residuals were white."""
        free = Free(self.problem, self.effects, self.released)
        scale = free.scale()
        inverse = np.linalg.inv(information(self.linearised.slopes, free.prior))
        return np.asarray(np.diag(scale @ inverse @ scale.T))

    @cached_property
    def remaining_gradient(self) -> FloatArray:
        """Half the gradient (n,) of the objective that the steps left, beside active bounds.

        Zero at the minimum; steps end before it, where little more can be gained.
        """
        free, lin = Free(self.problem, self.effects, self.released), self.linearised
        pull = gradient(lin.slopes, lin.residuals, free.prior, free.pack(self.point))
        held = np.linalg.lstsq(self.active.T, pull, rcond=None)[0]
        return np.asarray(pull - self.active.T @ held)

    def inflation(self, at: Sequence[int] | IntArray) -> float:
        """How much larger coloured residuals make the variance of some parameters (at least 1).

        Args:
            at: their numbers.
        """
        return float(max(1.0, (np.diag(self.covariance)[at] / self._white_variance[at]).max()))

    @cached_property
    def comparing(self) -> Problem:
        """The problem to compare causes with: in long steps, where this fit looks the same in them.

        A vehicle that turns more quickly, or coefficients far off, may need the usual ones.
        """
        long = self.problem.with_long_steps()
        return long if self.looks_alike(long) else self.problem

    def looks_alike(self, other: Problem) -> bool:
        """Whether this fit leaves the same residuals in other steps of the simulation.

        Args:
            other: the same problem in these.
        """
        effects = {id: np.array([value]) for id, value in self.point.effects.items()}
        (seen,) = other.innovations(self.point.z[:, None], effects, self.noise, self.filtered)
        off = np.sqrt(np.mean((self.marginalised(seen) - self.linearised.residuals) ** 2))
        return bool(off < SAME)

    def marginalised(self, residuals: FloatArray) -> FloatArray:
        """Residuals (D,) with what the runs differ in integrated out."""
        marginal = self.linearised.marginal
        return residuals if marginal is None else marginal.residuals(residuals)

    def interval(
        self, parameter: ParameterId, level: float = POLICY.interval_level
    ) -> tuple[float, float]:
        """Interval of one parameter: by likelihood where that was worked out, else normal."""
        if level == POLICY.interval_level and parameter in self.profiles:
            return self.profiles[parameter]
        i = self.ids.index(parameter)
        half = float(ndtri(0.5 + level / 2)) * np.sqrt(self.covariance[i, i])
        return float(self.estimates[i] - half), float(self.estimates[i] + half)


def fit(
    problem: Problem,
    effects: Sequence[str] | None = None,
    start: Point | None = None,
    noise: Any | None = None,
    released: Sequence[Coefficient] = (),
    refit_noise: bool = True,
    iterations: int = USUAL_STEPS,
    tolerance: float = 0.3,
    rounds: int = 4,
    give_up_above: float = np.inf,
    report: Report = silent,
) -> Fit:
    """Estimate baseline coefficients and effect parameters.

    Args:
        problem: what to fit.
        effects: effects whose parameters are free; default: those of the problem.
        start: first values; default: nominal.
        noise: noise model to start from, or to keep.
        released: baseline coefficients whose prior is lifted.
        refit_noise: estimate the disturbance again after the first step and at the end.
        iterations: most Gauss-Newton steps in a round.
        tolerance: stop when no combination of parameters would move by more of its standard
            deviation.
        rounds: most alternations between parameters and disturbance.
        give_up_above: stop early where the objective will not get below this under the same noise.
        report: told what is being done.
    """
    names = problem.effects if effects is None else tuple(effects)
    free = Free(problem, names, released)
    given = start or problem.start
    values = {**problem.beginning(names), **given.effects}
    vector = free.bounds.clip(free.pack(Point(given.z, values)))
    noise = noise or problem.default_noise()
    limits = (iterations, tolerance, give_up_above)
    if refit_noise:
        found = _in_turns(problem, free, vector, noise, limits, rounds, report)
        problem, vector, slopes, filtered, value, marginal = found
    else:
        report("fitting parameters")
        problem, slopes = problem.settled(free.unpack(vector), noise), Slopes(free, noise)
        problem, vector, value, filtered, marginal = _descended(problem, slopes, vector, limits, ())
    return _finish(problem, slopes, names, vector, value, filtered, marginal)


def _in_turns(
    problem: Problem,
    free: Free,
    vector: FloatArray,
    noise: Any,
    limits: tuple[int, float, float],
    rounds: int,
    report: Report,
) -> tuple[Problem, FloatArray, Slopes, Sequence[Evaluation], float, Marginal | None]:
    """Parameters and noise, each fitted beside the other.

    The limits of a round are most steps, the tolerance, and the objective to give up at.
    """
    filtered: Sequence[Evaluation] = ()
    reached: Reached | None = None
    for round_ in range(max(rounds, MOST_FOLLOWED)):
        if round_ >= rounds and not problem.samples_follow:
            break
        report(f"fitting parameters, round {round_ + 1}")
        slopes = Slopes(free, noise)
        try:
            begun = problem.settled(free.unpack(vector), noise)
            if spread_of(begun, noise).any():
                filtered = ()  # of other noise, and large
            problem, vector, value, filtered, _ = _descended(
                begun, slopes, vector, limits, filtered
            )
        except np.linalg.LinAlgError:
            if reached is None:
                raise
            value = np.inf  # a filter that follows the data less is not stable beside this model
        if reached is not None and not value < reached.value:
            problem, vector, noise, filtered = *reached[:3], ()
            break
        reached = Reached(problem, vector, noise, value)
        report(f"fitting the noise, round {round_ + 1}")
        noise = noise_of(slopes, problem, vector, filtered, round_ > 0)
        if reached.noise.is_close(noise, POLICY.same_noise):
            break
    return last(reached or Reached(problem, vector, None, np.inf), free, noise, filtered)


def _descended(
    problem: Problem,
    slopes: Slopes,
    vector: FloatArray,
    limits: tuple[int, float, float],
    near: Sequence[Evaluation],
) -> tuple[Problem, FloatArray, float, Sequence[Evaluation], Marginal | None]:
    """Gauss-Newton steps by the shared parameters, and by the runs' own numbers where they differ.

    Samples that follow the motion and the estimates settle in turns.

    As :func:`~fish_env.inference.estimate.joint.descend_jointly` returns it.
    """
    if spread_of(problem, slopes.noise).any():
        return descend_jointly(problem, slopes, vector, *limits)
    vector, value, filtered = gauss_newton(problem, slopes, vector, *limits, near=near)
    for _ in range(MOST_FOLLOWED if problem.samples_follow else 0):
        before, problem = value, problem.settled(slopes.free.unpack(vector), slopes.noise, True)
        vector, value, filtered = gauss_newton(problem, slopes, vector, *limits)
        if abs(before - value) < ENOUGH:
            break
    return problem, vector, value, filtered, None


def gauss_newton(
    problem: Problem,
    slopes: Slopes,
    vector: FloatArray,
    iterations: int,
    tolerance: float,
    give_up_above: float = np.inf,
    marginal: Marginal | None = None,
    near: Sequence[Evaluation] = (),
) -> tuple[FloatArray, float, Sequence[Evaluation]]:
    """Gauss-Newton steps with the noise model held.

    Args:
        problem: the problem.
        slopes: its free parameters and noise model, and the slopes on the way.
        vector: (n,) where to begin.
        iterations: most steps.
        tolerance: stop when no combination of parameters would move by more of its standard
            deviation.
        give_up_above: stop where the objective will not get below this.
        marginal: integrates out what the runs differ in.
        near: evaluation at a vector close to where the steps begin, where there is one.

    Returns:
        The vector reached, the objective there, and the evaluation.

    Raises:
        LinAlgError: the simulation diverges where the steps begin.
    """
    free, last = slopes.free, near

    def evaluate(at: FloatArray) -> tuple[float, Sequence[Evaluation]]:
        return objective(problem, free, at, slopes.noise, marginal, last)

    def modelled(linearise: Callable[..., Linearised]) -> Linearise[Sequence[Evaluation]]:
        def model(at: FloatArray, filtered: Sequence[Evaluation]) -> Quadratic:
            nonlocal last
            last = filtered
            return quadratic(free, at, linearise(problem, at, filtered, marginal))

        return model

    limits = (free.bounds.beside(vector), iterations, tolerance, give_up_above)
    exactly, quickly = modelled(slopes.exact), modelled(slopes.quick)
    return descend(vector, evaluate, exactly, *limits, quickly=quickly)


def _physical(problem: Problem, vector: FloatArray) -> FloatArray:
    """Estimates (n,) in physical units."""
    count = len(problem.baseline)
    values = problem.baseline.values(vector[:count, None])[:, 0]
    return np.asarray(np.r_[values, vector[count:]], float)


def objective_at(
    problem: Problem,
    effects: Sequence[str],
    point: Point,
    noise: Any,
    released: Sequence[Coefficient] = (),
) -> float:
    """-2 log likelihood + prior at a point, without any fitting; infinite where it diverges."""
    free = Free(problem, effects, released)
    values = {**problem.neutral(effects), **point.effects}
    vector = free.bounds.clip(free.pack(Point(point.z, values)))
    try:
        settled = problem.settled(free.unpack(vector), noise)
        value, _ = objective(settled, free, vector, noise)
    except np.linalg.LinAlgError:
        return np.inf
    return value if np.isfinite(value) else np.inf


def _finish(
    problem: Problem,
    slopes: Slopes,
    effects: tuple[str, ...],
    vector: FloatArray,
    value: float,
    filtered: Sequence[Evaluation],
    marginal: Marginal | None,
) -> Fit:
    free, noise = slopes.free, slopes.noise
    released = free.released
    lin = slopes.exact(problem, vector, filtered, marginal)
    hessian = information(lin.slopes, free.prior)
    pull = gradient(lin.slopes, lin.residuals, free.prior, vector)
    inverse = np.asarray(np.linalg.inv(hessian), float)
    covariance = sandwich(lin, inverse, free.prior, problem.clusters())
    scale = free.scale()
    physical = scale @ covariance @ scale.T
    point = free.unpack(vector)
    estimates = _physical(problem, vector)
    stuck = coefficients_at_bounds(problem.baseline, estimates[: free.count], released)
    bounds: tuple[ParameterId, ...] = (*stuck, *free.effects_at_bounds(vector))
    diagonal = np.sqrt(np.diag(hessian))
    condition = float(np.linalg.cond(hessian / np.outer(diagonal, diagonal)))
    return Fit(
        problem, effects, released, point, noise, free.ids, estimates, physical,
        float(sum(r.log_likelihood for r in filtered)), value, bounds,
        free.bounds.beside(vector).active(hessian, pull, vector), condition,
        problem.lasting(filtered), lin,
    )  # fmt: skip
