"""How much runs differ: spreads of random effects by restricted likelihood, one after another.

Source: Patterson and Thompson (1971), Biometrika 58, 545; see ``run_variation`` for the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.inference.estimate.products import inner
from fish_env.inference.estimate.run_variation import RunVariation
from fish_env.inference.policy import POLICY

SMALLEST = 1e-3
"""Spread, in units of the usual one, that counts as none."""
SIZES = np.geomspace(0.1, 10.0, 7)
"""Spreads that are tried before one is looked for exactly, in units of the usual one."""
WIDE = 0.01
"""Precision of what all runs have in common, in usual spreads: hardly any."""


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
        common: (K, m) what all runs have in common, each column a parameter of its own, which no
            spread has to explain; in usual spreads of the numbers that it moves.
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
        common: FloatArray,
    ) -> None:
        shifted = residuals - np.einsum("dk,dk->d", own, at[run_of])
        edges = np.searchsorted(run_of, np.arange(len(at) + 1))
        slices = [slice(a, b) for a, b in pairwise(edges.tolist())]
        self.grams = np.array([own[s].T @ own[s] for s in slices])
        cross = np.array([own[s].T @ slopes[s] for s in slices])
        self.cross = np.concatenate([cross, self.grams @ common], axis=2)
        self.scores = np.array([own[s].T @ shifted[s] for s in slices])
        mixed = common.T @ cross.sum(axis=0)
        both = common.T @ self.grams.sum(axis=0) @ common + WIDE * np.eye(common.shape[1])
        self.information = np.block([[information, mixed.T], [mixed, both]])
        pulls = inner(slopes, shifted[:, None])[:, 0] + pull
        self.gradient = np.r_[pulls, common.T @ self.scores.sum(axis=0)]

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
    What cannot be negative is left out where it would be: something else is then meant. What runs
    share is a cause where it is far beyond the usual: the spread is then no larger than runs differ
    by, or than is usual, and what that leaves shows.

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
    limited = _without_causes(likelihood.predicted(sd)[0], variations, largest)
    if np.any(sd > limited):
        sd, best = _largest(likelihood, limited, active, np.minimum(sd, limited))
    values, errors = likelihood.predicted(sd)
    return Spread(sd * usual, none - best, values * usual, errors * usual)


def _without_causes(
    values: FloatArray, variations: Sequence[RunVariation], largest: FloatArray
) -> FloatArray:
    """(K,) largest spreads where what runs share is left to causes.

    Args:
        values: (R, K) predictions, in usual spreads.
        variations: what the runs may differ in.
        largest: (K,) largest spreads otherwise.
    """
    shared = np.array([variation.shared for variation in variations], bool)
    cause = shared & (np.abs(values.mean(axis=0)) > POLICY.beyond_usual)
    return np.where(cause, np.clip(values.std(axis=0), 1.0, largest), largest)


def _negative(values: FloatArray, errors: FloatArray) -> BoolArray:
    """(K,) whether the runs' own numbers (R, K) are negative on the whole."""
    surely = POLICY.surely_negative_sd * errors.mean(axis=0)
    return np.asarray(values.mean(axis=0) < -surely)


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
