"""What each cause would change, seen through a refit of the baseline: before looking, and after.

All in the whitened prediction errors of the filter, where noise is white with unit variance. A
cause's signal is projected on what the baseline (under its priors) cannot follow; the rest decides
how detectable it is, how alike two causes are, and how much of the misfit it explains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc

from fish_env.diagnosis.causes import Cause, Probe, best_of_each, effect_values, finer, of_visible
from fish_env.diagnosis.tails import POWER, chi2_log_tail, noncentrality
from fish_env.effects.extended import PREFIX
from fish_env.identification.estimator import Fit
from fish_env.identification.information import (
    BLOCK_S,
    LONG_BLOCK_S,
    block_index,
    gradient,
    information,
    prior_precision,
    sums_over,
)
from fish_env.identification.problem import Problem
from fish_env.identification.products import inner
from fish_env.identification.side_by_side import side_by_side

FloatArray = npt.NDArray[np.float64]
DRAWS = 4000
LANES_AT_ONCE = 96
SETTINGS_AT_ONCE = LANES_AT_ONCE - 1
"""One lane is that of the fit itself."""


@dataclass(frozen=True, eq=False)
class Signal:
    """A cause at one of its alternatives.

    Attributes:
        cause: the cause.
        probe: index of the alternative (-1: a baseline coefficient).
        left: (D, m) change of the residuals for the settings probed, after a refit.
        energy: squared size of that change before the refit.
        projected: (m, m) information about the settings after a refit of the baseline.
        score: (m,) projected signal times residuals.
        inflation: factor by which coloured residuals widen the score, at least 1.
    """

    cause: Cause
    probe: int
    left: FloatArray
    energy: float
    projected: FloatArray
    score: FloatArray
    inflation: float

    @property
    def freedom(self) -> int:
        """Number of settings."""
        return len(self.score)

    @property
    def statistic(self) -> float:
        """Likelihood ratio of the linearised fit: chi-squared with ``freedom`` under no effect."""
        return float(self.score @ np.linalg.solve(self.projected, self.score)) / self.inflation

    @property
    def unwidened(self) -> float:
        """The statistic as if what is left were white: what is out of step all along is not."""
        return self.statistic * self.inflation

    @property
    def log_p(self) -> float:
        """Logarithm of the p-value of this one test: overwhelming evidence still ranks."""
        return float(chi2_log_tail(self.statistic, self.freedom))

    @cached_property
    def span(self) -> FloatArray:
        """(D, m) orthonormal, of what is left after a refit."""
        return np.asarray(np.linalg.qr(self.left)[0])

    @property
    def absorbed_share(self) -> float:
        """Share of the signal's energy that a refit of the baseline swallows."""
        return 1.0 - float(np.trace(self.projected)) / self.energy


@dataclass(frozen=True, eq=False)
class Screen:
    """All causes against one fit.

    Attributes:
        signals: every cause at every alternative.
        threshold: log p-value that the smallest one falls below by chance in ``level`` of data
            sets without an effect.
        level: family-wise error rate.
    """

    signals: tuple[Signal, ...]
    threshold: float
    level: float

    def best(self) -> list[Signal]:
        """The best alternative of each cause, most significant first."""
        return best_of_each(self.signals, lambda signal: signal.log_p)


class Projector:
    """Removes from signals what a refit of the free parameters of a fit would follow.

    A refit follows nothing across a bound that holds it back already: the tangent space is that
    of the bounds the fit is pressed against.
    """

    def __init__(self, fit: Fit) -> None:
        self.lin = fit.linearised
        slopes = self.lin.slopes
        baseline = fit.problem.baseline
        self.prior = prior_precision(baseline, slopes.shape[1] - len(baseline), fit.released)
        self.vector = np.concatenate([fit.point.z, np.zeros(slopes.shape[1] - len(baseline))])
        self.hessian = information(slopes, self.prior)
        self.factor = np.linalg.cholesky(self.hessian)
        self.held = fit.held
        self.blocks = [
            block_index(self.lin.run_of, self.lin.time_of, s) for s in (BLOCK_S, LONG_BLOCK_S)
        ]

    def coefficients(self, columns: FloatArray) -> FloatArray:
        """How a refit follows the columns: (n, m)."""
        return self.moved(inner(self.lin.slopes, columns), self.held)

    def moved(self, pull: FloatArray, held: FloatArray) -> FloatArray:
        """How far a pull (n, m) takes the free parameters, along bounds (k, n) that hold."""
        free = self._free(pull)
        if not len(held):
            return free
        across = self._free(held.T)
        return np.asarray(free - across @ np.linalg.solve(held @ across, held @ free))

    def let_go(self, i: int) -> tuple[float, float]:
        """Where one coefficient settles when no bound of its own holds it, and its variance."""
        own = np.array([np.flatnonzero(row)[-1] == i for row in self.held], bool)
        others = self.held[~own]
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
        self, cause: Cause, probe: int, columns: FloatArray, strain: bool = True
    ) -> Signal | None:
        """Project a cause; None where nothing of it is left, or the simulation diverges with it.

        Args:
            cause: the cause.
            probe: index of the alternative.
            columns: (D, m) change of the residuals.
            strain: whether what pulled the coefficients from their priors counts as evidence, as
                it does for a cause that would let them return.
        """
        if not np.isfinite(columns).all():
            return None
        followed = self.coefficients(columns)
        left = columns - self.lin.slopes @ followed
        projected = inner(left, left) + followed.T @ (self.prior[:, None] * followed)
        energy = np.einsum("ij,ij->j", columns, columns)
        if np.any(np.diag(projected) < 1e-4) or np.any(energy < 1e-3):
            return None
        projected += 1e-9 * np.diag(np.diag(projected))
        score = -left.T @ self.lin.residuals
        if strain:
            score += followed.T @ (self.prior * self.vector)
        step = np.linalg.solve(projected, score)
        remaining = self.lin.residuals + left @ step
        inflation = self.inflation(left, remaining)
        return Signal(cause, probe, left, float(energy.sum()), projected, score, inflation)

    def inflation(self, left: FloatArray, residuals: FloatArray) -> float:
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


def screen(
    fit: Fit, causes: Sequence[Cause], rng: np.random.Generator, level: float = 0.05
) -> Screen:
    """Test every cause against a fit.

    Args:
        fit: baseline, perhaps with effects already in it.
        causes: what to test; causes already in the fit are left out.
        rng: for the null distribution of the smallest p-value.
        level: family-wise error rate.
    """
    fit = fit.extrapolated
    projector = Projector(fit)
    taken = {*fit.effects, *fit.released}
    tested = [c for c in causes if c.name not in taken and c.path not in taken]
    signals = [
        *_effect_signals(fit, projector, tested),
        *_coefficient_signals(projector, tested, fit),
    ]
    return Screen(tuple(signals), null_threshold(signals, rng, level), level)


def zoomed(fit: Fit, signal: Signal) -> Signal:
    """The best signal around one of an oscillation; any other signal as it is."""
    problem, cause = fit.problem, signal.cause
    length = max(run.duration for run in problem.runs)
    around = finer(problem.known[cause.name], cause.probes[signal.probe][0], length)
    if not around:
        return signal
    close = Cause(cause.name, around)
    return min((signal, *_effect_signals(fit, Projector(fit), [close])), key=lambda s: s.log_p)


def _effect_signals(fit: Fit, projector: Projector, causes: Sequence[Cause]) -> list[Signal]:
    jobs = [
        (cause, index, probe)
        for cause in causes
        if cause.is_effect
        for index, alternative in enumerate(cause.probes)
        for probe in alternative
    ]
    start = np.repeat(fit.point.z[:, None], len(jobs), axis=1)
    columns = residual_changes(fit, [(cause.name, probe) for cause, _, probe in jobs], start)
    alternatives: dict[tuple[str, int], list[int]] = {}
    for i, (cause, index, _) in enumerate(jobs):
        alternatives.setdefault((cause.name, index), []).append(i)

    def projected(chosen: list[int]) -> Signal | None:
        cause, index, _ = jobs[chosen[0]]
        return of_visible(projector.signal, cause, index, columns[:, chosen])

    found = side_by_side(partial(projected, chosen) for chosen in alternatives.values())
    return [signal for signal in found if signal is not None]


def residual_changes(fit: Fit, jobs: Sequence[tuple[str, Probe]], z: FloatArray) -> FloatArray:
    """Change of the residuals (D, n) with each setting of an effect.

    Args:
        fit: what the change is from.
        jobs: effect and setting, n of them.
        z: (coefficients, n) where to simulate each.
    """
    rows = _changes_of_kinds(fit, fit.comparing, jobs, z)
    diverged = np.flatnonzero(~np.isfinite(rows).all(axis=1)).tolist()
    if diverged and fit.comparing is not fit.problem:
        again = [jobs[i] for i in diverged]
        rows[diverged] = _changes_of_kinds(fit, fit.problem, again, z[:, diverged])
    return rows.T


def _changes_of_kinds(
    fit: Fit, problem: Problem, jobs: Sequence[tuple[str, Probe]], z: FloatArray
) -> FloatArray:
    """The changes (n, D) of all jobs, each computed by the quickest kernel that can."""
    rows = np.empty((len(jobs), len(fit.linearised.residuals)))
    for alike in _kinds(fit, jobs):
        for first in range(0, len(alike), SETTINGS_AT_ONCE):
            part = alike[first : first + SETTINGS_AT_ONCE]
            rows[part] = _changes_at_once(fit, problem, [jobs[i] for i in part], z[:, part])
    return rows


def _kinds(fit: Fit, jobs: Sequence[tuple[str, Probe]]) -> list[list[int]]:
    """Jobs that one kernel computes, so that none pays for effects of another kind.

    A few jobs stay together: kernels take whole blocks of lanes, however few are filled.
    """
    if len(jobs) <= SETTINGS_AT_ONCE:
        return [list(range(len(jobs)))]
    kinds: dict[frozenset[str], list[int]] = {}
    for i, (name, _) in enumerate(jobs):
        stages = fit.problem.stages_for([*fit.point.effects, f"{PREFIX}{name}"])
        kinds.setdefault(stages, []).append(i)
    return list(kinds.values())


def _changes_at_once(
    fit: Fit, problem: Problem, jobs: Sequence[tuple[str, Probe]], z: FloatArray
) -> FloatArray:
    base = {**problem.neutral(dict.fromkeys(name for name, _ in jobs)), **fit.point.effects}
    values = [base, *(effect_values(problem, name, probe) for name, probe in jobs)]
    lanes = {path: np.array([own.get(path, base[path]) for own in values]) for path in base}
    start = np.column_stack([fit.point.z, z])
    out = problem.innovations(start, lanes, fit.noise, fit.filtered)
    return np.asarray(out[1:] - out[0])


def _coefficient_signals(projector: Projector, causes: Sequence[Cause], fit: Fit) -> list[Signal]:
    """Lifting the prior of one baseline coefficient.

    Under the prior the posterior mean of z has variance 1 - s^2 (s^2: its posterior variance), so
    z^2 / (1 - s^2) is chi-squared with one degree of freedom when the prior holds. A coefficient
    that a bound holds counts with where it would go.
    """
    signals = []
    for cause in causes:
        if cause.is_effect:
            continue
        i = fit.problem.baseline.paths.index(cause.path or "")
        at, variance = projector.let_go(i)
        left = 1.0 - variance
        if left < 0.05:
            continue
        column = projector.lin.slopes[:, [i]]
        score = np.array([at])
        energy = float((column**2).sum())
        signals.append(Signal(cause, -1, column, energy, np.array([[left]]), score, 1.0))
    return signals


def null_threshold(signals: Sequence[Signal], rng: np.random.Generator, level: float) -> float:
    """Log p-value below which the smallest of all falls by chance with probability ``level``.

    Draws scores of all causes jointly as white noise would make them; signals that are alike move
    together, so this is less strict than Bonferroni's bound.
    """
    effects = [s for s in signals if s.probe >= 0]
    smallest = np.zeros(DRAWS)
    largest: dict[int, FloatArray] = {}  # statistic of as many degrees of freedom
    if effects:
        stacked = np.concatenate([s.left for s in effects], axis=1)
        gram = inner(stacked, stacked)
        scale = np.sqrt(np.diag(gram))
        correlation = gram / np.outer(scale, scale)
        values, vectors = np.linalg.eigh(correlation)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = root @ rng.standard_normal((len(scale), DRAWS))
        at = 0
        for s in effects:
            part = slice(at, at + s.freedom)
            block = correlation[part, part] + 1e-9 * np.eye(s.freedom)
            white = np.linalg.solve(np.linalg.cholesky(block), draws[part])
            statistic = np.einsum("ij,ij->j", white, white)
            largest[s.freedom] = np.maximum(largest.get(s.freedom, 0.0), statistic)
            at += s.freedom
    for freedom, statistic in largest.items():
        smallest = np.minimum(smallest, np.log(chdtrc(freedom, statistic)))
    coefficients = sum(s.probe < 0 for s in signals)
    if coefficients:
        uniform = rng.random(DRAWS)
        smallest = np.minimum(smallest, np.log1p(-((1 - uniform) ** (1.0 / coefficients))))
    return float(np.quantile(smallest, level))


def smallest_detectable(
    signal: Signal, setting: int, threshold: float, power: float = POWER
) -> float:
    """Multiple of one probed setting that would be found with this power.

    The statistic is then noncentral chi-squared with as many degrees of freedom as settings; its
    noncentrality is the multiple squared times the projected information.
    """
    target = noncentrality(threshold, signal.freedom, power)
    information = float(signal.projected[setting, setting]) / signal.inflation
    return float(np.sqrt(target / max(information, 1e-12)))


def confusability(a: Signal, b: Signal) -> float:
    """Largest cosine between what two causes leave after a refit of the baseline (0 to 1)."""
    cosines = np.linalg.svd(a.span.T @ b.span, compute_uv=False)
    return float(cosines[0])
