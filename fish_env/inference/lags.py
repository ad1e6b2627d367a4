"""Effects that make a drive late: which of those that look alike it is.

Of short lags the kind hardly shows. In the long steps of a search the right one may not even be
possible, as no step follows it, and another one stands in for it. So the question is asked again
in the steps of published estimates; and beside something unknown, where fits tell kinds of lags
apart no better than by what they make up for, none is named.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fish_env.inference.estimate.again import finished
from fish_env.inference.estimate.coarse_fit import CoarseFit, CoarseFitter
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import (
    CauseId,
    EffectName,
    listed,
    name_of,
    of_effects,
)
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.inference.projection import Signal
from fish_env.inference.rivals import rivals_of
from fish_env.inference.screening import Screen
from fish_env.inference.search import at_noise
from fish_env.inference.starts import probed
from fish_env.inference.substitution import swapped, what_may_lack

Report = Callable[[str], None]


def look_alikes(current: Explanation) -> list[tuple[EffectName, EffectName]]:
    """What makes a drive late, each with what else may: short lags differ little but in name.

    The linear model is of no help. It begins from sizes at which the one follows another course
    than the other.
    """
    problem = current.fit.problem
    late = [name for name in problem.hidden_by_drive if name in current.causes]
    others = [name for name in problem.hidden_by_drive if name not in current.causes]
    return [(c, n) for c in late for n in others if n in problem.known[c].confusable_with]


def asked_again(
    current: Explanation, shown: Screen, report: Report
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The explanation with the lag that fits best in its steps, and one that is as good.

    Each lag that looks like one of its causes takes its place in a fit of a few steps to a few
    runs: where runs differ in all they have, a coarse fit, which holds that, tells too little.

    One that was found in long steps and diverges in those of published estimates leaves its place
    to any that does not.

    Args:
        current: causes with their fit, in the steps of published estimates if it has one in them.
        shown: causes that are not among them.
        report: told what is being done.
    """
    closest = _closest(current, shown, report)
    if closest is None:
        return current, ()
    report(f"fitting {listed(closest.causes, ' and ')}")
    own = current.fit
    whole = at_noise(own.problem.with_refinement(), closest.fit, own.noise, POLICY.swap_steps)
    if whole is None:
        return current, ()
    other = Explanation(closest.causes, whole)
    if own.problem.is_coarse(own.point.effects):
        return Explanation(other.causes, finished(whole)), ()
    best, last = sorted((current, other), key=lambda e: e.score)
    if best is other:
        best = Explanation(best.causes, finished(whole))
    return best, rivals_of(best, [last])


def _closest(current: Explanation, shown: Screen, report: Report) -> Explanation | None:
    """The best explanation of a few runs with another lag; None where none fits them as well."""
    own = current.fit
    few, pairs = own.problem.with_refinement().subset(POLICY.few_runs), _pairs(current, shown)
    usual = at_noise(few, own, own.noise, POLICY.swap_steps) if pairs else None
    best, enough = None, usual.objective + POLICY.evidence_doubt if usual else np.inf
    for cause, signal in pairs:
        report(f"trying {signal.cause.effect} instead of {name_of(cause)}")
        found = at_noise(few, _in_place(own, cause, signal), own.noise, POLICY.swap_steps, enough)
        if found is not None and found.objective < enough:
            causes = tuple(signal.cause.id if c == cause else c for c in current.causes)
            best, enough = Explanation(causes, found), found.objective
    return best


def _in_place(own: Fit, cause: CauseId, signal: Signal) -> CoarseFit:
    """Where a fit begins that has another lag, at its mildest, in the place of a cause."""
    (mildest, *_) = probed(own.problem, signal)
    kept = of_effects(own.point.effects, {*own.effects} - {cause})
    effects = tuple(signal.cause.effect if e == cause else e for e in own.effects)
    return CoarseFit(effects, own.released, Point(own.point.z, {**kept, **mildest}), np.inf)


def undecided(current: Explanation, shown: Screen, report: Report) -> frozenset[CauseId]:
    """Lags in whose place one that looks alike explains nearly as much, beside something unknown.

    Args:
        current: causes with their fit.
        shown: causes that are not among them.
        report: told what is dropped and why.
    """
    own, found = current.fit, set[CauseId]()
    fitter = CoarseFitter(own)
    for cause, signal in _pairs(current, shown):
        if cause in found:
            continue
        enough = fitter.base + what_may_lack(fitter, cause)
        coarse = swapped(fitter, own, cause, signal, enough)
        if coarse is not None and coarse.objective < enough:
            other = signal.cause.effect
            report(f"rejecting {name_of(cause)}: {other} explains nearly as much in its place")
            found.add(cause)
    return frozenset(found)


def _pairs(current: Explanation, shown: Screen) -> list[tuple[CauseId, Signal]]:
    """Lags with what may be in their place."""
    signals = shown.by_effect()
    return [(c, signals[n]) for c, n in look_alikes(current) if n in signals]
