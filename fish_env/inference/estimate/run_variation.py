"""What differs from run to run: random effects under normal priors, integrated out.

Whitened residuals of run r depend on its own numbers c_r by slopes M_r, and c_r scatters about
zero with standard deviations tau. Integrating c_r out leaves residuals with the covariance
I + M_r diag(tau^2) M_r'. Whitening them by its inverse root makes every later step (Gauss-Newton,
projections, evidence) that of a model without such numbers. The slopes are taken at estimates b_r,
so residuals count as r - M b. Source: Laird and Ware (1982), Biometrics 38, 963; first-order
conditional estimation as in Lindstrom and Bates (1990), Biometrics 46, 673.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.inference.estimate.products import inner
from fish_env.inference.policy import POLICY

SMALLEST = 1e-3
"""Spread, in units of the usual one, that counts as none."""
LARGEST = 30.0
"""Largest spread that is looked for, in units of the usual one."""
SIZES = np.geomspace(0.1, 10.0, 7)
"""Spreads that are tried before one is looked for exactly, in units of the usual one."""
FORESEEN = 2.0
"""Standard errors of a run's number by which its mean is surely negative."""
WIDE = 0.01
"""Precision of what all runs have in common, in usual spreads: hardly any."""


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
    """

    name: str
    unit: str
    usual: float
    shared: bool = False
    positive: bool = False

    @property
    def largest(self) -> float:
        """Largest spread, in usual ones, that is taken for variation."""
        return POLICY.beyond_usual if self.shared else LARGEST


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
    def parts(self) -> list[tuple[slice, FloatArray, FloatArray]]:
        """Of each run: its residuals, orthonormal directions (D_r, k), and their variances - 1."""
        found = []
        for own in self._slices:
            mine = self.slopes[own]
            values, vectors = np.linalg.eigh(mine.T @ mine)
            kept = values > 1e-9
            root = np.sqrt(values[kept])
            found.append((own, mine @ (vectors[:, kept] / root), values[kept]))
        return found

    @cached_property
    def _slices(self) -> list[slice]:
        edges = np.searchsorted(self.run_of, np.arange(len(self.at) + 1))
        return [slice(a, b) for a, b in pairwise(edges.tolist())]

    def rows(self, rows: FloatArray) -> FloatArray:
        """Rows (m, D) of residuals or of their changes, whitened with the variation in place."""
        for own, directions, variance in self.parts:
            shrink = 1.0 - 1.0 / np.sqrt(1.0 + variance)
            rows[:, own] -= ((rows[:, own] @ directions) * shrink) @ directions.T
        return rows

    def residuals(self, residuals: FloatArray) -> FloatArray:
        """Residuals (D,) with the runs' own numbers integrated out."""
        shift = np.einsum("dk,dk->d", self.slopes, self.at[self.run_of])
        return np.asarray(self.rows((residuals - shift)[None])[0])

    @cached_property
    def log_det(self) -> float:
        """What integrating costs in -2 log likelihood."""
        return float(sum(np.log1p(variance).sum() for _, _, variance in self.parts))

    def predicted(self, residuals: FloatArray) -> FloatArray:
        """Best prediction (R, K) of the runs' own numbers, in units of their spread.

        Args:
            residuals: (D,) whitened, at the numbers where the slopes were taken.
        """
        shift = np.einsum("dk,dk->d", self.slopes, self.at[self.run_of])
        shifted, found = residuals - shift, []
        for own in self._slices:
            mine = self.slopes[own]
            information = mine.T @ mine + np.eye(mine.shape[1])
            found.append(-np.linalg.solve(information, mine.T @ shifted[own]))
        return np.array(found)

    def some(self, runs: Sequence[int]) -> Marginal:
        """The same on some of the runs."""
        slices = [self._slices[i] for i in runs]
        count = [s.stop - s.start for s in slices]
        run_of = np.repeat(np.arange(len(runs)), count)
        return Marginal(
            np.concatenate([self.slopes[s] for s in slices]), self.at[list(runs)], run_of
        )


@dataclass(frozen=True, eq=False)
class Spread:
    """Estimated spreads.

    Attributes:
        sd: (K,) standard deviation over runs, zero where none is indicated.
        gain: what -2 log likelihood gains by them.
        values: (R, K) best prediction of each run's own numbers.
        errors: (R, K) their standard errors.
    """

    sd: FloatArray
    gain: float
    values: FloatArray
    errors: FloatArray


class Likelihood:
    """Restricted likelihood of spreads, the shared parameters integrated out.

    Args:
        residuals: (D,) whitened, at the runs' numbers ``at``.
        slopes: (D, n) by the shared parameters.
        own: (D, K) by each run's own numbers, in units of their usual spread.
        at: (R, K) the runs' own numbers in those units.
        run_of: (D,) run of each residual.
        information: (n, n) of the shared parameters with their prior.
        pull: (n,) gradient of the shared parameters' prior at the estimates.
        common: (K,) whether what all runs have in common is a parameter of its own, which no
            spread has to explain.
    """

    def __init__(
        self,
        residuals: FloatArray,
        slopes: FloatArray,
        own: FloatArray,
        at: FloatArray,
        run_of: IntArray,
        information: FloatArray,
        pull: FloatArray,
        common: BoolArray,
    ) -> None:
        shifted = residuals - np.einsum("dk,dk->d", own, at[run_of])
        edges = np.searchsorted(run_of, np.arange(len(at) + 1))
        slices = [slice(a, b) for a, b in pairwise(edges.tolist())]
        self.grams = [own[s].T @ own[s] for s in slices]
        cross = [own[s].T @ slopes[s] for s in slices]
        self.cross = [np.hstack([c, g[:, common]]) for c, g in zip(cross, self.grams, strict=True)]
        self.scores = [own[s].T @ shifted[s] for s in slices]
        mixed = np.sum(cross, axis=0)[common]
        both = np.sum(self.grams, axis=0)[np.ix_(common, common)] + WIDE * np.eye(common.sum())
        self.information = np.block([[information, mixed.T], [mixed, both]])
        pulls = inner(slopes, shifted[:, None])[:, 0] + pull
        self.gradient = np.r_[pulls, np.sum(self.scores, axis=0)[common]]

    def __call__(self, sd: FloatArray) -> float:
        """-2 log likelihood of spreads (K,), but for a constant."""
        left, pull, value = self.information.copy(), self.gradient.copy(), 0.0
        for gram, cross, score in zip(self.grams, self.cross, self.scores, strict=True):
            inner_, factor = _kept(gram, sd)
            value += float(np.linalg.slogdet(inner_)[1])
            moved = factor @ np.linalg.solve(inner_, factor.T @ score)
            value -= float(score @ moved)
            left -= cross.T @ (factor @ np.linalg.solve(inner_, factor.T @ cross))
            pull -= cross.T @ moved
        value += float(np.linalg.slogdet(left)[1])
        return value - float(pull @ np.linalg.solve(left, pull))

    def predicted(self, sd: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Best predictions (R, K) of the runs' own numbers, and their standard errors (R, K)."""
        left, pull = self.information.copy(), self.gradient.copy()
        parts = []
        for gram, cross, score in zip(self.grams, self.cross, self.scores, strict=True):
            inner_, factor = _kept(gram, sd)
            posterior = factor @ np.linalg.solve(inner_, factor.T)
            left -= cross.T @ posterior @ cross
            pull -= cross.T @ posterior @ score
            parts.append((posterior, cross, score))
        covariance = np.linalg.inv(left)
        step = -covariance @ pull
        values = [-(p @ (score + cross @ step)) for p, cross, score in parts]
        spreads = [np.diag(p + p @ c @ covariance @ c.T @ p) for p, c, _ in parts]
        return np.array(values), np.sqrt(np.maximum(spreads, 0.0))


def _kept(gram: FloatArray, sd: FloatArray) -> tuple[FloatArray, FloatArray]:
    """I + T^1/2 M'M T^1/2, and T^1/2 = diag(sd)."""
    factor = np.diag(sd)
    return np.eye(len(sd)) + factor @ gram @ factor, factor


def fit_spread(likelihood: Likelihood, variations: Sequence[RunVariation]) -> Spread:
    """Spreads of largest posterior density; none that is not strongly indicated.

    Spreads are added one at a time, the most indicated first, while one gains enough. The prior of
    each is half-normal with the usual spread as its scale: what is far beyond it has to be plain.
    What cannot be negative is left out where it would be: something else is then meant.

    Args:
        likelihood: of spreads in units of the usual ones.
        variations: what the runs may differ in, K of them.
    """
    count = len(variations)
    usual = np.array([variation.usual for variation in variations])
    largest = np.array([variation.largest for variation in variations])
    positive = np.array([variation.positive for variation in variations], bool)
    sd, none = np.zeros(count), likelihood(np.zeros(count))
    active: list[int] = []
    refused: set[int] = set()
    best = none
    while left := [i for i in range(count) if i not in active and i not in refused]:
        added = [_alone(likelihood, sd, i, float(largest[i])) for i in left]
        value, i, size = min(added)
        if best - value < POLICY.run_variation_gain:
            break
        active.append(i)
        sd[i] = size
        sd, best = _largest(likelihood, largest, active, sd)
        wrong = positive & _negative(*likelihood.predicted(sd)) & (sd > 0.0)
        if wrong.any():
            refused |= {*np.flatnonzero(wrong).tolist()}
            active = [k for k in active if k not in refused]
            sd, best = _largest(likelihood, largest, active, sd) if active else (0.0 * sd, none)
    values, errors = likelihood.predicted(sd)
    return Spread(sd * usual, none - best, values * usual, errors * usual)


def _negative(values: FloatArray, errors: FloatArray) -> BoolArray:
    """(K,) whether the runs' own numbers (R, K) are negative on the whole."""
    return np.asarray(values.mean(axis=0) < -FORESEEN * errors.mean(axis=0))


def _alone(
    likelihood: Likelihood, sd: FloatArray, i: int, largest: float
) -> tuple[float, int, float]:
    """-2 log density of one more spread at its best size, which one, and that size."""
    trials = []
    for size in SIZES[largest > SIZES]:
        trial = sd.copy()
        trial[i] = size
        trials.append((_posterior(likelihood, trial), i, float(size)))
    return min(trials)


def _largest(
    likelihood: Likelihood, largest: FloatArray, active: Sequence[int], begin: FloatArray
) -> tuple[FloatArray, float]:
    """Spreads (K,) of largest density with only some of them active, and -2 log of it."""
    sd, own = np.zeros(len(largest)), list(active)

    def value(logs: FloatArray) -> float:
        trial = np.zeros(len(largest))
        trial[own] = np.exp(logs)
        return _posterior(likelihood, trial)

    limits = [(float(np.log(SMALLEST)), float(np.log(largest[i]))) for i in own]
    found = minimize(value, np.log(begin[own]), method="L-BFGS-B", bounds=limits)
    sd[own] = np.exp(found.x)
    sd[sd <= 2.0 * SMALLEST] = 0.0
    return sd, _posterior(likelihood, sd)


def _posterior(likelihood: Likelihood, sd: FloatArray) -> float:
    """-2 log of the density of spreads (K,) in usual ones, but for a constant."""
    return likelihood(sd) + float(sd @ sd)
