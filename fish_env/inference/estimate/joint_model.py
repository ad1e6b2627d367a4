"""The linear model of residuals by what all runs share and by each run's own numbers.

Its equations have an arrow's shape, see :mod:`~fish_env.inference.estimate.joint`.
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
    own_objectives,
    quadratic,
    spread_of,
)
from fish_env.inference.estimate.run_variation import Marginal
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem


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

    @classmethod
    def of(
        cls,
        problem: Problem,
        free: Free,
        vector: FloatArray,
        filtered: Sequence[Evaluation],
        noise: Any,
    ) -> Joint:
        """Everything at a point (n,), from an evaluation there."""
        of_runs = own_objectives(problem, filtered, noise)
        return cls(problem, vector, filtered, with_prior(free, vector, of_runs), of_runs)

    @property
    def residuals(self) -> FloatArray:
        """(D,) whitened."""
        return np.concatenate([run.residuals for run in self.filtered])

    def marginal_value(self, marginal: Marginal) -> float:
        """-2 log likelihood + prior with the runs' own numbers integrated out.

        The linear model says what a run would still gain by its own numbers. A gain of a few is one
        that the last steps left over; more of it is none: the run was led there, and lost.

        Args:
            marginal: integrates the own numbers out, by slopes at the point.
        """
        residuals = self.residuals
        saved = residuals**2 - marginal.residuals(residuals) ** 2
        left = np.sum(marginal.at**2, axis=1) + np.bincount(marginal.run_of, saved)
        return self.value - float(np.minimum(left, POLICY.evidence_doubt).sum()) + marginal.log_det


def evaluated(problem: Problem, free: Free, vector: FloatArray, noise: Any) -> Joint:
    """Everything at a point; infinite where no vehicle can be so, or the simulation diverges."""
    if not problem.baseline.possible(vector[: free.count]):
        return Joint(problem, vector, (), np.inf, np.full(problem.run_count, np.inf))
    return Joint.of(problem, free, vector, problem.filtered(free.unpack(vector), noise), noise)


class Model:
    """The linear model of residuals about a point, by shared parameters and by own numbers.

    Args:
        slopes: the shared parameters, the noise model, and the slopes on the way.
        at: the point.
        near: slopes by own numbers that are near enough, as those by coefficients at the same
            point then are; None to work out all of them.
    """

    def __init__(self, slopes: Slopes, at: Joint, near: Marginal | None) -> None:
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
            moved = replace(near, at=problem.variation[:, self.active] / self.spread)
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


def with_prior(free: Free, vector: FloatArray, of_runs: FloatArray) -> float:
    """-2 log likelihood + both priors, from what each run (R,) has of it."""
    return float(free.prior @ (vector * vector) + of_runs.sum())
