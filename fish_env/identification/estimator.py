"""Gauss-Newton on the whitened prediction errors, under the priors of the fish."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from fish_env.identification.descent import descend, promised
from fish_env.identification.filtering import Filtered, NoiseModel
from fish_env.identification.free import (
    Free,
    Linearised,
    linearise,
    objective,
    objective_of,
    residuals_at,
)
from fish_env.identification.information import block_sums, gradient, information
from fish_env.identification.noise import disturbance_range, fit_noise
from fish_env.identification.phases import settle_phases
from fish_env.identification.problem import Point, Problem
from fish_env.identification.runs import FINER

FloatArray = npt.NDArray[np.float64]
SAME = 0.01
"""Root mean square of the difference between whitened residuals below which they are the same."""
MORE = 3
RESTING = 0.25
"""A fit rests when no combination of parameters would move by the root of this, in deviations."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of an identification.

    Attributes:
        problem: what was fitted.
        effects: names of the effects that were free.
        released: baseline coefficients whose prior was lifted.
        point: estimates.
        noise: noise model.
        names: free parameters, baseline paths first.
        estimates: (n,) in physical units.
        covariance: (n, n) in physical units, corrected for coloured residuals.
        log_likelihood: at the estimates, noise included.
        objective: -2 log likelihood + prior, smaller is better.
        at_bounds: names that ended at a bound.
        held: (k, n) gradients of the bounds that keep the free parameters (baseline in prior
            units) from where the data want them.
        condition: condition number of the information in prior units.
        filtered: filter results at the estimates.
        linearised: residuals and slopes at the estimates.
        in_the_limit: whether estimates and residuals are those of steps ever finer.
    """

    problem: Problem
    effects: tuple[str, ...]
    released: tuple[str, ...]
    point: Point
    noise: NoiseModel
    names: tuple[str, ...]
    estimates: FloatArray
    covariance: FloatArray
    log_likelihood: float
    objective: float
    at_bounds: tuple[str, ...]
    held: FloatArray
    condition: float
    filtered: Sequence[Filtered] = field(repr=False)
    linearised: Linearised = field(repr=False)
    in_the_limit: bool = False

    @cached_property
    def comparing(self) -> Problem:
        """The problem to compare causes with: in long steps, where this fit looks the same in them.

        A fish that turns more quickly, or coefficients far off, may need the usual ones.
        """
        long = self.problem.with_long_steps()
        effects = {path: np.array([value]) for path, value in self.point.effects.items()}
        (seen,) = long.innovations(self.point.z[:, None], effects, self.noise, self.filtered)
        off = np.sqrt(np.mean((seen - self.linearised.residuals) ** 2))
        return long if off < SAME else self.problem

    @cached_property
    def extrapolated(self) -> Fit:
        """This fit with residuals and estimates as ever finer steps have them.

        Where the tail's rate jumps, what steps get wrong is a small share of an effect, but may be
        several standard deviations of its estimate and look like another cause. It goes with the
        step's length, so residuals in two lengths tell those in none (Richardson, 1911); one
        Gauss-Newton step then leads to their minimum. Slopes are as good in the usual steps. A fit
        whose tail moves without jumps is as it is.
        """
        if self.in_the_limit or not self.problem.has_corners(self.point.effects):
            return self
        return _extrapolated(self)

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Normal interval of one parameter."""
        i = self.names.index(name)
        half = float(ndtri(0.5 + level / 2)) * np.sqrt(self.covariance[i, i])
        return float(self.estimates[i] - half), float(self.estimates[i] + half)


def fit(
    problem: Problem,
    effects: Sequence[str] | None = None,
    start: Point | None = None,
    noise: NoiseModel | None = None,
    released: Sequence[str] = (),
    refit_noise: bool = True,
    iterations: int = 5,
    tolerance: float = 0.3,
    rounds: int = 4,
    hopeless: float = np.inf,
    report: Callable[[str], None] = lambda step: None,
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
        hopeless: stop early where the objective, the noise model kept, will not get below this.
        report: told what is being done.
    """
    names = problem.effects if effects is None else tuple(effects)
    free = Free(problem, names, released)
    given = start or problem.start
    values = {**problem.beginning(names), **given.effects}
    vector = free.clip(free.pack(Point(given.z, values)))
    noise = noise or default_noise(problem)
    for round_ in range(rounds if refit_noise else 1):
        problem = settle_phases(problem, free.unpack(vector), noise)
        report(f"fitting parameters, round {round_ + 1}")
        vector, value, filtered = gauss_newton(
            problem, free, vector, noise, iterations, tolerance, hopeless
        )
        if not refit_noise:
            break
        report(f"fitting the noise, round {round_ + 1}")
        last = noise
        noise = _noise_at(problem, free.unpack(vector), noise, final=round_ > 0)
        if _settled(last, noise):
            break
    if refit_noise:
        value, filtered = objective(problem, free, vector, noise)
    return _finish(problem, free, names, tuple(released), vector, noise, value, filtered)


def gauss_newton(
    problem: Problem,
    free: Free,
    vector: FloatArray,
    noise: NoiseModel,
    iterations: int,
    tolerance: float,
    hopeless: float = np.inf,
) -> tuple[FloatArray, float, list[Filtered]]:
    """Gauss-Newton steps with the noise model held.

    Args:
        problem: the problem.
        free: its free parameters.
        vector: (n,) where to begin.
        noise: noise model.
        iterations: most steps.
        tolerance: stop when no combination of parameters would move by more of its standard
            deviation.
        hopeless: stop where the objective will not get below this.

    Returns:
        The vector reached, the objective there, and the filter results.

    Raises:
        LinAlgError: the simulation diverges where the steps begin.
    """
    return descend(
        vector,
        partial(objective, problem, free, noise=noise),
        lambda at, filtered: quadratic(free, at, linearise(problem, free, at, noise, filtered)),
        free.within, iterations, tolerance, hopeless,
    )  # fmt: skip


def quadratic(free: Free, vector: FloatArray, lin: Linearised) -> tuple[FloatArray, FloatArray]:
    """Half the Hessian (n, n) and half the gradient (n,) of the objective, for Gauss-Newton.

    The steps of later slopes are suited to this Hessian.
    """
    hessian = information(lin.slopes, free.prior)
    free.suit_steps(hessian)
    return hessian, gradient(lin.slopes, lin.residuals, free.prior, vector)


def finished(own: Fit) -> Fit:
    """A fit, taken on until its parameters rest.

    A few steps under a few noise models are enough to screen causes by; what is published has to
    be the minimum, for its intervals to be true.
    """
    for _ in range(MORE):
        free = Free(own.problem, own.effects, own.released)
        vector = free.pack(own.point)
        lin = own.linearised
        hessian = information(lin.slopes, free.prior)
        pull = gradient(lin.slopes, lin.residuals, free.prior, vector)
        if promised(hessian, pull, free.within.step(hessian, pull, vector)) < RESTING:
            break
        again = fit(own.problem, own.effects, own.point, own.noise, own.released, rounds=2)
        if again.objective > own.objective:
            break
        own = again
    return own


def _extrapolated(own: Fit) -> Fit:
    free = Free(own.problem, own.effects, own.released)
    vector, lin = free.pack(own.point), own.linearised
    problem, fine = own.problem, own.problem.with_finer_steps()
    (finer,) = residuals_at(fine, free, vector[:, None], own.noise, own.filtered)
    defect = (finer - lin.residuals) * FINER / (FINER - 1)
    before = lin.residuals + defect
    pull = gradient(lin.slopes, before, free.prior, vector)
    moved = free.clip(vector + free.within.step(information(lin.slopes, free.prior), pull, vector))
    (usual,) = residuals_at(problem, free, moved[:, None], own.noise, own.filtered)
    after = usual + defect
    if objective_of(problem, free, moved, after) >= objective_of(problem, free, vector, before):
        moved, after = vector, before
    estimates, residuals = _physical(problem, moved), replace(lin, residuals=after)
    return replace(
        own, point=free.unpack(moved), estimates=estimates, linearised=residuals, in_the_limit=True
    )


def _physical(problem: Problem, vector: FloatArray) -> FloatArray:
    """Estimates (n,) in physical units."""
    count = len(problem.baseline)
    values = problem.baseline.values(vector[:count, None])[:, 0]
    return np.asarray(np.r_[values, vector[count:]], float)


def _settled(before: NoiseModel, after: NoiseModel, share: float = 0.1) -> bool:
    """Whether the disturbance changed by less than a share of itself."""
    pairs = [
        (before.force_sd, after.force_sd),
        (before.moment_sd, after.moment_sd),
        (before.correlation_s, after.correlation_s),
    ]
    return all(abs(np.log(b / a)) < share for a, b in pairs)


def objective_at(
    problem: Problem,
    effects: Sequence[str],
    point: Point,
    noise: NoiseModel,
    released: Sequence[str] = (),
) -> float:
    """-2 log likelihood + prior at a point, without any fitting."""
    free = Free(problem, effects, released)
    values = {**problem.neutral(effects), **point.effects}
    vector = free.clip(free.pack(Point(point.z, values)))
    problem = settle_phases(problem, free.unpack(vector), noise)
    return objective(problem, free, vector, noise)[0]


def default_noise(problem: Problem) -> NoiseModel:
    """Sensor noise from differences of the data, and a disturbance of a few millinewton."""
    return NoiseModel(problem.sensor_sd, 3e-3, 1e-4, 1.0)


def _noise_at(problem: Problem, point: Point, noise: NoiseModel, final: bool) -> NoiseModel:
    """Noise model of largest likelihood at a point, from at most four runs.

    The search starts from the present one and from a small disturbance, so that a disturbance
    which once stood in for a misfit does not stay.
    """
    few = problem.subset(4)
    within = disturbance_range(problem.fish)
    found = noise
    for _ in range(3):
        filtered, made_with = few.filtered(point, found, keep_slopes=True), found
        # The lean filter will do: covariances are replayed, and no effect is computed again.
        replay = partial(few.lean_filter.replay, filtered, made_with)
        small = NoiseModel(found.sensor_sd, 3e-3, 1e-4, 1.0, found.phase_sd)
        start = max((found, small), key=replay)
        found = fit_noise(replay, start, within, 45, problem.sensor_sd if final else None)
        if _settled(made_with, found, 0.4):
            break
    return found


def _finish(
    problem: Problem,
    free: Free,
    effects: tuple[str, ...],
    released: tuple[str, ...],
    vector: FloatArray,
    noise: NoiseModel,
    value: float,
    filtered: Sequence[Filtered],
) -> Fit:
    lin = linearise(problem, free, vector, noise, filtered)
    hessian = information(lin.slopes, free.prior)
    pull = gradient(lin.slopes, lin.residuals, free.prior, vector)
    inverse = np.asarray(np.linalg.inv(hessian), float)
    covariance = sandwich(lin, inverse, free.prior)
    scale = free.scale()
    physical = scale @ covariance @ scale.T
    point = free.unpack(vector)
    estimates = _physical(problem, vector)
    bounds = (*free.coefficients_at_bounds(estimates), *free.effects_at_bounds(vector))
    diagonal = np.sqrt(np.diag(hessian))
    condition = float(np.linalg.cond(hessian / np.outer(diagonal, diagonal)))
    return Fit(
        problem, effects, released, point, noise, free.names, estimates, physical,
        float(sum(r.log_likelihood for r in filtered)), value, bounds,
        free.within.held(hessian, pull, vector), condition, filtered, lin,
    )  # fmt: skip


def sandwich(lin: Linearised, inverse: FloatArray, prior: FloatArray) -> FloatArray:
    """Covariance corrected for residuals that are still coloured (Morelli and Klein, 1995).

    Scores are summed over blocks longer than the correlation; where their spread exceeds what
    white residuals give, the covariance grows by that much. It never shrinks.
    """
    sums = block_sums(lin.slopes * lin.residuals[:, None], lin.run_of, lin.time_of)
    sums -= sums.mean(axis=0)
    meat = sums.T @ sums * len(sums) / max(len(sums) - 1, 1)
    robust = inverse @ (meat + np.diag(prior)) @ inverse
    inflation = np.sqrt(np.maximum(np.diag(robust) / np.diag(inverse), 1.0))
    return np.asarray(inverse * np.outer(inflation, inflation))
