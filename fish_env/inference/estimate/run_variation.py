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
from fish_env.inference.estimate.box_qp import minimise_in_box
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

    def predicted(
        self, residuals: FloatArray, damping: float = 0.0, least: FloatArray | None = None
    ) -> FloatArray:
        """Best prediction (R, K) of the runs' own numbers, in units of their spread.

        Args:
            residuals: (D,) whitened, at the numbers where the slopes were taken.
            damping: by how much more information than there is each number is held where it is
                (Marquardt, 1963, J. SIAM 11, 431).
            least: (K,) smallest value that each may have; default: any.
        """
        found = []
        for own, at in zip(self._slices, self.at, strict=True):
            mine = self.slopes[own]
            information = mine.T @ mine + np.eye(mine.shape[1])
            held = information + damping * np.diag(np.diag(information))
            pull = mine.T @ residuals[own] + at
            step = -np.linalg.solve(held, pull)
            if least is not None and np.any(at + step < least):
                low = np.minimum(least - at, 0.0)
                step = minimise_in_box(held, pull, low, np.full(len(at), np.inf)).step
            found.append(at + step)
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
        self.grams = np.array([own[s].T @ own[s] for s in slices])
        cross = np.array([own[s].T @ slopes[s] for s in slices])
        self.cross = np.concatenate([cross, self.grams[:, :, common]], axis=2)
        self.scores = np.array([own[s].T @ shifted[s] for s in slices])
        mixed = cross.sum(axis=0)[common]
        both = self.grams.sum(axis=0)[np.ix_(common, common)] + WIDE * np.eye(common.sum())
        self.information = np.block([[information, mixed.T], [mixed, both]])
        pulls = inner(slopes, shifted[:, None])[:, 0] + pull
        self.gradient = np.r_[pulls, self.scores.sum(axis=0)[common]]

    def __call__(self, sd: FloatArray) -> float:
        """-2 log likelihood of spreads (K,), but for a constant."""
        at = self._at(sd)
        value = at.score_norm + float(np.linalg.slogdet(at.left)[1])
        return value - float(at.pull @ np.linalg.solve(at.left, at.pull))

    def slope(self, sd: FloatArray) -> FloatArray:
        """Derivative (K,) of that by the logarithms of the spreads; zero of those that are none.

        With Q = (I + F M'M F)^-1, F = diag(sd) and q_k column k of F Q, the covariance F Q F of a
        run's numbers changes by 2 q_k q_k' when the logarithm of spread k does.
        """
        at = self._at(sd)
        inverse = np.linalg.inv(at.left)
        columns = at.half.swapaxes(1, 2)
        across, told = columns @ self.cross[:, at.own], columns @ self.scores[:, at.own, None]
        known = np.einsum("rkm,rkm->rk", across @ inverse, across)
        off = told[:, :, 0] - across @ (inverse @ at.pull)
        slope = np.zeros(len(sd))
        slope[at.own] = 2.0 * np.sum(1.0 - at.kept - off**2 - known, axis=0)
        return slope

    def predicted(self, sd: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Best predictions (R, K) of the runs' own numbers, and their standard errors (R, K)."""
        at = self._at(sd)
        values, errors = np.zeros(self.scores.shape), np.zeros(self.scores.shape)
        covariance = np.linalg.inv(at.left)
        step = -covariance @ at.pull
        cross, scores = self.cross[:, at.own], self.scores[:, at.own]
        values[:, at.own] = -np.einsum("rij,rj->ri", at.posterior, scores + cross @ step)
        along = at.posterior @ cross
        variance = np.diagonal(at.posterior, axis1=1, axis2=2) + np.einsum(
            "rkm,rkm->rk", along @ covariance, along
        )
        errors[:, at.own] = np.sqrt(np.maximum(variance, 0.0))
        return values, errors

    def _at(self, sd: FloatArray) -> _Posterior:
        own = np.flatnonzero(sd)
        root = sd[own]
        cross, scores = self.cross[:, own], self.scores[:, own]
        whole = np.eye(len(own)) + root[:, None] * self.grams[:, own[:, None], own] * root
        inverse = np.linalg.inv(whole)
        half = root[:, None] * inverse
        posterior = half * root
        along = np.einsum("rij,rj->ri", posterior, scores)
        left = self.information - np.tensordot(cross, posterior @ cross, axes=((0, 1), (0, 1)))
        pull = self.gradient - np.tensordot(cross, along, axes=((0, 1), (0, 1)))
        score_norm = float(np.linalg.slogdet(whole)[1].sum() - np.sum(scores * along))
        kept = np.diagonal(inverse, axis1=1, axis2=2)
        return _Posterior(own, half, posterior, kept, left, pull, score_norm)


@dataclass(frozen=True, eq=False)
class _Posterior:
    """The runs' own numbers given the residuals, at k spreads that are not zero.

    Attributes:
        own: (k,) which spreads these are.
        half: (R, k, k) F Q, with Q = (I + F M'M F)^-1 and F the diagonal of the spreads.
        posterior: (R, k, k) covariance F Q F of the numbers.
        kept: (R, k) diagonal of Q.
        left: (n, n) information of the shared parameters, the numbers integrated out.
        pull: (n,) gradient by the shared parameters, likewise.
        score_norm: -2 log likelihood of the spreads, the shared parameters held.
    """

    own: IntArray
    half: FloatArray
    posterior: FloatArray
    kept: FloatArray
    left: FloatArray
    pull: FloatArray
    score_norm: float


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

    def spread(logs: FloatArray) -> FloatArray:
        trial = np.zeros(len(largest))
        trial[own] = np.exp(logs)
        return trial

    def value(logs: FloatArray) -> float:
        return _posterior(likelihood, spread(logs))

    def slope(logs: FloatArray) -> FloatArray:
        trial = spread(logs)
        return np.asarray((likelihood.slope(trial) + 2.0 * trial**2)[own])

    limits = [(float(np.log(SMALLEST)), float(np.log(largest[i]))) for i in own]
    found = minimize(
        value, np.log(np.maximum(begin[own], SMALLEST)), jac=slope, method="L-BFGS-B", bounds=limits
    )
    sd[own] = np.exp(found.x)
    sd[sd <= 2.0 * SMALLEST] = 0.0
    return sd, _posterior(likelihood, sd)


def _posterior(likelihood: Likelihood, sd: FloatArray) -> float:
    """-2 log of the density of spreads (K,) in usual ones, but for a constant."""
    return likelihood(sd) + float(sd @ sd)
