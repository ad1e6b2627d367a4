"""Which of effects that look alike it is: of those that make a drive late, or put it out of step.

Of short lags the kind hardly shows. In the long steps of a search the right one may not even be
possible, as no step follows it, and another one stands in for it. So the question is asked again
in the steps of published estimates; and beside something unknown, where fits tell kinds of lags
apart no better than by what they make up for, none is named.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fish_env.inference.estimate.again import finished
from fish_env.inference.estimate.coarse_fit import CoarseFit, CoarseFitter
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import (
    CauseId,
    EffectName,
    EffectParameterId,
    listed,
    name_of,
    of_effects,
)
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.inference.projection import Signal
from fish_env.inference.rivals import as_likely, rivals_of
from fish_env.inference.screening import Screen
from fish_env.inference.search import at_noise
from fish_env.inference.starts import probed
from fish_env.inference.substitution import swapped, what_may_lack, without

Report = Callable[[str], None]
Pair = tuple[EffectName, EffectName]
"""A cause, and what looks like it."""


def late(current: Explanation) -> list[Pair]:
    """What makes a drive late, each with what else may: short lags differ little but in name.

    The linear model is of no help. It begins from sizes at which the one follows another course
    than the other.
    """
    hidden = current.fit.problem.hidden_by_drive
    return pairs_alike(current, hidden, hidden)


def rates(current: Explanation) -> list[Pair]:
    """What makes a clock or a drive slow, each with what else may.

    A clock that is slow by half a percent differs from a drive that is by half a percent of all
    forces, which coefficients make up for. One that is slow by its load differs by as little.
    """
    problem = current.fit.problem
    drifting = [EffectName(name) for name, e in problem.known.items() if e.drifts_in_phase]
    names = tuple(dict.fromkeys((*problem.out_of_step, *drifting)))
    return pairs_alike(current, names, names)


def pairs_alike(
    current: Explanation, among: Sequence[EffectName], names: Sequence[EffectName]
) -> list[Pair]:
    """Causes among some effects, each with those of others that are known to look like it."""
    known = current.fit.problem.known
    causes = [name for name in among if name in current.causes]
    others = [name for name in names if name not in current.causes]
    return [(c, n) for c in causes for n in others if n in known[c].confusable_with]


def asked_again(
    current: Explanation, shown: Screen, report: Report
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The explanation with the look-alikes that fit best in its steps, and those as good.

    What looks like one of its causes takes its place in a fit of a few steps to a few runs: where
    runs differ in all they have, a coarse fit, which holds that, tells too little.

    A lag that was found in long steps and diverges in those of published estimates leaves its place
    to any that does not.

    Args:
        current: causes with their fit, in the steps of published estimates if it has one in them.
        shown: causes that are not among them.
        report: told what is being done.
    """
    current, rivals = _asked(current, _shown(late(current), shown), report)
    best, others = asked_of_rates(current, shown, report)
    return best, (*rivals, *others) if best is current else others


def asked_of_rates(
    current: Explanation, shown: Screen, report: Report
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """As :func:`asked_again`, of what makes a clock or a drive slow alone."""
    if current.fit.problem.is_coarse(current.fit.point.effects):
        return current, ()
    return _asked(current, _shown(rates(current), shown), report)


def _asked(
    current: Explanation, pairs: Sequence[tuple[CauseId, Signal]], report: Report
) -> tuple[Explanation, tuple[Explanation, ...]]:
    closest = _closest(current, pairs, report)
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


def _closest(
    current: Explanation, pairs: Sequence[tuple[CauseId, Signal]], report: Report
) -> Explanation | None:
    """The best explanation of a few runs with a look-alike; None where none fits them as well."""
    own = current.fit
    few = own.problem.with_refinement().subset(POLICY.few_runs)
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
    """Where a fit begins that has a look-alike in the place of a cause.

    As it was measured; else where the two have parameters of the same name, at the values of the
    cause; else at its mildest.
    """
    name, values, measured = signal.cause.effect, own.point.effects, own.problem.drive.in_step
    (first, *_) = probed(own.problem, signal)
    begin = {
        id: value if id in measured else values.get(EffectParameterId(str(cause), id.name), value)
        for id, value in first.items()
    }
    kept = of_effects(values, {*own.effects} - {cause})
    effects = tuple(name if e == cause else e for e in own.effects)
    return CoarseFit(effects, own.released, Point(own.point.z, {**kept, **begin}), np.inf)


def undecided(current: Explanation, shown: Screen, report: Report) -> frozenset[CauseId]:
    """Lags in whose place one that looks alike explains nearly as much, beside something unknown.

    Args:
        current: causes with their fit.
        shown: causes that are not among them.
        report: told what is dropped and why.
    """
    own, found = current.fit, set[CauseId]()
    fitter = CoarseFitter(own)
    for cause, signal in _shown(late(current), shown):
        if cause in found:
            continue
        enough = fitter.base + what_may_lack(fitter, cause)
        coarse = swapped(fitter, own, cause, signal, enough)
        if coarse is not None and coarse.objective < enough:
            other = signal.cause.effect
            report(f"rejecting {name_of(cause)}: {other} explains nearly as much in its place")
            found.add(cause)
    return frozenset(found)


def decided(found: Explanation, shown: Screen, report: Report) -> Explanation:
    """The explanation without what another effect does as well, beside something unknown.

    A verdict that leaves something unknown names no alternatives. That runs disagree on which is
    better says little there: what is unknown may act in some of them.

    Args:
        found: causes that act.
        shown: causes that are not among them.
        report: told what is being done.
    """
    found, rivals = asked_of_rates(found, shown, report)
    rivals = tuple(other for other in rivals if as_likely(found, other))
    doubtful = {*found.causes} - frozenset[CauseId]().union(*(e.causes for e in rivals))
    if not rivals:
        return found
    report(
        f"rejecting {listed(sorted(doubtful, key=name_of))}: others explain as much in its place"
    )
    return without(found, doubtful) or found


def _shown(pairs: Sequence[Pair], shown: Screen) -> list[tuple[CauseId, Signal]]:
    """The pairs with the signals of what may be in a cause's place, where it has one."""
    signals = shown.by_effect()
    return [(cause, signals[name]) for cause, name in pairs if name in signals]
