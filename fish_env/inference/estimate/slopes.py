"""Slopes along a descent: those of baseline coefficients are kept while they are near enough.

A fit has a few dozen coefficients, which are nearly linear, and a few effect parameters, which are
not. Slopes by all of them take several times as long as the evaluation of a step. So after a first
step with all slopes the next ones work out only those by effect parameters, and all of them again
where the kept ones are of no more use, or seem to have reached the minimum. What a fit ends with is
therefore judged by slopes of its own. Source: Shamanskii (1967), Ukrainian Mathematical Journal 19,
118; Kelley, "Iterative Methods for Linear and Nonlinear Equations", SIAM 1995, section 5.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.free import (
    Free,
    Linearised,
    linearised,
    marginal_of,
    residuals_and_rows,
    spread_of,
)
from fish_env.inference.estimate.run_variation import Marginal, pairs_beside
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.problem import Problem


@dataclass(frozen=True, eq=False)
class _Known:
    """Residuals (D,) and their slopes (n, D) at an evaluation, nothing integrated out."""

    problem: Problem
    vector: FloatArray
    filtered: Sequence[Evaluation]
    residuals: FloatArray
    rows: FloatArray

    def is_of(self, problem: Problem, vector: FloatArray, filtered: Sequence[Evaluation]) -> bool:
        """Whether it is that of the very same evaluation."""
        same = problem is self.problem and filtered is self.filtered
        return same and np.array_equal(vector, self.vector)


class Slopes:
    """Linearisations of one problem along a descent, under one noise model.

    Args:
        free: the free parameters.
        noise: the noise model.
    """

    def __init__(self, free: Free, noise: Any) -> None:
        self.free, self.noise = free, noise
        self._last: _Known | None = None

    def exact(
        self,
        problem: Problem,
        vector: FloatArray,
        filtered: Sequence[Evaluation],
        marginal: Marginal | None = None,
    ) -> Linearised:
        """All slopes at a vector.

        Args:
            problem: the problem, with the runs' own numbers in place.
            vector: (n,) where to linearise.
            filtered: evaluation there, whose weighting is held.
            marginal: integrates out what the runs differ in.
        """
        if self._last is None or not self._last.is_of(problem, vector, filtered):
            found = residuals_and_rows(problem, self.free, vector, self.noise, filtered)
            self._last = _Known(problem, vector, filtered, *found)
        rows = self._last.rows if marginal is None else self._last.rows.copy()
        return linearised(problem, self._last.residuals, rows, marginal)

    def quick(
        self,
        problem: Problem,
        vector: FloatArray,
        filtered: Sequence[Evaluation],
        marginal: Marginal | None = None,
    ) -> Linearised:
        """Slopes by effect parameters at a vector, and by coefficients where all were last known.

        Args as for :meth:`exact`, which this is where none were.
        """
        count = self.free.count
        if self._last is None:
            return self.exact(problem, vector, filtered, marginal)
        at = (problem, self.free, vector, self.noise, filtered)
        residuals, rows = residuals_and_rows(*at, first=count)
        rows = np.concatenate([self._last.rows[:count], rows])
        return linearised(problem, residuals, rows, marginal)

    def marginal(
        self, problem: Problem, vector: FloatArray, filtered: Sequence[Evaluation]
    ) -> Marginal | None:
        """How to integrate out what the runs differ in; None where they do not.

        Slopes by a number that is beside a free parameter are those by the parameter. Args as for
        :meth:`exact`.
        """
        found = marginal_of(problem, self.free.unpack(vector), self.noise, filtered)
        if found is None or not self._beside(problem):
            return found
        return self.alike(found, problem, self.exact(problem, vector, filtered))

    def alike(self, marginal: Marginal, problem: Problem, lin: Linearised) -> Marginal:
        """What runs differ in beside free parameters with the slopes by these.

        Args:
            marginal: integrates out what the runs differ in.
            problem: the problem.
            lin: slopes with nothing integrated out.
        """
        pairs = self._beside(problem)
        return marginal.alike((own, lin.slopes[:, i]) for own, i in pairs) if pairs else marginal

    def _beside(self, problem: Problem) -> list[tuple[int, int]]:
        """Pairs of an active number of runs and the free parameter that it is beside."""
        active = np.flatnonzero(spread_of(problem, self.noise)).tolist()
        return pairs_beside([problem.variations[i] for i in active], self.free.ids)
