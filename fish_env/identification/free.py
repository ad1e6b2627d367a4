"""The vector of all free parameters: baseline coefficients in prior units, then effect parameters.

With what estimates are made of: the objective at a vector, residuals and their slopes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fish_env.identification.descent import Within
from fish_env.identification.filtering import Filtered, NoiseModel
from fish_env.identification.information import prior_precision
from fish_env.identification.problem import Point, Problem

FloatArray = npt.NDArray[np.float64]
Z_STEP = 0.05
SHORTEST = 0.02
"""Shortest step for differences, as a share of the longest."""
REACH = 5.0
"""Prior standard deviations that a coefficient may move, unless its prior is lifted."""
LARGEST_SLOPE = 1e9
"""In standard deviations of the noise per unit; what exceeds it has diverged."""


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


class Free:
    """Bookkeeping of the vector [z, effect parameters].

    Args:
        problem: the problem.
        effects: names of effects whose parameters are free.
        released: baseline coefficients whose prior is lifted.
    """

    def __init__(self, problem: Problem, effects: Iterable[str], released: Iterable[str]) -> None:
        self.problem = problem
        self.released = tuple(released)
        self.freedoms = problem.freedoms(effects)
        self.count = len(problem.baseline)
        self.names = (*problem.baseline.paths, *(f.path for f in self.freedoms))
        self.prior = prior_precision(problem.baseline, len(self.freedoms), released)
        self.largest_steps = np.r_[np.full(self.count, Z_STEP), [f.step for f in self.freedoms]]
        self.steps = self.largest_steps
        self.corners = problem.has_corners(f.path for f in self.freedoms)

    def pack(self, point: Point) -> FloatArray:
        """The vector (n,) of a point."""
        return np.asarray(np.r_[point.z, [point.effects[f.path] for f in self.freedoms]], float)

    def unpack(self, vector: FloatArray) -> Point:
        """The point of a vector (n,)."""
        values = vector[self.count :].tolist()
        paths = [f.path for f in self.freedoms]
        return Point(vector[: self.count].copy(), dict(zip(paths, values, strict=True)))

    def suit_steps(self, hessian: FloatArray) -> None:
        """Take differences over what the data can tell: a secant of more is no slope.

        With corners in the motion the slope of a short step is noise, so those steps stay.

        Args:
            hessian: (n, n) information.
        """
        if self.corners:
            return
        told = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
        steps = np.clip(told, SHORTEST * self.largest_steps, self.largest_steps)
        self.steps = np.r_[self.largest_steps[: self.count], steps[self.count :]]

    def clip(self, vector: FloatArray) -> FloatArray:
        """The vector (n,) moved within physical bounds."""
        lower = np.array([f.lower for f in self.freedoms])
        upper = np.array([f.upper for f in self.freedoms])
        result = vector.copy()
        result[self.count :] = np.clip(vector[self.count :], lower, upper)
        result[: self.count] = self._physical(vector[: self.count])
        return result

    def _physical(self, z: FloatArray) -> FloatArray:
        """Shrink coefficients that would leave their physical bounds."""
        baseline = self.problem.baseline
        low, high = self._range
        values = baseline.values(z[:, None])[:, 0]
        inside = np.clip(values, low + 1e-3 * baseline.sd, high - 1e-3 * baseline.sd)
        return np.asarray(np.linalg.solve(baseline.factor, inside - baseline.mean))

    @cached_property
    def _range(self) -> tuple[FloatArray, FloatArray]:
        """Coefficients stay within physical bounds, and within reach of their prior.

        One that runs away makes up for something else; to claim it, its prior must be lifted.
        """
        baseline = self.problem.baseline
        low, high = baseline.bounds
        reach = np.array([np.inf if p in self.released else REACH for p in baseline.paths])
        reach = reach * baseline.sd
        return np.maximum(low, baseline.mean - reach), np.minimum(high, baseline.mean + reach)

    @cached_property
    def within(self) -> Within:
        """Bounds of the vector: of coefficients in physical units, of effects' parameters."""
        baseline = self.problem.baseline
        low, high = self._range
        margin = 1e-3 * baseline.sd
        return Within(
            self.scale(),
            np.r_[low + margin - baseline.mean, [f.lower for f in self.freedoms]],
            np.r_[high - margin - baseline.mean, [f.upper for f in self.freedoms]],
            self.clip,
        )

    def coefficients_at_bounds(self, estimates: FloatArray) -> list[str]:
        """Coefficients (in physical units) that ended at the edge of what they may be."""
        baseline = self.problem.baseline
        low, high = self._range
        values, margin = estimates[: len(baseline)], 2e-3 * baseline.sd
        stuck = (values <= low + margin) | (values >= high - margin)
        return [path for path, at in zip(baseline.paths, stuck, strict=True) if at]

    def effects_at_bounds(self, vector: FloatArray) -> list[str]:
        """Effect parameters that ended at the edge of what they may be."""
        values = zip(self.freedoms, vector[self.count :], strict=True)
        return [f.path for f, value in values if value <= f.lower or value >= f.upper]

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
        matrix = np.eye(len(self.names))
        matrix[: self.count, : self.count] = self.problem.baseline.factor
        return matrix


def residuals_at(
    problem: Problem,
    free: Free,
    vectors: FloatArray,
    noise: NoiseModel,
    filtered: Sequence[Filtered],
) -> FloatArray:
    """Whitened residuals (N, D) of vectors (n, N) with the gains of a filter that has run."""
    effects = {f.path: vectors[free.count + i] for i, f in enumerate(free.freedoms)}
    return problem.innovations(vectors[: free.count], effects, noise, filtered)


def linearise(
    problem: Problem,
    free: Free,
    vector: FloatArray,
    noise: NoiseModel,
    filtered: Sequence[Filtered],
) -> Linearised:
    """Residuals and slopes by one batch of filter lanes.

    A parameter that cannot be moved without the simulation diverging gets no slope: it stays.
    """
    lanes, steps = free.lanes(vector)
    innovations = residuals_at(problem, free, lanes, noise, filtered)
    rows = innovations[1:]
    # In place: memory fresh from the system costs as much as the arithmetic.
    rows -= innovations[0]
    rows /= steps[:, None]
    rows[~((rows.min(axis=1) > -LARGEST_SLOPE) & (rows.max(axis=1) < LARGEST_SLOPE))] = 0.0
    channels = len(problem.channels)
    run_of = np.repeat(np.arange(len(problem.runs)), [run.measured.size for run in problem.runs])
    time_of = np.concatenate([np.repeat(run.clock, channels) for run in problem.runs])
    return Linearised(innovations[0], rows.T, run_of, time_of)


def objective(
    problem: Problem, free: Free, vector: FloatArray, noise: NoiseModel
) -> tuple[float, list[Filtered]]:
    """-2 log likelihood + prior, and the filter results it comes from.

    Infinite, and nothing filtered, where no fish can have the coefficients.
    """
    if not problem.baseline.possible(vector[: free.count]):
        return np.inf, []
    results = problem.filtered(free.unpack(vector), noise)
    value = -2.0 * sum(r.log_likelihood for r in results) + free.prior @ (vector * vector)
    return float(value), results


def objectives_with_gains(
    problem: Problem,
    free: Free,
    vectors: Sequence[FloatArray],
    noise: NoiseModel,
    filtered: Sequence[Filtered],
) -> list[float]:
    """-2 log likelihood + prior with the gains of a filter that has run, but for a constant.

    The constant is that of the gains: models can be compared under the same ones. All vectors
    together take no longer than one filter. Infinite where no fish can have the coefficients, or
    the simulation diverges.
    """
    lanes = np.column_stack(vectors)
    rows = residuals_at(problem, free, lanes, noise, filtered)
    able = problem.baseline.all_possible(lanes[: free.count])
    cases = zip(vectors, rows, able.tolist(), strict=True)
    return [_objective(free, vector, residuals, can) for vector, residuals, can in cases]


def objective_of(problem: Problem, free: Free, vector: FloatArray, residuals: FloatArray) -> float:
    """The same of a vector whose whitened residuals (D,) are known."""
    return _objective(free, vector, residuals, problem.baseline.possible(vector[: free.count]))


def _objective(free: Free, vector: FloatArray, residuals: FloatArray, possible: bool) -> float:
    value = float(residuals @ residuals + free.prior @ (vector * vector))
    return value if possible and np.isfinite(value) else np.inf
