"""What each cause would change, seen through a refit of the baseline: before looking, and after.

All in the whitened prediction errors of the filter, where noise is white with unit variance. A
cause's signal is projected on what the baseline (under its priors) cannot follow; the rest decides
how detectable it is, how alike two causes are, and how much of the misfit it explains.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from fish_env.arrays import FloatArray, SingleArray
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.information import (
    block_index,
    gradient,
    information,
    prior_precision,
    sums_over,
)
from fish_env.inference.estimate.products import inner
from fish_env.inference.parallel import side_by_side
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Cause
from fish_env.inference.tails import chi2_log_tail

T = TypeVar("T")
AT_ONCE = 16
"""Signals that are projected together: a tall product costs little more than a slim one."""
SINGLE_PRECISION = 1e-6
"""Relative error of a sum of products in 32 bits, with room."""


@dataclass(frozen=True, eq=False)
class Projected:
    """A cause at one of its alternatives, seen through a refit of the baseline.

    Attributes:
        cause: the cause.
        probe: index of the alternative (-1: a baseline coefficient).
        left: (D, m) change of the residuals for the settings probed, after a refit. In 32 bits:
            a screen holds hundreds, and what decides is worked out before.
        energy: squared size of that change before the refit.
        projected: (m, m) information about the settings after a refit of the baseline.
        score: (m,) projected signal times residuals.
    """

    cause: Cause
    probe: int
    left: SingleArray
    energy: float
    projected: FloatArray
    score: FloatArray

    @property
    def freedom(self) -> int:
        """Number of settings."""
        return len(self.score)

    @property
    def size(self) -> FloatArray:
        """(m,) multiple of each setting in the linearised fit."""
        return np.asarray(np.linalg.solve(self.projected, self.score))

    @property
    def likelihood_ratio(self) -> float:
        """Of the linearised fit, in white noise of unit variance and with no bound in the way."""
        return float(self.score @ self.size)

    @property
    def absorbed_share(self) -> float:
        """Share of the signal's energy that a refit of the baseline absorbs."""
        return 1.0 - float(np.trace(self.projected)) / max(self.energy, 1e-30)


@dataclass(frozen=True, eq=False)
class Signal(Projected):
    """A cause at one of its alternatives, in time series.

    Attributes:
        variance_inflation: factor by which coloured residuals widen the score, at least 1.
        followed: (n, m) how the free parameters of the fit follow the change in a refit.
        tries: alternatives that it is the best of, where the others are not kept.
    """

    variance_inflation: float
    followed: FloatArray | None = None
    tries: int = 1

    @property
    def statistic(self) -> float:
        """Likelihood ratio over variance inflation; chi-squared if nothing acts."""
        return self.likelihood_ratio / self.variance_inflation

    @property
    def uncorrected(self) -> float:
        """The likelihood ratio without variance inflation, as if the residuals were white."""
        return self.statistic * self.variance_inflation

    @property
    def log_p(self) -> float:
        """Logarithm of the p-value of this one test: overwhelming evidence still ranks."""
        return self.log_p_of(self.statistic)

    def log_p_of(self, statistic: float) -> float:
        """Logarithm of the p-value of a statistic of this test, by Bonferroni's bound on tries."""
        chance = float(chi2_log_tail(statistic, self.freedom)) + np.log(self.tries)
        return float(min(chance, 0.0))

    @cached_property
    def to_orthonormal(self) -> FloatArray:
        """(m, k) weights that make orthonormal columns of ``left``, of its k independent ones."""
        return orthonormal(inner(self.left, self.left))


def orthonormal(products: FloatArray) -> FloatArray:
    """Weights (m, k) that make orthonormal columns of some, of their k independent ones.

    Args:
        products: (m, m) of these columns, which are in 32 bits.
    """
    values, vectors = np.linalg.eigh(products)
    kept = values > SINGLE_PRECISION * values[-1]
    return np.asarray(vectors[:, kept] / np.sqrt(values[kept]))


class Projector:
    """Removes from signals what a refit of the free parameters of a fit would follow.

    A refit does not cross an active constraint: the tangent space is that of the active set.
    """

    def __init__(self, fit: Fit) -> None:
        self.lin = fit.linearised
        slopes = self.lin.slopes
        baseline = fit.problem.baseline
        self.prior = prior_precision(baseline, slopes.shape[1] - len(baseline), fit.released)
        self.vector = np.concatenate([fit.point.z, np.zeros(slopes.shape[1] - len(baseline))])
        self.hessian = information(slopes, self.prior)
        self.factor = np.linalg.cholesky(self.hessian)
        self.active = fit.active
        self.blocks = [
            block_index(self.lin.run_of, self.lin.time_of, s)
            for s in (POLICY.score_block_s, POLICY.long_score_block_s)
        ]

    def coefficients(self, columns: FloatArray) -> FloatArray:
        """How a refit follows the columns: (n, m)."""
        return self.moved(inner(self.lin.slopes, columns), self.active)

    def moved(self, pull: FloatArray, active: FloatArray) -> FloatArray:
        """How far a pull (n, m) takes the free parameters along active constraints (k, n)."""
        free = self._free(pull)
        if not len(active):
            return free
        across = self._free(active.T)
        return np.asarray(free - across @ np.linalg.solve(active @ across, active @ free))

    def without_own_bound(self, i: int) -> tuple[float, float]:
        """Where one coefficient settles without a bound of its own, and its variance."""
        own = np.array([np.flatnonzero(row)[-1] == i for row in self.active], bool)
        others = self.active[~own]
        variance = float(self.moved(np.eye(len(self.vector))[:, [i]], others)[i, 0])
        at = float(self.vector[i])
        if own.any():
            at -= float(self.moved(self.gradient[:, None], others)[i, 0])
        return at, variance

    @cached_property
    def gradient(self) -> FloatArray:
        """What pulls the free parameters (n,), along bounds and across them."""
        return gradient(self.lin.slopes, self.lin.residuals, self.prior, self.vector)

    def _free(self, pull: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.solve(self.factor.T, np.linalg.solve(self.factor, pull)))

    def signal(
        self, cause: Cause, probe: int, columns: FloatArray, count_prior: bool = True
    ) -> Signal | None:
        """Project a cause; None where nothing of it is left, or the simulation diverges with it.

        Args:
            cause: the cause.
            probe: index of the alternative.
            columns: (D, m) change of the residuals.
            count_prior: whether what pulled the coefficients from their priors counts as evidence,
                as it does for a cause that would let them return.
        """
        return self.signals([(cause, probe, range(columns.shape[1]))], columns.T, count_prior)[0]

    def signals(
        self,
        tests: Sequence[tuple[Cause, int, Sequence[int]]],
        rows: FloatArray,
        count_prior: bool = True,
    ) -> list[Signal | None]:
        """As :meth:`signal`, of many causes at once.

        Args:
            tests: cause, index of the alternative, and which rows are its own.
            rows: (m, D) changes of the residuals.
            count_prior: see :meth:`signal`.
        """

        def together(part: Sequence[tuple[Cause, int, Sequence[int]]]) -> list[Signal | None]:
            changes = rows[[i for _, _, own in part for i in own]]
            followed = self.coefficients(changes.T)
            left = changes - followed.T @ self.lin.slopes.T
            found, first = [], 0
            for cause, probe, own in part:
                mine = slice(first, first + len(own))
                seen = changes[mine].T, followed[:, mine], left[mine].T
                found.append(self._signal(cause, probe, *seen, count_prior))
                first += len(own)
            return found

        parts = in_parts(tests, lambda test: len(test[2]), AT_ONCE)
        found_of_parts = side_by_side(partial(together, part) for part in parts)
        return [signal for part in found_of_parts for signal in part]

    def information(self, followed: FloatArray, left: FloatArray | SingleArray) -> FloatArray:
        """(m, m) information about settings after a refit.

        Args:
            followed: (n, m) how the free parameters follow each.
            left: (D, m) change of the residuals that this leaves.
        """
        return inner(left, left) + followed.T @ (self.prior[:, None] * followed)

    def score(self, followed: FloatArray, left: FloatArray, count_prior: bool = True) -> FloatArray:
        """(m,) gradient by such settings, see :meth:`information` and :meth:`signal`."""
        score = -left.T @ self.lin.residuals
        return score + followed.T @ (self.prior * self.vector) if count_prior else score

    def _signal(
        self,
        cause: Cause,
        probe: int,
        columns: FloatArray,
        followed: FloatArray,
        left: FloatArray,
        count_prior: bool,
    ) -> Signal | None:
        if not np.isfinite(left).all():
            return None
        projected = self.information(followed, left)
        energy = np.einsum("ij,ij->j", columns, columns)
        weak = np.diag(projected) < POLICY.smallest_signal
        if np.any(weak) or np.any(energy < POLICY.smallest_change):
            return None
        projected += 1e-9 * np.diag(np.diag(projected))
        score = self.score(followed, left, count_prior)
        step = np.linalg.solve(projected, score)
        remaining = self.lin.residuals + left @ step
        inflation = self.variance_inflation(left, remaining)
        size = float(energy.sum())
        kept = left.astype(np.float32)
        return Signal(cause, probe, kept, size, projected, score, inflation, followed)

    def variance_inflation(self, left: FloatArray | SingleArray, residuals: FloatArray) -> float:
        """Spread of block sums of the score against what white residuals would give.

        The larger of two spreads, over blocks long enough for most disturbances and for slow ones.

        Args:
            left: (D, m) change of the residuals.
            residuals: (D,) without what changes along those directions would take from them.
        """
        scores = left * residuals[:, None]
        white = np.maximum(np.einsum("ij,ij->j", left, left), 1e-12)
        largest = 1.0
        for index in self.blocks:
            sums = sums_over(index, scores)
            largest = max(largest, float((np.einsum("ij,ij->j", sums, sums) / white).max()))
        return largest


def in_parts(tests: Iterable[T], size: Callable[[T], int], most: int) -> list[list[T]]:
    """Tests in their order, in parts whose sizes add up to no more than `most`, or of one test."""
    parts: list[list[T]] = []
    room = 0
    for test in tests:
        if not parts or size(test) > room:
            parts.append([])
            room = most
        parts[-1].append(test)
        room -= size(test)
    return parts
