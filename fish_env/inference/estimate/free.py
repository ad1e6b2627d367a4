"""The vector of all free parameters: baseline coefficients in prior units, then effect parameters.

With what estimates are made of: the objective at a vector, residuals and their slopes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.inference.estimate.bounds import Gap, LinearBounds, parameter_bounds
from fish_env.inference.estimate.information import gradient, information, prior_precision
from fish_env.inference.estimate.run_variation import Marginal
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.hypotheses import Coefficient, EffectParameterId, ParameterId
from fish_env.inference.problem import Point, Problem
from fish_env.inference.vehicle import diverging, finite_values

SHORTEST = 0.02
"""Shortest step for differences, as a share of the longest."""
DIFFERENCE = 0.3
"""Step for differences by what runs differ in, in usual spreads."""
LARGEST_SLOPE = 1e9
"""In standard deviations of the noise per unit; what exceeds it has diverged."""
LARGEST_RESIDUAL = 1e9
"""In standard deviations of the noise; where their mean square is larger, they have diverged."""


@dataclass(frozen=True, eq=False)
class Linearised:
    """Residuals and their slopes at a point: all that estimates and tests need.

    Attributes:
        residuals: (D,) whitened innovations.
        slopes: (D, n) derivative by each free parameter, baseline (in prior units) first.
        run_of: (D,) index of the run of each residual.
        time_of: (D,) time of each residual in its run (s).
        marginal: how the runs' own numbers are integrated out, which residuals and slopes are
            already; None where runs do not differ.
    """

    residuals: FloatArray
    slopes: FloatArray
    run_of: IntArray
    time_of: FloatArray
    marginal: Marginal | None = None

    def whitened(self, rows: FloatArray) -> FloatArray:
        """Changes (m, D) of the residuals with the runs' own numbers integrated out, in place."""
        return rows if self.marginal is None else self.marginal.rows(rows)


class Free:
    """Bookkeeping of the vector [z, effect parameters].

    Args:
        problem: the problem.
        effects: names of effects whose parameters are free.
        released: baseline coefficients whose prior is lifted.
        held: effect parameter -> value, of those that are not free.
    """

    def __init__(
        self,
        problem: Problem,
        effects: Iterable[str],
        released: Iterable[Coefficient],
        held: Mapping[EffectParameterId, float] | None = None,
    ) -> None:
        self.problem = problem
        self.released = tuple(released)
        self.held = dict(held or {})
        self.freedoms = tuple(f for f in problem.freedoms(effects) if f.id not in self.held)
        self.count = len(problem.baseline)
        own = (f.id for f in self.freedoms)
        self.ids: tuple[ParameterId, ...] = (*problem.baseline.ids, *own)
        self.prior = prior_precision(problem.baseline, len(self.freedoms), self.released)
        self.largest_steps = np.r_[
            np.full(self.count, problem.coefficient_step), [f.step for f in self.freedoms]
        ]
        self.steps = self.largest_steps

    def pack(self, point: Point) -> FloatArray:
        """The vector (n,) of a point; of what is infinite, the mildest plausible value."""
        own = {f.id: point.effects[f.id] for f in self.freedoms}
        values = finite_values(self.problem.known, own)
        return np.asarray(np.r_[point.z, [values[f.id] for f in self.freedoms]], float)

    def unpack(self, vector: FloatArray) -> Point:
        """The point of a vector (n,)."""
        values = vector[self.count :].tolist()
        ids = [f.id for f in self.freedoms]
        own = {**dict(zip(ids, values, strict=True)), **self.held}
        return Point(vector[: self.count].copy(), own)

    def suit_steps(self, hessian: FloatArray) -> None:
        """Take differences over one standard error: a longer secant is no slope.

        Args:
            hessian: (n, n) information.
        """
        told = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
        steps = np.clip(told, SHORTEST * self.largest_steps, self.largest_steps)
        self.steps = np.r_[self.largest_steps[: self.count], steps[self.count :]]

    @cached_property
    def bounds(self) -> LinearBounds:
        """Bounds of the vector: of coefficients in physical units, of effects' parameters."""
        lower, upper = [f.lower for f in self.freedoms], [f.upper for f in self.freedoms]
        bounds = parameter_bounds(self.problem.baseline, lower, upper, self.released)
        return replace(bounds, gaps=self._gaps)

    @property
    def _gaps(self) -> tuple[Gap, ...]:
        """Where lags are too quick for the steps of the problem."""
        found, step = [], self.problem.longest_step
        for i, freedom in enumerate(self.freedoms, start=self.count):
            effect = self.problem.known[freedom.id.effect]
            (parameter,) = (p for p in effect.parameters if p.name == freedom.id.name)
            off, least = diverging(effect, parameter, step)
            if least > off:
                found.append(Gap(i, off, least))
        return tuple(found)

    def effects_at_bounds(self, vector: FloatArray) -> list[EffectParameterId]:
        """Effect parameters that ended at the edge of what they may be."""
        values = zip(self.freedoms, vector[self.count :], strict=True)
        return [f.id for f, value in values if value <= f.lower or value >= f.upper]

    def lanes(self, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Perturbed vectors (n, 1 + n), the centre first, and the signed steps (n,).

        A lag that is off is switched on by as much as the simulation can follow: less would
        diverge, and it would seem to do nothing.
        """
        steps = self.steps.copy()
        for i, freedom in enumerate(self.freedoms, start=self.count):
            if vector[i] < freedom.least:
                steps[i] = max(steps[i], freedom.least - vector[i])
            if vector[i] + steps[i] > freedom.upper:
                steps[i] = -steps[i]
        return np.column_stack([vector, vector[:, None] + np.diag(steps)]), steps

    def scale(self) -> FloatArray:
        """Physical units per unit of the vector, as a matrix (n, n)."""
        matrix = np.eye(len(self.ids))
        matrix[: self.count, : self.count] = self.problem.baseline.factor
        return matrix


def residuals_at(
    problem: Problem,
    free: Free,
    vectors: FloatArray,
    noise: Any,
    filtered: Sequence[Evaluation],
) -> FloatArray:
    """Whitened residuals (N, D) of vectors (n, N) with the gains of a filter that has run."""
    effects = {f.id: vectors[free.count + i] for i, f in enumerate(free.freedoms)}
    effects |= {id: np.full(vectors.shape[1], value) for id, value in free.held.items()}
    return problem.innovations(vectors[: free.count], effects, noise, filtered)


def diverged(rows: FloatArray) -> BoolArray:
    """(n,) which changes of residuals (n, D) are not finite, or so large that nothing moves so."""
    within = (rows.min(axis=1) > -LARGEST_SLOPE) & (rows.max(axis=1) < LARGEST_SLOPE)
    return np.asarray(~within)


def linearise(
    problem: Problem,
    free: Free,
    vector: FloatArray,
    noise: Any,
    filtered: Sequence[Evaluation],
    marginal: Marginal | None = None,
) -> Linearised:
    """Residuals and slopes by one batch of points.

    A parameter that cannot be moved without the simulation diverging gets no slope: it stays.

    Args:
        problem: the problem.
        free: its free parameters.
        vector: (n,) where to linearise.
        noise: noise model.
        filtered: evaluation whose weighting is held.
        marginal: integrates out what the runs differ in.
    """
    found = residuals_and_rows(problem, free, vector, noise, filtered)
    return linearised(problem, *found, marginal)


def residuals_and_rows(
    problem: Problem,
    free: Free,
    vector: FloatArray,
    noise: Any,
    filtered: Sequence[Evaluation],
    first: int = 0,
) -> tuple[FloatArray, FloatArray]:
    """Residuals (D,) at a vector, and slopes (n - first, D) by its parameters from one on.

    Args as for :func:`linearise`, with ``first``, number of the first parameter that has a slope.
    """
    lanes, steps = free.lanes(vector)
    chosen = np.r_[0, 1 + first : lanes.shape[1]]
    innovations = residuals_at(problem, free, lanes[:, chosen], noise, filtered)
    rows = innovations[1:]
    # In place: memory fresh from the system costs as much as the arithmetic.
    rows -= innovations[0]
    with np.errstate(over="ignore"):  # of a motion that is about to diverge
        rows /= steps[first:, None]
    rows[diverged(rows)] = 0.0
    return innovations[0], rows


def linearised(
    problem: Problem, residuals: FloatArray, rows: FloatArray, marginal: Marginal | None
) -> Linearised:
    """The linearisation from residuals (D,) and slopes (n, D), which are changed in place.

    Args:
        problem: the problem.
        residuals: whitened.
        rows: slopes by each free parameter.
        marginal: integrates out what the runs differ in.
    """
    if marginal is not None:
        residuals, rows = marginal.residuals(residuals), marginal.rows(rows)
    return Linearised(residuals, rows.T, *problem.groups(), marginal)


def quadratic(free: Free, vector: FloatArray, lin: Linearised) -> tuple[FloatArray, FloatArray]:
    """Half the Hessian (n, n) and half the gradient (n,) of the objective, for Gauss-Newton.

    The steps of later slopes are suited to this Hessian.
    """
    hessian = information(lin.slopes, free.prior)
    free.suit_steps(hessian)
    return hessian, gradient(lin.slopes, lin.residuals, free.prior, vector)


def spread_of(problem: Problem, noise: Any) -> FloatArray:
    """Standard deviation (K,) over runs of what differs between them.

    Args:
        problem: a problem without variations need not have it in its noise models.
        noise: noise model.
    """
    return np.asarray(noise.spread) if problem.variations else np.zeros(0)


def least_of(problem: Problem, which: IntArray) -> FloatArray:
    """Smallest value (K,) of some of the numbers that runs differ in.

    Args:
        problem: says which cannot be negative.
        which: (K,) which of them.
    """
    return np.array([0.0 if problem.variations[i].positive else -np.inf for i in which])


def marginal_of(
    problem: Problem, point: Point, noise: Any, filtered: Sequence[Evaluation]
) -> Marginal | None:
    """How to integrate out what the runs differ in; None where they do not.

    Args:
        problem: the problem.
        point: values of the shared parameters.
        noise: noise model with the spreads.
        filtered: evaluation at the point.
    """
    spreads = spread_of(problem, noise)
    active = np.flatnonzero(spreads)
    if not active.size:
        return None
    spread = spreads[active]
    steps = DIFFERENCE * np.array([v.usual for v in problem.variations])
    slopes = problem.variation_slopes(point, noise, filtered, steps)[:, active] * spread
    return Marginal(slopes, problem.variation[:, active] / spread, problem.groups()[0])


def objective(
    problem: Problem,
    free: Free,
    vector: FloatArray,
    noise: Any,
    marginal: Marginal | None = None,
    near: Sequence[Evaluation] = (),
) -> tuple[float, Sequence[Evaluation]]:
    """-2 log likelihood + prior, and the evaluation it comes from.

    Infinite, and nothing evaluated, where no vehicle can have the coefficients.

    Args:
        problem: the problem.
        free: its free parameters.
        vector: (n,) where to evaluate.
        noise: noise model.
        marginal: integrates out what the runs differ in.
        near: evaluation at a vector close by, where there is one.
    """
    if not problem.baseline.possible(vector[: free.count]):
        return np.inf, []
    results = problem.filtered(free.unpack(vector), noise, near)
    return objective_with(free, vector, results, marginal), results


def objective_with(
    free: Free,
    vector: FloatArray,
    results: Sequence[Evaluation],
    marginal: Marginal | None = None,
) -> float:
    """-2 log likelihood + prior, from an evaluation.

    Args:
        free: the free parameters.
        vector: (n,) where the runs were evaluated.
        results: of every run.
        marginal: integrates out what the runs differ in.
    """
    value = -2.0 * sum(r.log_likelihood for r in results) + free.prior @ (vector * vector)
    if marginal is not None:
        residuals = np.concatenate([r.residuals for r in results])
        whitened = marginal.residuals(residuals)
        value += whitened @ whitened - residuals @ residuals + marginal.log_det
    return float(value)


def objectives_with_gains(
    problem: Problem,
    free: Free,
    vectors: Sequence[FloatArray],
    noise: Any,
    filtered: Sequence[Evaluation],
    marginal: Marginal | None = None,
) -> list[float]:
    """-2 log likelihood + prior with the gains of a filter that has run, but for a constant.

    The constant is that of the gains: models can be compared under the same ones. All vectors
    together take no longer than one filter. Infinite where no vehicle can have the coefficients, or
    the simulation diverges.
    """
    lanes = np.column_stack(vectors)
    rows = residuals_at(problem, free, lanes, noise, filtered)
    if marginal is not None:
        rows = np.array([marginal.residuals(row) for row in rows])
    able = problem.baseline.all_possible(lanes[: free.count])
    cases = zip(vectors, rows, able.tolist(), strict=True)
    return [_objective(free, vector, residuals, can) for vector, residuals, can in cases]


def objective_of(problem: Problem, free: Free, vector: FloatArray, residuals: FloatArray) -> float:
    """The same of a vector whose whitened residuals (D,) are known."""
    return _objective(free, vector, residuals, problem.baseline.possible(vector[: free.count]))


def _objective(free: Free, vector: FloatArray, residuals: FloatArray, possible: bool) -> float:
    with np.errstate(over="ignore"):  # where the simulation diverges
        value = float(residuals @ residuals + free.prior @ (vector * vector))
    return value if possible and np.isfinite(value) else np.inf


def own_objectives(problem: Problem, filtered: Sequence[Evaluation], noise: Any) -> FloatArray:
    """(R,) -2 log likelihood of each run together with its own numbers, but for a constant.

    Infinite where the simulation diverges.
    """
    spreads = spread_of(problem, noise)
    active = np.flatnonzero(spreads)
    own = problem.variation[:, active] / spreads[active]
    of_runs = np.array([-2.0 * f.log_likelihood for f in filtered])
    sizes = np.array([len(f.residuals) for f in filtered])
    of_runs[~(of_runs < LARGEST_RESIDUAL**2 * sizes)] = np.inf
    return np.asarray(of_runs + np.sum(own**2, axis=1))
