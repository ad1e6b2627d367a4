"""What differs from run to run: random effects under normal priors, integrated out.

Whitened residuals of run r depend on its own numbers c_r by slopes M_r, and c_r scatters about
zero with standard deviations tau. Integrating c_r out leaves residuals with the covariance
I + M_r diag(tau^2) M_r'. Whitening them by its inverse root makes every later step (Gauss-Newton,
projections, evidence) that of a model without such numbers. The slopes are taken at estimates b_r,
so residuals count as r - M b. Source: Laird and Ware (1982), Biometrics 38, 963; first-order
conditional estimation as in Lindstrom and Bates (1990), Biometrics 46, 673.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.special import chdtrc

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.estimate.box_qp import minimise_in_box
from fish_env.inference.hypotheses import EffectParameterId, ParameterId
from fish_env.inference.policy import POLICY

FARTHEST = 30.0
"""Largest number of a run, in units of its spread. None of a normal law is that far off: where a
simulation is about to diverge its slopes would lead anywhere."""


@dataclass(frozen=True)
class RunVariation:
    """Something that a vehicle's runs differ in.

    Attributes:
        name: what it is.
        unit: SI.
        usual: standard deviation over runs that is ordinary; what is estimated is judged by it.
        shared: whether runs may as well have it in common. If not, only differences between runs
            count as variation: what all runs have in common is a cause, to be found and named.
            What they may share is not taken to be far beyond the usual, which again is a cause.
        positive: whether it cannot be negative: no device shows what has yet to happen.
        beside: parameter of an effect that is what runs have of it in common, if there is one.
    """

    name: str
    unit: str
    usual: float
    shared: bool = False
    positive: bool = False
    beside: EffectParameterId | None = None

    @property
    def largest(self) -> float:
        """Largest spread, in usual ones, that is taken for variation."""
        return POLICY.beyond_usual if self.shared else POLICY.largest_run_spread


@dataclass(frozen=True)
class CommonEffect:
    """An effect that does in all runs what numbers of their own do in single ones.

    Attributes:
        effect: its name.
        numbers: names of the variations.
        values: its parameters from what runs share of each number (SI), and of those beside; None
            where no effect does that. Others stay at neutral.
        beside: names of further variations, which stay: part of them may be the effect's too.
        rates: by how much each number changes with the one parameter that moves all of them (SI);
            none where each has a parameter of its own. The remainder of a number stays.
    """

    effect: str
    numbers: tuple[str, ...]
    values: Callable[[Sequence[float]], Mapping[str, float] | None]
    beside: tuple[str, ...] = ()
    rates: tuple[float, ...] = ()


def shown_spread(values: FloatArray, variance: FloatArray) -> FloatArray:
    """Spreads (K,) over runs as the data show them, in usual ones; zero where chance would do.

    A prediction is what a run shows, with noise of variance v / (1 - v), times 1 - v, where v is
    its posterior variance. The spread follows from the mean square (method of moments).

    Args:
        values: (R, K) predictions of the runs' own numbers, in usual spreads.
        variance: (R, K) their posterior variances, likewise.
    """
    noise = np.maximum(variance * (1.0 - variance), 1e-12)
    statistic = np.sum(values**2 / noise, axis=0)
    shown = chdtrc(len(values), statistic) < POLICY.shown_spread_level / values.shape[1]
    told = variance.mean(axis=0) < POLICY.most_untold_variance
    unsure = np.minimum(variance, 1.0 - 1e-9)
    squares = np.mean((values / (1.0 - unsure)) ** 2 - unsure / (1.0 - unsure), axis=0)
    return np.asarray(np.where(shown & told, np.sqrt(np.maximum(squares, 0.0)), 0.0))


def pairs_beside(
    variations: Sequence[RunVariation], ids: Sequence[ParameterId]
) -> list[tuple[int, int]]:
    """Numbers of runs that are beside a free parameter, each with the place of that.

    Args:
        variations: what runs differ in.
        ids: of the free parameters.
    """
    at = {id: i for i, id in enumerate(ids)}
    return [(own, at[v.beside]) for own, v in enumerate(variations) if v.beside in at]


def in_proportion(slopes: FloatArray, pairs: Iterable[tuple[int, FloatArray]]) -> FloatArray:
    """Slopes (D, K) of which some are in proportion to others, nothing else of them left.

    Args:
        slopes: (D, K).
        pairs: number of a column, and what (D,) it is a multiple of.
    """
    slopes = slopes.copy()
    for column, shared in pairs:
        size = shared @ shared
        if size > 0.0:
            slopes[:, column] = shared * (shared @ slopes[:, column] / size)
    return slopes


@dataclass(frozen=True, eq=False)
class Marginal:
    """Residuals with the runs' own numbers integrated out.

    Attributes:
        slopes: (D, K) derivative of whitened residuals by their own run's numbers, each in units
            of its spread.
        at: (R, K) where the slopes were taken, in units of the spread.
        run_of: (D,) run of each residual; runs one after another.
    """

    slopes: FloatArray
    at: FloatArray
    run_of: IntArray

    @cached_property
    def _parts(self) -> list[tuple[slice, FloatArray, FloatArray]]:
        """Of each run: its residuals, what they lose, and their variances - 1 along k directions.

        Residuals r (D_r,) lose M S M' r, with slopes M (D_r, K) and S (K, K).
        """
        found = []
        for own in self._slices:
            mine = self.slopes[own]
            values, vectors = np.linalg.eigh(mine.T @ mine)
            kept = values > 1e-9
            along, values = vectors[:, kept], values[kept]
            shrink = 1.0 - 1.0 / np.sqrt(1.0 + values)
            found.append((own, (along * (shrink / values)) @ along.T, values))
        return found

    @cached_property
    def _slices(self) -> list[slice]:
        edges = np.searchsorted(self.run_of, np.arange(len(self.at) + 1))
        return [slice(a, b) for a, b in pairwise(edges.tolist())]

    def alike(self, pairs: Iterable[tuple[int, FloatArray]]) -> Marginal:
        """The same with slopes of own numbers in proportion to those by what runs share.

        Water that drifts in all runs and in one of them does the same to that run, and no data tell
        the two apart. Slopes that were worked out in two ways differ a little, and very accurate
        data then seem to: what runs share would be known better than as a mean over so many runs,
        and steps to it would be too short.

        Args:
            pairs: number of a column, and slopes (D,) by the parameter that it is beside.
        """
        return replace(self, slopes=in_proportion(self.slopes, pairs))

    def rows(self, rows: FloatArray) -> FloatArray:
        """Rows (m, D) of residuals or of their changes, whitened with the variation in place."""
        for own, lost, _ in self._parts:
            mine = self.slopes[own]
            rows[:, own] -= ((rows[:, own] @ mine) @ lost) @ mine.T
        return rows

    def residuals(self, residuals: FloatArray) -> FloatArray:
        """Residuals (D,) with the runs' own numbers integrated out."""
        shift = np.einsum("dk,dk->d", self.slopes, self.at[self.run_of])
        return np.asarray(self.rows((residuals - shift)[None])[0])

    @cached_property
    def log_dets(self) -> FloatArray:
        """(R,) what integrating costs in -2 log likelihood of each run."""
        return np.array([np.log1p(variance).sum() for _, _, variance in self._parts])

    @property
    def log_det(self) -> float:
        """What it costs in that of all runs."""
        return float(self.log_dets.sum())

    def predicted(
        self, residuals: FloatArray, damping: float = 0.0, least: FloatArray | None = None
    ) -> FloatArray:
        """Best prediction (R, K) of the runs' own numbers, in units of their spread.

        Args:
            residuals: (D,) whitened, at the numbers where the slopes were taken.
            damping: by how much more information than there is each number is held where it is
                (Marquardt, 1963, J. SIAM 11, 431).
            least: (K,) smallest value that each may have; default: any within the farthest.
        """
        found = []
        for own, at in zip(self._slices, self.at, strict=True):
            mine = self.slopes[own]
            information = mine.T @ mine + np.eye(mine.shape[1])
            held = information + damping * np.diag(np.diag(information))
            pull = mine.T @ residuals[own] + at
            step = -np.linalg.solve(held, pull)
            low = np.full(len(at), -FARTHEST) if least is None else np.maximum(least, -FARTHEST)
            if np.any(at + step < low) or np.any(at + step > FARTHEST):
                box = np.minimum(low - at, 0.0), np.maximum(FARTHEST - at, 0.0)
                step = minimise_in_box(held, pull, *box).step
            found.append(at + step)
        return np.array(found)

    def uncertainty(self) -> FloatArray:
        """Posterior variance (R, K) of the runs' own numbers, in units of that of their spread."""
        grams = [self.slopes[own].T @ self.slopes[own] for own in self._slices]
        return np.array([np.diag(np.linalg.inv(gram + np.eye(len(gram)))) for gram in grams])

    def some(self, runs: Sequence[int]) -> Marginal:
        """The same on some of the runs."""
        slices = [self._slices[i] for i in runs]
        count = [s.stop - s.start for s in slices]
        run_of = np.repeat(np.arange(len(runs)), count)
        return Marginal(
            np.concatenate([self.slopes[s] for s in slices]), self.at[list(runs)], run_of
        )
