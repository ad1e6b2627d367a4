"""What runs share of their own numbers: an effect, or nothing.

Where runs differ in everything, each has its own errors of every sensor from the first fit on. But
a sensor that is misaligned is so in all runs alike. Six runs that each have the same error of their
own have less evidence than one error that all share. Once causes are found, numbers that all runs
share become an effect, and numbers that no run needs are removed. The remaining ones absorb less of
the causes that are still hidden. Both are judged by the evidence: the numbers are random effects,
whose spread counts in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.elimination import insignificant
from fish_env.inference.estimate.again import own_likelihoods, search_steps
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.estimate.free import spread_of
from fish_env.inference.estimate.run_variation import CommonEffect
from fish_env.inference.estimate.spread import WIDE
from fish_env.inference.explanation import Explanation, reached
from fish_env.inference.hypotheses import EffectName, EffectParameterId, listed
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report


def with_common_errors(current: Explanation, threshold: float, report: Report) -> Explanation:
    """The explanation with what its runs share as effects, and without numbers that none needs.

    Itself where that is no better.

    Args:
        current: causes with their fit.
        threshold: log p-value that each further effect has to pass.
        report: told what is being done.
    """
    own = current.fit
    if not spread_of(own.problem, own.noise).any():
        return current
    numbers = Numbers(own)
    idle = numbers.unneeded()
    shared = numbers.in_common()[: POLICY.most_causes - len(current.causes)]
    while shared or idle:
        names = [EffectName(one.effect) for one in shared]
        report(f"fitting {listed(names)}, which runs share" if names else "fitting fewer numbers")
        fitted = reached(partial(_refitted, own, shared, idle))
        if fitted is None:
            return current
        found = Explanation((*current.causes, *names), fitted)
        weak = insignificant(fitted, names, threshold)
        if not weak:
            return found if found.score < current.score else current
        shared = [one for one in shared if one.effect not in weak]
    return current


class Numbers:
    """The numbers of runs that a fit has, in its linear model.

    Args:
        own: the fit.
    """

    def __init__(self, own: Fit) -> None:
        self.own, self.problem = own, own.problem
        self._sizes = np.array([variation.usual for variation in self.problem.variations])
        self.spread: FloatArray = spread_of(self.problem, own.noise) / self._sizes
        self._likelihoods = own_likelihoods(own)
        self._usual = self._likelihoods(np.zeros((len(self.spread), 0)))
        self._apart = self._usual(self.spread)

    def in_common(self) -> list[CommonEffect]:
        """Effects that are likelier than numbers of runs, and than nothing, the clearest first.

        No two of them are for the same number: the likelier one is.
        """
        effects = self.problem.common_effects
        found: list[tuple[float, int]] = []
        for i, one in enumerate(effects):
            at, begin = begun(self.problem, one)
            # What moves one number alone is the effect of that number.
            fewest = 2 if one.rates else 1
            few = np.count_nonzero(self.spread[at]) < fewest
            if one.effect in self.own.effects or few or begin is None:
                continue
            fewer = _without(self.spread, _gone(self.problem, one, at))
            common = self._along(one, at)
            alike = self._likelihoods(common)(fewer) - common.shape[1] * float(np.log(WIDE))
            otherwise = min(self._apart, self._usual(fewer))
            if alike < otherwise - POLICY.evidence_doubt:
                found.append((alike, i))
        chosen: list[CommonEffect] = []
        for _, i in sorted(found):
            if not any({*effects[i].numbers} & {*one.numbers} for one in chosen):
                chosen.append(effects[i])
        return chosen

    def _along(self, one: CommonEffect, at: Sequence[int]) -> FloatArray:
        """(K, m) what runs have in common by an effect, in usual spreads of the numbers ``at``."""
        each = np.eye(len(self.spread))[:, at]
        if not one.rates:
            return each
        rates = np.array(one.rates) / self._sizes[at]
        return np.asarray(each @ (rates / np.abs(rates).max())[:, None])

    def unneeded(self) -> list[int]:
        """Numbers that the data are likelier without, of those that runs may share.

        What only single runs can have, as their trim, stays.
        """
        sd, best, gone = self.spread, self._apart, list[int]()
        may_go = [i for i in np.flatnonzero(sd).tolist() if self.problem.variations[i].shared]
        while may_go:
            value, i = min((self._usual(_without(sd, [i])), i) for i in may_go)
            if value >= best:
                break
            best, sd = value, _without(sd, [i])
            gone.append(i)
            may_go.remove(i)
        return gone


def _without(sd: FloatArray, which: Sequence[int]) -> FloatArray:
    fewer = sd.copy()
    fewer[list(which)] = 0.0
    return fewer


def _gone(problem: Problem, one: CommonEffect, at: Sequence[int]) -> list[int]:
    """Numbers that an effect leaves nothing of in any run."""
    return [] if one.rates else [k for k in at if problem.variations[k].shared]


def _in_all(one: CommonEffect, numbers: FloatArray) -> FloatArray:
    """(m,) what runs share by an effect of the numbers (R, m) that it moves; the first tells."""
    means = numbers.mean(axis=0)
    return means[0] / one.rates[0] * np.array(one.rates) if one.rates else np.asarray(means)


def begun(
    problem: Problem, one: CommonEffect
) -> tuple[list[int], dict[EffectParameterId, float] | None]:
    """Which numbers runs share by an effect, and where it begins; None where it does not do that.

    Args:
        problem: the runs with their numbers.
        one: the effect.
    """
    names = [variation.name for variation in problem.variations]
    means = problem.variation.mean(axis=0)
    at, beside = ([names.index(name) for name in own] for own in (one.numbers, one.beside))
    values = one.values(means[[*at, *beside]].tolist())
    if values is None:
        return at, None
    given = {EffectParameterId(one.effect, name): value for name, value in values.items()}
    return at, {**problem.neutral([one.effect]), **given}


def _refitted(own: Fit, shared: Sequence[CommonEffect], idle: Sequence[int]) -> Fit:
    """The fit with effects in place of numbers that runs share, and without those of no use.

    Raises:
        LinAlgError: the simulation diverges.
    """
    problem = own.problem
    numbers, spread = problem.variation.copy(), spread_of(problem, own.noise).copy()
    gone, values = list(idle), dict(own.point.effects)
    for one in shared:
        at, begin = begun(problem, one)
        gone += _gone(problem, one, at)
        numbers[:, at] -= _in_all(one, numbers[:, at])
        values |= begin or {}
    numbers[:, gone] = 0.0
    spread[gone] = 0.0
    point, noise = Point(own.point.z, values), replace(own.noise, spread=spread)
    fewer = problem.with_variation(numbers, point, noise)
    effects = (*own.effects, *(one.effect for one in shared))
    steps = search_steps(problem)
    return fit(fewer, effects, point, noise, own.released, rounds=2, iterations=steps)
