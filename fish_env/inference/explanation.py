"""A fit with some causes in it, and what speaks for it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.adequacy import disturbance_at_limit
from fish_env.inference.effects import EffectParameter
from fish_env.inference.estimate.again import taken_on, with_run_variation
from fish_env.inference.estimate.coarse_fit import CoarseFit
from fish_env.inference.estimate.fit import FEWER_STEPS, Fit, fit
from fish_env.inference.estimate.information import information, prior_precision
from fish_env.inference.hypotheses import CauseId, EffectName, EffectParameterId
from fish_env.inference.in_place import begun_without
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem
from fish_env.inference.small_errors import SmallErrors

T = TypeVar("T")
LEAST_PRECISION = 1e-12
"""Of what does nothing, where nothing was known of it."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """A fit with some causes in it.

    Attributes:
        causes: in the order they were added.
        fit: the fit.
    """

    causes: tuple[CauseId, ...]
    fit: Fit

    @cached_property
    def with_relaxed_noise(self) -> Fit | None:
        """The fit on a few runs under relaxed noise: a periodic drive's phase is a random walk.

        A drive a little quicker or slower than commanded is soon out of step, and every slope along
        the simulation is then wrong. With a random-walk phase the filter follows the drive, and
        what changes its frequency shows. What only shifts the phase, as a delay does, is hidden
        instead. None where the problem has no such noise, or the simulation diverges.
        """
        own = self.fit
        noise = own.problem.relaxed_noise(own.noise)
        if noise is None:
            return None
        return fitted_again(own.problem.subset(POLICY.few_runs), own, noise)

    def varied(self, beside_misfit: bool = False, dropped: Collection[CauseId] = ()) -> Explanation:
        """The same causes with what the runs differ in, as it shows now that more is explained.

        Where the disturbance stays at its limit nevertheless, what the runs seem to differ in may
        stand in for a cause that is missing: the explanation then is as it was.

        Args:
            beside_misfit: keep the variation also where something else is missing.
            dropped: effects that are no longer among the causes.
        """
        if dropped:
            own = self.fit
            found = reached(lambda: with_run_variation(own, *begun_without(own, dropped, True)))
            if found is None:
                return self
            return Explanation(tuple(c for c in self.causes if c not in dropped), found)
        found = self._varied
        stands_in = found is None or disturbance_at_limit(found)
        if found is None or found is self.fit or (stands_in and not beside_misfit):
            return self
        return Explanation(self.causes, found)

    def varied_to_the_end(self) -> Explanation:
        """With what the runs differ in also beside a misfit, again while that tells much more.

        What runs differ in and what they share settle in turns.
        """
        best = self
        for _ in range(POLICY.most_variation_turns):
            more = best.varied(beside_misfit=True)
            if more.score > best.score - POLICY.evidence_doubt:
                break
            best = more
        return best

    @cached_property
    def _varied(self) -> Fit | None:
        """The fit with what the runs differ in; None where the simulation diverges.

        The fit itself where that is worse: the linear model which tells the spreads was then wrong.
        """
        found = reached(partial(with_run_variation, self.fit))
        if found is None or found is self.fit:
            return found
        worse = Explanation(self.causes, found).score > self.score + POLICY.evidence_doubt
        return self.fit if worse else found

    def causes_with(self, other: CauseId, cause: CauseId) -> tuple[CauseId, ...]:
        """The causes with another one in the place of one of them."""
        return tuple(other if c == cause else c for c in self.causes)

    @cached_property
    def score(self) -> float:
        """-2 log evidence (Laplace's approximation), but for a constant of the problem.

        The misfit and the prior at the best fit, and what it costs that the data narrowed each
        parameter so far from what was known: an effect may be anywhere in its plausible range, a
        coefficient whose prior is lifted within ``prior_reach_sd`` deviations. Source: Kass and
        Raftery (1995), "Bayes factors", JASA 90, eq. 3; differences of 6 they call strong.
        """
        own, (known, _) = self.fit, self._informed
        lifted = [own.problem.baseline.ids.index(one) for one in own.released]
        penalty = known[lifted] @ own.point.z[lifted] ** 2
        return float(own.objective + penalty + self._narrowed(np.arange(len(known))))

    @cached_property
    def small_errors(self) -> SmallErrors:
        """All other effects, acting a little."""
        return SmallErrors.of(self.fit)

    def narrowed_by(self, dropped: Collection[CauseId]) -> float:
        """What the score would lose without some causes, were estimates and misfit the same.

        Args:
            dropped: the causes; one that is a coefficient stays a parameter.
        """
        ids = self.fit.ids
        stays = [not (isinstance(id, EffectParameterId) and id.effect in dropped) for id in ids]
        return self._narrowed(np.arange(len(ids))) - self._narrowed(np.flatnonzero(stays))

    @cached_property
    def _informed(self) -> tuple[FloatArray, FloatArray]:
        """Precision of the free parameters before the data (n,), and information with it (n, n)."""
        known = known_before(self)
        return known, information(self.fit.linearised.slopes, known)

    def _narrowed(self, which: IntArray) -> float:
        """By how much the data narrowed some free parameters (k,), in -2 log evidence.

        The others are taken to be known.
        """
        known, informed = self._informed
        after = np.linalg.slogdet(informed[np.ix_(which, which)])[1]
        return float(after - np.log(known[which]).sum())


def known_before(explanation: Explanation) -> FloatArray:
    """Precision of what was known of each free parameter before the data (n,).

    Any plausible value of an effect's parameter is as likely; a coefficient whose prior is lifted
    may lie ``prior_reach_sd`` times as far from its nominal value as one whose prior is not.
    """
    own = explanation.fit
    problem = own.problem
    further = [
        _plausible_precision(p, own.point.effects[EffectParameterId(EffectName(name), p.name)])
        for name in own.effects
        for p in problem.known[name].parameters
    ]
    known = prior_precision(problem.baseline, len(further), ())
    known[[problem.baseline.ids.index(one) for one in own.released]] = POLICY.prior_reach_sd**-2
    known[len(problem.baseline) :] = further
    return known


def _plausible_precision(parameter: EffectParameter, value: float) -> float:
    """Precision of what was known of an effect's parameter, near a value.

    What is off at infinity acts by its inverse, and any plausible inverse is as likely. In units of
    the parameter that is the less precise, the closer it is to doing nothing.
    """
    low, high = parameter.plausible
    if np.isfinite(parameter.neutral):
        return float(12.0 / (high - low) ** 2)
    inverse = 12.0 / (1.0 / low - 1.0 / high) ** 2
    return float(max(inverse / value**4, LEAST_PRECISION))


def exchanged(before: Explanation, after: Explanation) -> list[tuple[CauseId, CauseId]]:
    """Causes of an explanation that another one lacks, each with what has its place there."""
    return [(a, b) for a, b in zip(before.causes, after.causes, strict=False) if a != b]


def swap_between(before: Explanation, after: Explanation) -> tuple[CauseId, CauseId] | None:
    """The cause and what has its place, if two explanations differ in one of their causes."""
    if len(before.causes) != len(after.causes):
        return None
    swaps = exchanged(before, after)
    return swaps[0] if len(swaps) == 1 else None


def reached(make: Callable[[], T]) -> T | None:
    """A fit; None where the simulation diverges before it can begin."""
    try:
        return make()
    except np.linalg.LinAlgError:
        return None


def in_steps_of(problem: Problem, current: Explanation) -> Explanation:
    """An explanation as fits with other effects are made: in the steps of their problem.

    Longer ones may cost more than many a cause gains.

    Args:
        problem: that of the other fits.
        current: the explanation.
    """
    own = current.fit
    if own.problem.longest_step == problem.longest_step or own.looks_alike(problem):
        return current
    start = (own.effects, own.point, own.noise, own.released)
    again = reached(lambda: fit(problem, *start, rounds=2, iterations=FEWER_STEPS))
    return current if again is None else Explanation(current.causes, again)


def fitted_again(problem: Problem, at: CoarseFit | Fit, noise: Any, rounds: int = 2) -> Fit | None:
    """As :func:`taken_on`; None where the simulation diverges."""
    return reached(partial(taken_on, problem, at, noise, rounds))


def on_few_runs(
    problem: Problem, effects: Sequence[EffectName], begin: Sequence[Point], noise: Any
) -> Fit | None:
    """The best fit to a few of the runs from some points; None where each diverges."""
    few = problem.subset(POLICY.few_runs)
    tried = [reached(partial(fit, few, effects, point, noise, rounds=1)) for point in begin]
    return min((f for f in tried if f), key=lambda f: f.objective, default=None)
