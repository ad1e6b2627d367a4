"""Fit of coefficients and effects to a table of steady motion, priors included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fish_env.diagnosis.steady.freedoms import freedoms_of
from fish_env.diagnosis.steady.orbit import Orbits
from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.diagnosis.steady.scatter import (
    Scatter,
    estimate_scatter,
    first_guess,
    linear_changes,
    push_variances,
    response,
    scatter_of,
)
from fish_env.errors import DatasetError
from fish_env.identification.descent import Within, descend
from fish_env.identification.problem import Point, finite_values

FloatArray = npt.NDArray[np.float64]
RELEASED = 0.1
"""Weight of the prior of a coefficient that was set free: its standard deviation, ten times."""
Z_STEP = 0.05
TOLERANCE, ROUGH = 0.05, 0.3
"""Fits stop when nothing would move by more of its standard deviation; the second where only the
objective is asked for."""
UNSEEN = 1e-9
"""Information of a number that the averages do not depend on."""
STEPS = 12


@dataclass(frozen=True, eq=False)
class SteadyFit:
    """Estimates with everything needed to judge them.

    Attributes:
        problem: what was fitted.
        effects: names of effects whose parameters are free.
        released: coefficients without their prior.
        point: estimates.
        orbits: steady motion under each condition.
        means: averages, shape (C, K).
        scatter: noise of single averages.
        slopes: derivative of the whitened averages, then of the priors, shape (N, n).
        residuals: measured less simulated, whitened, then what the priors hold, shape (N,).
        profiles: 95 % intervals by likelihood, of the paths for which they were worked out.
    """

    problem: SteadyProblem
    effects: tuple[str, ...]
    released: tuple[str, ...]
    point: Point
    orbits: Orbits
    means: FloatArray
    scatter: Scatter
    slopes: FloatArray
    residuals: FloatArray
    profiles: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def objective(self) -> float:
        """-2 log posterior up to a constant that the noise alone decides."""
        return float(self.residuals @ self.residuals)

    @property
    def names(self) -> tuple[str, ...]:
        """Paths of all estimates: coefficients, then effects."""
        return (*self.problem.baseline.paths, *self.point.effects)

    @property
    def estimates(self) -> FloatArray:
        """In the order of the names."""
        values = self.problem.baseline.values(self.point.z[:, None])[:, 0]
        return np.asarray(np.r_[values, list(self.point.effects.values())])

    @cached_property
    def covariance(self) -> FloatArray:
        """Of the estimates in their own units, shape (n, n).

        The noise behind it is that of the residuals, so what the model misses from one condition
        to the next widens it.
        """
        inverse = np.linalg.inv(self.slopes.T @ self.slopes + UNSEEN * np.eye(self.slopes.shape[1]))
        count = len(self.problem.baseline)
        turn = np.eye(len(inverse))
        turn[:count, :count] = self.problem.baseline.factor
        for i, freedom in enumerate(freedoms_of(self.problem, self.effects)):
            turn[count + i, count + i] = freedom.unit
        return np.asarray(turn @ inverse @ turn.T)

    def interval(self, path: str) -> tuple[float, float]:
        """95 % interval within the bounds, by likelihood where that was worked out."""
        if path in self.profiles:
            return self.profiles[path]
        i = self.names.index(path)
        middle, half = self.estimates[i], 1.96 * float(np.sqrt(self.covariance[i, i]))
        lower, upper = self.bounds(path)
        return float(max(middle - half, lower)), float(min(middle + half, upper))

    def bounds(self, path: str) -> tuple[float, float]:
        """Bounds of an estimate: physical ones, for effects what a fit may reach."""
        for freedom in freedoms_of(self.problem, self.effects):
            if freedom.path == path:
                return freedom.lower, freedom.upper
        info = self.problem.fish.info(path)
        return info.lower, info.upper


def lines(problem: SteadyProblem, values: FloatArray, scatter: Scatter) -> FloatArray:
    """Averages (..., C, K) as whitened rows of the table, (..., D)."""
    table = problem.table
    row, column = np.nonzero(table.present)
    condition = table.condition_of[row]
    return np.asarray(values[..., condition, column] / scatter.sd[condition, column])


def measured(problem: SteadyProblem, scatter: Scatter) -> FloatArray:
    """Whitened measurements, (D,)."""
    table = problem.table
    row, column = np.nonzero(table.present)
    return np.asarray(table.values[row, column] / scatter.sd[table.condition_of[row], column])


def prior_weights(problem: SteadyProblem, released: Sequence[str]) -> FloatArray:
    """One over the standard deviation of each normalised coefficient."""
    return np.array([RELEASED if p in released else 1.0 for p in problem.baseline.paths])


def fit(
    problem: SteadyProblem,
    effects: Sequence[str] = (),
    start: Point | None = None,
    near: Orbits | None = None,
    scatter: Scatter | None = None,
    released: Sequence[str] = (),
    rounds: int = 2,
    steps: int = STEPS,
) -> SteadyFit:
    """Gauss-Newton within bounds; the noise is estimated along with the rest.

    Args:
        problem: table and fish.
        effects: effects whose parameters are free.
        start: where to begin; default: nominal.
        near: steady motion at the start, if known.
        scatter: noise to keep; estimated if absent.
        released: coefficients without their prior.
        rounds: fits, with the noise of the residuals estimated between them.
        steps: most Gauss-Newton steps of a fit.

    Raises:
        DatasetError: the fish does not reach steady motion at the start.
    """
    point = start or problem.start
    point = Point(
        point.z, {**finite_values(problem.known, problem.neutral(effects)), **point.effects}
    )
    orbits = problem.orbits([point], near)
    if not orbits.found.all():
        raise _not_steady(problem, orbits)
    if scatter is not None:
        return _fit_once(problem, effects, point, orbits, scatter, released, steps)
    pushes = push_variances(response(problem, point, orbits))
    known = scatter_of(first_guess(problem.table), 0.0, 0.0, pushes, False)
    current = _fit_once(problem, effects, point, orbits, known, released, steps)
    for _ in range(rounds - 1):
        pushes = push_variances(response(problem, current.point, current.orbits))
        known = noise_of(current, pushes)
        # The first noise is a guess, under which the fit may have gone to a minimum far away.
        begun = ((current.point, current.orbits), (point, orbits))
        found = [_fit_once(problem, effects, *own, known, released, steps) for own in begun]
        current = min(found, key=lambda f: f.objective)
    return with_scatter(current, noise_of(current, pushes))


def _not_steady(problem: SteadyProblem, orbits: Orbits) -> DatasetError:
    lost = problem.table.conditions[int(np.argmin(orbits.found))]
    return DatasetError(
        f"{problem.table.name}: {problem.fish.name} does not come to steady motion under the "
        f"commands of condition '{lost}'; check that fish, units and frame are those of the "
        "data, or leave the condition out"
    )


def noise_of(current: SteadyFit, pushes: FloatArray) -> Scatter:
    """Noise that the residuals of a fit show, each counted by the freedom the fit left it."""
    table = current.problem.table
    row, column = np.nonzero(table.present)
    count = len(row)
    left = 1.0 - leverage(current.slopes)[:count]
    shape = current.scatter.sd.shape
    squares, freedom = np.zeros(shape), np.zeros(shape)
    condition = table.condition_of[row]
    own = (current.residuals[:count] * current.scatter.sd[condition, column]) ** 2
    np.add.at(squares, (condition, column), own)
    np.add.at(freedom, (condition, column), left)
    return estimate_scatter(table, squares, freedom, pushes)


def leverage(slopes: FloatArray) -> FloatArray:
    """Share of each line that the fit follows, the diagonal of the hat matrix."""
    basis, _ = np.linalg.qr(slopes)
    return np.asarray(np.einsum("ij,ij->i", basis, basis))


def with_scatter(current: SteadyFit, scatter: Scatter) -> SteadyFit:
    """The same estimates judged by another noise."""
    problem = current.problem
    table = problem.table
    row, column = np.nonzero(table.present)
    condition = table.condition_of[row]
    ratio = np.ones(len(current.residuals))
    ratio[: len(row)] = current.scatter.sd[condition, column] / scatter.sd[condition, column]
    return SteadyFit(
        problem, current.effects, current.released, current.point, current.orbits, current.means,
        scatter, current.slopes * ratio[:, None], current.residuals * ratio,
    )  # fmt: skip


class _Work:
    """Residuals and their slopes as functions of the free numbers, steady motion kept near."""

    def __init__(
        self,
        problem: SteadyProblem,
        effects: Sequence[str],
        point: Point,
        orbits: Orbits,
        scatter: Scatter,
        released: Sequence[str],
        held: Sequence[str] = (),
    ) -> None:
        self.problem, self.scatter = problem, scatter
        self.free = [f for f in freedoms_of(problem, effects) if f.path not in held]
        self.kept = {p: v for p, v in point.effects.items() if p not in {f.path for f in self.free}}
        self.near, self.size = orbits, len(problem.baseline)
        self.prior = prior_weights(problem, released)
        self.measured = measured(problem, scatter)
        self.start = np.r_[point.z, [point.effects[f.path] / f.unit for f in self.free]]

    def point(self, x: FloatArray) -> Point:
        own = {f.path: float(v * f.unit) for f, v in zip(self.free, x[self.size :], strict=True)}
        return Point(x[: self.size], {**self.kept, **own})

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        baseline = self.problem.baseline
        low, high = ((b - baseline.mean) / np.diag(baseline.factor) for b in baseline.bounds)
        low, high = np.maximum(low, -12.0) + 1e-3, np.minimum(high, 12.0) - 1e-3
        lower = np.r_[low, [f.lower / f.unit for f in self.free]]
        upper = np.r_[high, [f.upper / f.unit for f in self.free]]
        return lower, upper

    def evaluate(self, x: FloatArray) -> tuple[float, _Seen]:
        """The objective, infinite where motion is not steady, and what it comes from."""
        orbits = self.problem.orbits([self.point(x)], self.near)
        means = self.problem.means(orbits)[0]
        seen = self.measured - lines(self.problem, means, self.scatter)
        residuals = np.r_[seen, -self.prior * x[: self.size]]
        value = float(residuals @ residuals)
        return value if np.isfinite(value) else np.inf, _Seen(residuals, orbits, means)

    def jacobian(self, x: FloatArray, seen: _Seen) -> FloatArray:
        """Derivative of the residuals; what comes next is looked for near this motion."""
        self.near = seen.orbits
        _, upper = self.bounds()
        step = np.full(len(x), Z_STEP)
        step[x + step > upper] *= -1.0
        nudged = [self.point(x + step[i] * np.eye(len(x))[i]) for i in range(len(x))]
        coefficients, effects = nudged[: self.size], nudged[self.size :]
        change = linear_changes(self.problem, self.point(x), seen.orbits, coefficients)
        if effects:
            means = self.problem.means(self.problem.orbits(effects, seen.orbits))
            change = np.concatenate([change, means - seen.means])
        whitened = lines(self.problem, change, self.scatter).T / step
        whitened = np.where(np.isfinite(whitened), whitened, 0.0)
        prior = np.zeros((self.size, len(x)))
        prior[:, : self.size] = np.diag(self.prior)
        return -np.concatenate([whitened, prior])

    def descended(self, steps: int, tolerance: float = TOLERANCE) -> tuple[FloatArray, _Seen]:
        """The free numbers at the minimum, and what was seen there."""
        lower, upper = self.bounds()
        clip = partial(np.clip, a_min=lower, a_max=upper)
        within = Within(np.eye(len(lower)), lower, upper, clip)

        def linearised(x: FloatArray, seen: _Seen) -> tuple[FloatArray, FloatArray]:
            jacobian = self.jacobian(x, seen)
            # What no average depends on stays where it is.
            known = jacobian.T @ jacobian + UNSEEN * np.eye(len(x))
            return known, jacobian.T @ seen.residuals

        start = clip(self.start)
        found, _, seen = descend(start, self.evaluate, linearised, within, steps, tolerance)
        return found, seen


class _Seen(NamedTuple):
    """What the free numbers make of the table."""

    residuals: FloatArray
    orbits: Orbits
    means: FloatArray


def fit_near(current: SteadyFit, point: Point, orbits: Orbits) -> SteadyFit:
    """The fit from other estimates, under the same noise."""
    return _fit_once(
        current.problem, current.effects, point, orbits, current.scatter, current.released, STEPS
    )


def objective_at(
    current: SteadyFit, path: str, value: float, near: tuple[Point, Orbits]
) -> tuple[float, Point, Orbits]:
    """The objective with one effect's parameter held and all else fitted again.

    Args:
        current: the fit; its noise is used.
        path: ``effects.<name>.<parameter>``.
        value: where to hold it.
        near: estimates with the parameter held close by, and their steady motion.

    Returns:
        The objective, infinite where the fish loses steady motion, with the estimates and motion.
    """
    problem, (point, orbits) = current.problem, near
    point = Point(point.z, {**point.effects, path: value})
    orbits = problem.orbits([point], orbits)
    if not orbits.found.all():
        return np.inf, *near
    own = (current.effects, point, orbits, current.scatter, current.released, (path,))
    work = _Work(problem, *own)
    try:
        found, seen = work.descended(STEPS, ROUGH)
    except np.linalg.LinAlgError:
        return np.inf, *near
    return float(seen.residuals @ seen.residuals), work.point(found), seen.orbits


def _fit_once(
    problem: SteadyProblem,
    effects: Sequence[str],
    point: Point,
    orbits: Orbits,
    scatter: Scatter,
    released: Sequence[str],
    steps: int,
) -> SteadyFit:
    work = _Work(problem, effects, point, orbits, scatter, released)
    try:
        found, seen = work.descended(steps)
    except np.linalg.LinAlgError:  # where bounds put the start, motion is not steady
        raise _not_steady(problem, orbits) from None
    slopes = -work.jacobian(found, seen)
    return SteadyFit(
        problem, tuple(effects), tuple(released), work.point(found), seen.orbits, seen.means,
        scatter, slopes, seen.residuals,
    )  # fmt: skip
