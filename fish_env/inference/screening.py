"""Every cause against a fit: how significant each is, and what chance would make of the best."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.around import finer, nearer
from fish_env.inference.changes import SETTINGS_AT_ONCE, kinds, residual_changes
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.products import gram, inner
from fish_env.inference.hypotheses import CauseId, Coefficient
from fish_env.inference.oscillations import in_each_run, with_columns
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import (
    Cause,
    Probe,
    best_of_each,
    farthest,
    of_visible,
)
from fish_env.inference.problem import Problem
from fish_env.inference.projection import Projector, Signal, in_parts, orthonormal
from fish_env.inference.tails import chi2_log_tail, noncentrality

CLOSER = (0.25, 0.12, 0.06)
"""Shares of a shape's plausible range by which it is moved, one after another."""


@dataclass(frozen=True, eq=False)
class Screen:
    """All causes against one fit.

    Attributes:
        signals: every cause at every alternative.
        threshold: log p-value that the smallest one falls below by chance in ``level`` of data
            sets without an effect.
        level: family-wise error rate.
        products: (m, m) inner products of what the settings of all effects change, after a refit;
            settings in the order of the signals.
    """

    signals: tuple[Signal, ...]
    threshold: float
    level: float
    products: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    def without_changes(self) -> Screen:
        """The same tests without what each cause changes, which takes nearly all memory."""
        signals = tuple(replace(signal, left=signal.left[:0].copy()) for signal in self.signals)
        return replace(self, signals=signals)

    def columns(self) -> list[slice]:
        """Where each signal is among the settings of all effects; nowhere, for a coefficient."""
        ends = np.cumsum([_settings(signal) for signal in self.signals]).tolist()
        return [slice(a, b) for a, b in zip([0, *ends], ends, strict=False)]

    def only(self, kept: Callable[[Signal], bool]) -> Screen:
        """The tests of some signals."""
        chosen = np.array([kept(signal) for signal in self.signals], bool)
        at = np.repeat(chosen, [_settings(signal) for signal in self.signals])
        signals = tuple(s for s, keep in zip(self.signals, chosen, strict=True) if keep)
        return replace(self, signals=signals, products=self.products[np.ix_(at, at)])

    def best(self) -> list[Signal]:
        """The best alternative of each cause, most significant first."""
        return best_of_each(self.signals, lambda signal: signal.log_p)

    def by_effect(self) -> dict[CauseId, Signal]:
        """The best alternative of each effect."""
        return {signal.cause.id: signal for signal in self.best() if signal.cause.is_effect}


def _settings(signal: Signal) -> int:
    """Settings of an effect; none of a coefficient."""
    return signal.freedom if signal.probe >= 0 else 0


def screen(
    fit: Fit,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    level: float = POLICY.screen_level,
    keep_changes: bool = False,
) -> Screen:
    """Test every cause against a fit.

    Args:
        fit: baseline, perhaps with effects already in it.
        causes: what to test; causes already in the fit are left out.
        rng: for the null distribution of the smallest p-value.
        level: family-wise error rate.
        keep_changes: whether the signals keep what each cause changes, which takes much memory;
            their products are kept in any case.
    """
    projector = Projector(fit)
    taken: set[str | Coefficient] = {*fit.effects, *fit.released}
    tested = [c for c in causes if c.id not in taken]
    signals = [
        *_effect_signals(fit, projector, tested),
        *_coefficient_signals(projector, tested, fit),
    ]
    products = gram([s.left for s in signals if _settings(s)])
    threshold = null_threshold(signals, rng, level, fit.problem.noise_freedom(fit), products)
    found = Screen(tuple(signals), threshold, level, products)
    return found if keep_changes else found.without_changes()


def zoomed(fit: Fit, signal: Signal) -> Signal:
    """The best signal of the same effect with its shape, or frequency, a little different.

    A screen tries each shape at a few values. Between two of them a fit may lead anywhere.
    """
    problem, cause = fit.problem, signal.cause
    effect = problem.known[cause.effect]
    around = finer(effect, cause.probes[signal.probe][0], problem.longest_run)
    if around:
        return _best_of(fit, signal, around)
    for share in CLOSER:
        signal = _best_of(fit, signal, nearer(effect, signal.cause.probes[signal.probe], share))
    return signal


def _best_of(fit: Fit, signal: Signal, around: tuple[tuple[Probe, ...], ...]) -> Signal:
    if not around:
        return signal
    close = Cause(signal.cause.id, around)
    return min((signal, *_effect_signals(fit, Projector(fit), [close])), key=lambda s: s.log_p)


def _effect_signals(fit: Fit, projector: Projector, causes: Sequence[Cause]) -> list[Signal]:
    """Signals of all alternatives; of one that shows nothing, also at its farthest setting."""
    tests = [
        (cause, index) for cause in causes if cause.is_effect for index in range(len(cause.probes))
    ]
    found = _signals_of(fit, projector, tests)
    unseen = [test for test, signal in zip(tests, found, strict=True) if signal is None]
    further = _signals_of(fit, projector, _far_tests(fit.problem, unseen))
    known = [signal for signal in (*found, *further) if signal is not None]
    return [*known, *in_each_run(fit, projector, causes)]


def _far_tests(problem: Problem, tests: Sequence[tuple[Cause, int]]) -> list[tuple[Cause, int]]:
    """The alternatives with their settings at the ends of what is plausible, where they have one.

    Each is the last alternative of its cause.
    """
    far = []
    for cause, index in tests:
        effect = problem.known[cause.effect]
        ends = [farthest(effect, probe, problem.longest_step) for probe in cause.probes[index]]
        settings = tuple(end for end in ends if end is not None)
        if settings and settings not in cause.probes:
            further = replace(cause, probes=(*cause.probes, settings))
            far.append((further, len(cause.probes)))
    return far


def _signals_of(
    fit: Fit, projector: Projector, tests: Sequence[tuple[Cause, int]]
) -> list[Signal | None]:
    """Signals of alternatives; None of one that leaves nothing."""
    found: list[Signal | None] = [None] * len(tests)
    for part in _parts(fit, tests):
        seen = _signals_together(fit, projector, [tests[i] for i in part])
        for i, signal in zip(part, seen, strict=True):
            found[i] = signal
    return found


def _parts(fit: Fit, tests: Sequence[tuple[Cause, int]]) -> list[list[int]]:
    """Tests in parts of which each is evaluated at once: their residuals take memory."""
    count = [len(cause.probes[index]) for cause, index in tests]
    alike_ones = kinds(fit, [cause.effect for cause, _ in tests], sum(count))
    return [
        part
        for alike in alike_ones
        for part in in_parts(alike, lambda i: count[i], SETTINGS_AT_ONCE)
    ]


def _signals_together(
    fit: Fit, projector: Projector, tests: Sequence[tuple[Cause, int]]
) -> list[Signal | None]:
    """Signals of alternatives of causes; None where the simulation diverges with one."""
    jobs = [(cause.effect, probe) for cause, index in tests for probe in cause.probes[index]]
    columns = residual_changes(fit, jobs)
    own = with_columns(tests)
    found = projector.signals(own, columns.T)
    for i, (cause, index, mine) in enumerate(own):
        found[i] = found[i] or of_visible(projector.signal, cause, index, columns[:, list(mine)])
    return found


def _coefficient_signals(projector: Projector, causes: Sequence[Cause], fit: Fit) -> list[Signal]:
    """Lifting the prior of one baseline coefficient.

    Under the prior the posterior mean of z has variance 1 - s^2 (s^2: its posterior variance), so
    z^2 / (1 - s^2) is chi-squared with one degree of freedom when the prior holds. A coefficient
    that a bound holds counts with where it would go.
    """
    signals = []
    for cause in causes:
        if not isinstance(cause.id, Coefficient):
            continue
        i = fit.problem.baseline.ids.index(cause.id)
        at, variance = projector.without_own_bound(i)
        left = 1.0 - variance
        if left < POLICY.least_learned_share:
            continue
        column = projector.lin.slopes[:, [i]]
        score = np.array([at])
        energy = float((column**2).sum())
        kept = column.astype(np.float32)
        signals.append(Signal(cause, -1, kept, energy, np.array([[left]]), score, 1.0))
    return signals


def null_threshold(
    signals: Sequence[Signal],
    rng: np.random.Generator,
    level: float,
    freedom: float = np.inf,
    products: FloatArray | None = None,
) -> float:
    """Log p-value below which the smallest of all falls by chance with probability ``level``.

    Draws scores of all causes jointly as white noise would make them; signals that are alike move
    together, so this is less strict than Bonferroni's bound.

    Args:
        signals: tests that are made together.
        rng: for the draws.
        level: family-wise error rate.
        freedom: independent residuals that the size of the noise is estimated from.
        products: (m, m) of what the settings of all effects change, where they are known.
    """
    effects = [s for s in signals if _settings(s)]
    smallest = np.zeros(POLICY.null_draws)
    size = rng.chisquare(freedom, POLICY.null_draws) / freedom if np.isfinite(freedom) else 1.0
    largest: dict[int, FloatArray] = {}  # statistic of as many degrees of freedom
    if effects:
        products = gram([s.left for s in effects]) if products is None else products
        scale = np.sqrt(np.diag(products))
        correlation = products / np.outer(scale, scale)
        values, vectors = np.linalg.eigh(correlation)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = root @ rng.standard_normal((len(scale), POLICY.null_draws))
        at = 0
        for s in effects:
            part = slice(at, at + s.freedom)
            white = orthonormal(correlation[part, part]).T @ draws[part]
            statistic = np.einsum("ij,ij->j", white, white)
            largest[s.freedom] = np.maximum(largest.get(s.freedom, 0.0), statistic)
            at += s.freedom
    for settings, statistic in largest.items():
        smallest = np.minimum(smallest, chi2_log_tail(statistic / size, settings))
    coefficients = sum(s.probe < 0 for s in signals)
    if coefficients:
        uniform = rng.random(POLICY.null_draws)
        smallest = np.minimum(smallest, np.log1p(-((1 - uniform) ** (1.0 / coefficients))))
    return float(np.quantile(smallest, level))


def smallest_detectable(
    signal: Signal, setting: int, threshold: float, power: float = POLICY.power
) -> float:
    """Multiple of one probed setting that would be found with this power.

    The statistic is then noncentral chi-squared with as many degrees of freedom as settings; its
    noncentrality is the multiple squared times the projected information.
    """
    target = noncentrality(threshold, signal.freedom, power)
    information = float(signal.projected[setting, setting]) / signal.variance_inflation
    return float(np.sqrt(target / max(information, 1e-12)))


def confusability(a: Signal, b: Signal) -> float:
    """Largest cosine between what two causes leave after a refit of the baseline (0 to 1)."""
    shared = a.to_orthonormal.T @ inner(a.left, b.left) @ b.to_orthonormal
    cosines = np.linalg.svd(shared, compute_uv=False)
    return float(cosines[0])
