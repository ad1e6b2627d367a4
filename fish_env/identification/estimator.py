"""Gauss-Newton on the whitened prediction errors, under the priors of the fish."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import numpy.typing as npt

from fish_env.identification.filtering import Filtered, NoiseModel
from fish_env.identification.information import block_sums, information, prior_precision
from fish_env.identification.noise import fit_noise
from fish_env.identification.phases import settle_phases
from fish_env.identification.problem import Point, Problem
from fish_env.identification.products import inner

FloatArray = npt.NDArray[np.float64]
Z_STEP = 0.05


@dataclass(frozen=True, eq=False)
class Linearised:
    """Residuals and their slopes at a point: all that estimates and tests need.

    Attributes:
        residuals: (D,) whitened innovations.
        slopes: (D, n) derivative by each free parameter, baseline (in prior units) first.
        run_of: (D,) index of the run of each residual.
        time_of: (D,) time of each residual in its run (s).
    """

    residuals: FloatArray
    slopes: FloatArray
    run_of: npt.NDArray[np.int64]
    time_of: FloatArray


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
        condition: condition number of the information in prior units.
        filtered: filter results at the estimates.
        linearised: residuals and slopes at the estimates.
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
    condition: float
    filtered: Sequence[Filtered] = field(repr=False)
    linearised: Linearised = field(repr=False)

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Normal interval of one parameter."""
        from scipy.stats import norm

        i = self.names.index(name)
        half = float(norm.ppf(0.5 + level / 2)) * np.sqrt(self.covariance[i, i])
        return float(self.estimates[i] - half), float(self.estimates[i] + half)


class _Free:
    """Bookkeeping of the vector [z, effect parameters]."""

    def __init__(self, problem: Problem, effects: Iterable[str], released: Iterable[str]) -> None:
        self.problem = problem
        self.freedoms = problem.freedoms(effects)
        self.count = len(problem.baseline)
        self.names = (*problem.baseline.paths, *(f.path for f in self.freedoms))
        self.prior = prior_precision(problem.baseline, len(self.freedoms), released)
        self.steps = np.r_[np.full(self.count, Z_STEP), [f.step for f in self.freedoms]]

    def pack(self, point: Point) -> FloatArray:
        return np.asarray(np.r_[point.z, [point.effects[f.path] for f in self.freedoms]], float)

    def unpack(self, vector: FloatArray) -> Point:
        values = vector[self.count :].tolist()
        paths = [f.path for f in self.freedoms]
        return Point(vector[: self.count].copy(), dict(zip(paths, values, strict=True)))

    def clip(self, vector: FloatArray) -> FloatArray:
        lower = np.array([f.lower for f in self.freedoms])
        upper = np.array([f.upper for f in self.freedoms])
        result = vector.copy()
        result[self.count :] = np.clip(vector[self.count :], lower, upper)
        result[: self.count] = self._physical(vector[: self.count])
        return result

    def _physical(self, z: FloatArray) -> FloatArray:
        """Shrink coefficients that would leave their physical bounds."""
        baseline = self.problem.baseline
        low, high = baseline.bounds
        values = baseline.values(z[:, None])[:, 0]
        inside = np.clip(values, low + 1e-3 * baseline.sd, high - 1e-3 * baseline.sd)
        return np.asarray(np.linalg.solve(baseline.factor, inside - baseline.mean))

    def lanes(self, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Perturbed vectors (n, 1 + n), the centre first, and the signed steps (n,)."""
        steps = self.steps.copy()
        for i, freedom in enumerate(self.freedoms, start=self.count):
            if vector[i] + steps[i] > freedom.upper:
                steps[i] = -steps[i]
        return np.column_stack([vector, vector[:, None] + np.diag(steps)]), steps

    def scale(self) -> FloatArray:
        """Physical units per unit of the vector, as a matrix (n, n)."""
        matrix = np.eye(len(self.names))
        matrix[: self.count, : self.count] = self.problem.baseline.factor
        return matrix


def linearise(
    problem: Problem,
    free: _Free,
    vector: FloatArray,
    noise: NoiseModel,
    filtered: Sequence[Filtered],
) -> Linearised:
    """Residuals and slopes by one batch of filter lanes."""
    lanes, steps = free.lanes(vector)
    effects = {f.path: lanes[free.count + i] for i, f in enumerate(free.freedoms)}
    innovations = problem.innovations(lanes[: free.count], effects, noise, filtered)
    slopes = (innovations[1:] - innovations[0]).T / steps
    channels = len(problem.channels)
    run_of = np.repeat(np.arange(len(problem.runs)), [run.measured.size for run in problem.runs])
    time_of = np.concatenate([np.repeat(run.clock, channels) for run in problem.runs])
    return Linearised(innovations[0], slopes, run_of, time_of)


def fit(
    problem: Problem,
    effects: Sequence[str] | None = None,
    start: Point | None = None,
    noise: NoiseModel | None = None,
    released: Sequence[str] = (),
    refit_noise: bool = True,
    iterations: int = 5,
    tolerance: float = 0.1,
    rounds: int = 4,
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
        tolerance: stop when no parameter moves by more of its standard deviation.
        rounds: most alternations between parameters and disturbance.
        report: told what is being done.
    """
    names = problem.effects if effects is None else tuple(effects)
    free = _Free(problem, names, released)
    given = start or problem.start
    values = {**problem.neutral(names), **given.effects}
    vector = free.clip(free.pack(Point(given.z, values)))
    noise = noise or default_noise(problem)
    for round_ in range(rounds if refit_noise else 1):
        problem = settle_phases(problem, free.unpack(vector), noise)
        report(f"fitting parameters, round {round_ + 1}")
        vector, filtered = _gauss_newton(problem, free, vector, noise, iterations, tolerance)
        if not refit_noise:
            break
        report(f"fitting the noise, round {round_ + 1}")
        last = noise
        noise = _noise_at(problem, free.unpack(vector), noise, final=round_ > 0)
        if _settled(last, noise):
            break
    value, filtered = _objective(problem, free, vector, noise)
    return _finish(problem, free, names, tuple(released), vector, noise, value, filtered)


def _objective(
    problem: Problem, free: _Free, vector: FloatArray, noise: NoiseModel
) -> tuple[float, list[Filtered]]:
    """-2 log likelihood + prior, and the filter results it comes from."""
    results = problem.filtered(free.unpack(vector), noise)
    value = -2.0 * sum(r.log_likelihood for r in results) + free.prior @ (vector * vector)
    return float(value), results


def _gauss_newton(
    problem: Problem,
    free: _Free,
    vector: FloatArray,
    noise: NoiseModel,
    iterations: int,
    tolerance: float,
) -> tuple[FloatArray, list[Filtered]]:
    """Damped Gauss-Newton steps with the noise model held."""
    value, filtered = _objective(problem, free, vector, noise)
    damping = 0.0
    for _ in range(iterations):
        lin = linearise(problem, free, vector, noise, filtered)
        hessian = information(lin.slopes, free.prior)
        gradient = inner(lin.slopes, lin.residuals[:, None])[:, 0] + free.prior * vector
        for _ in range(5):
            damped = hessian + damping * np.diag(np.diag(hessian))
            trial = free.clip(vector - np.linalg.solve(damped, gradient))
            trial_value, trial_filtered = _objective(problem, free, trial, noise)
            if trial_value < value:
                break
            damping = max(10 * damping, 1e-2)
        else:
            return vector, filtered
        moved = np.abs(trial - vector) * np.sqrt(np.diag(hessian))
        vector, value, filtered = trial, trial_value, trial_filtered
        damping = 0.0 if damping < 1e-2 else damping / 10
        if moved.max() < tolerance:
            break
    return vector, filtered


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
    free = _Free(problem, effects, released)
    values = {**problem.neutral(effects), **point.effects}
    vector = free.clip(free.pack(Point(point.z, values)))
    problem = settle_phases(problem, free.unpack(vector), noise)
    return _objective(problem, free, vector, noise)[0]


def default_noise(problem: Problem) -> NoiseModel:
    """Sensor noise from differences of the data, and a disturbance of a few millinewton."""
    return NoiseModel(problem.sensor_sd, 3e-3, 1e-4, 1.0)


def _noise_at(problem: Problem, point: Point, noise: NoiseModel, final: bool) -> NoiseModel:
    """Noise model of largest likelihood at a point, from at most six runs.

    The search starts from the present one and from a small disturbance, so that a disturbance
    which once stood in for a misfit does not stay.
    """
    few = problem.subset(6)
    found = noise
    for _ in range(3):
        filtered, made_with = few.filtered(point, found, keep_slopes=True), found
        replay = partial(few.filter_for(point.effects).replay, filtered, made_with)
        small = NoiseModel(found.sensor_sd, 3e-3, 1e-4, 1.0)
        found = fit_noise(
            replay, max((found, small), key=replay), 45, problem.sensor_sd if final else None
        )
        if _settled(made_with, found, 0.4):
            break
    return found


def _finish(
    problem: Problem,
    free: _Free,
    effects: tuple[str, ...],
    released: tuple[str, ...],
    vector: FloatArray,
    noise: NoiseModel,
    value: float,
    filtered: Sequence[Filtered],
) -> Fit:
    lin = linearise(problem, free, vector, noise, filtered)
    hessian = information(lin.slopes, free.prior)
    inverse = np.asarray(np.linalg.inv(hessian), float)
    covariance = sandwich(lin, inverse, free.prior)
    scale = free.scale()
    physical = scale @ covariance @ scale.T
    point = free.unpack(vector)
    estimates = np.r_[problem.baseline.values(point.z[:, None])[:, 0], vector[free.count :]]
    bounds = (*_coefficients_at_bounds(problem, estimates), *_effects_at_bounds(free, vector))
    diagonal = np.sqrt(np.diag(hessian))
    condition = float(np.linalg.cond(hessian / np.outer(diagonal, diagonal)))
    return Fit(
        problem, effects, released, point, noise, free.names, estimates, physical,
        float(sum(r.log_likelihood for r in filtered)), value, bounds, condition, filtered, lin,
    )  # fmt: skip


def _coefficients_at_bounds(problem: Problem, estimates: FloatArray) -> list[str]:
    """Coefficients that ended at the edge of what is physically possible."""
    baseline = problem.baseline
    low, high = baseline.bounds
    values, margin = estimates[: len(baseline)], 2e-3 * baseline.sd
    stuck = (values <= low + margin) | (values >= high - margin)
    return [path for path, at in zip(baseline.paths, stuck, strict=True) if at]


def _effects_at_bounds(free: _Free, vector: FloatArray) -> list[str]:
    values = zip(free.freedoms, vector[free.count :], strict=True)
    return [f.path for f, value in values if value <= f.lower or value >= f.upper]


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
