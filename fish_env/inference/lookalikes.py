"""Which of effects that look alike it is: of those that make a drive late, or put it out of step.

What makes the measurements late looks like a late drive.

Of short lags the kind hardly shows. In the long steps of a search the right one may not even be
possible, as no step follows it, and another one stands in for it. So the question is asked again
in the steps of published estimates; and beside something unknown, where fits tell kinds of lags
apart no better than by what they make up for, each is an alternative.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fish_env.inference.contenders import Swap, asked, fitted_without
from fish_env.inference.elimination import surely_acts
from fish_env.inference.estimate.again import finished
from fish_env.inference.estimate.coarse_fit import CoarseFit, CoarseFitter
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation, swap_between
from fish_env.inference.hypotheses import (
    CauseId,
    EffectName,
    name_of,
    of_effects,
)
from fish_env.inference.in_place import (
    moved_to_runs,
    replaced,
    surprising_runs,
    with_lookalike,
    without_causes,
)
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point, Problem
from fish_env.inference.progress import Report
from fish_env.inference.projection import Signal
from fish_env.inference.rivals import agreed, as_likely_among_small_errors, rivals_of
from fish_env.inference.screening import Screen
from fish_env.inference.search import at_noise
from fish_env.inference.substitution import swapped, what_may_lack

Pair = tuple[EffectName, EffectName]
"""A cause, and what looks like it."""


def late(current: Explanation) -> list[Pair]:
    """What makes a drive or its measurements late, each with what else may.

    Short lags differ little but in name. The linear model is of no help. It begins from sizes at
    which the one follows another course than the other.
    """
    problem = current.fit.problem
    names = (*problem.hidden_by_drive, *problem.late_sensors)
    return pairs_alike(current, names, names)


def rates(current: Explanation) -> list[Pair]:
    """What makes a clock or a drive slow, each with what else may.

    A clock that is slow by half a percent differs from a drive that is by half a percent of all
    forces, which coefficients make up for. One that is slow by its load differs by as little.
    """
    names = _rates(current.fit.problem)
    return pairs_alike(current, names, names)


def _rates(problem: Problem) -> tuple[EffectName, ...]:
    """Effects that make a clock or a drive slow."""
    drifting = [EffectName(name) for name, e in problem.known.items() if e.drifts_in_phase]
    return tuple(dict.fromkeys((*problem.out_of_step, *drifting)))


def pairs_alike(
    current: Explanation, among: Sequence[EffectName], names: Sequence[EffectName]
) -> list[Pair]:
    """Causes among some effects, each with those of others that are known to look like it."""
    known = current.fit.problem.known
    causes = [name for name in among if name in current.causes]
    others = [name for name in names if name not in current.causes]
    return [(c, n) for c in causes for n in others if n in known[c].confusable_with]


def asked_of_lags(
    current: Explanation, shown: Screen, report: Report
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The explanation with the lags that fit best in the steps of published estimates.

    With the explanations that fit as well. What looks like one of its causes takes its place in a
    fit of a few steps to a few runs: where runs differ in all they have, a coarse fit, which holds
    that, tells too little.

    A lag that was found in long steps and diverges in those of published estimates leaves its place
    to any that does not.

    Args:
        current: causes with their fit, in the steps of published estimates if it has one in them.
        shown: causes that are not among them.
        report: told what is being done.
    """
    runs, pairs = current.fit.problem, _shown(late(current), shown)
    if runs.is_coarse:
        runs, swaps = runs.in_usual_steps(), _swaps(current.fit, pairs)
    else:
        swaps = _within_reach(current.fit, pairs, POLICY.coarse_fit_leeway)
    leeway = POLICY.coarse_fit_leeway
    best, rivals = asked(runs, current, swaps, POLICY.swap_steps, leeway, report)
    if best is not current:
        best = Explanation(best.causes, finished(best.fit))
    return best, rivals


def asked_of_rates(
    current: Explanation, shown: Screen, report: Report
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """As :func:`asked_of_lags`, of what makes a clock or a drive slow, in the steps of the fit.

    Long steps get no rate wrong. None is a cause where the numbers of the runs explain as much.
    """
    current = _without_what_runs_explain(current, report)
    pairs = _shown(rates(current), shown)
    if pairs:
        current = _on_equal_terms(current)
    leeway = POLICY.evidence_doubt + POLICY.linear_doubt
    swaps = _swaps(current.fit, pairs)
    return asked(current.fit.problem, current, swaps, POLICY.rate_steps, leeway, report)


def rates_asked_again(
    current: Explanation, before: Explanation, others: Iterable[Explanation], report: Report
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The explanation with the clock or drive that fits best, and those with one as good.

    What was compared beside a wrong cause may compare otherwise beside the right one.

    Args:
        current: causes with their fit.
        before: those that were compared with others.
        others: these, each with another clock or drive in the place of one of its causes.
        report: told what is being done.
    """
    pairs, steps = rates(current), POLICY.rate_steps
    swaps = [(swap, other) for other in others if (swap := swap_between(before, other)) in pairs]
    found = [_beside_fewer(current, *swap, other, report, steps) for swap, other in swaps if swap]
    best, *rest = sorted((current, *filter(None, found)), key=lambda e: e.score)
    return best, rivals_of(best, rest)


def _without_what_runs_explain(current: Explanation, report: Report) -> Explanation:
    """The explanation without rates in whose place the runs' own numbers explain as much.

    Elimination takes few steps, and begins where the runs are out of step without the cause. Runs
    that would have to differ by more than ordinary ones do not take a cause's place.
    """
    for cause in [name for name in _rates(current.fit.problem) if name in current.causes]:
        own = current.fit
        only = len(current.causes) == 1
        if only or not moved_to_runs(own, cause) or surely_acts(own, cause):
            continue
        report(f"fitting without {name_of(cause)}")
        enough = own.objective + POLICY.evidence_doubt + current.narrowed_by((cause,))
        begin = without_causes(own, (cause,))
        fitted = fitted_without(own.problem, own, cause, begin, POLICY.rate_steps, enough)
        if fitted is None or surprising_runs(fitted, cause):
            continue
        without = Explanation(tuple(c for c in current.causes if c != cause), fitted)
        if without.score < current.score + POLICY.evidence_doubt:
            report(f"fitting with {name_of(cause)} again")
            again = _put_back(current, cause, fitted)
            better = again is not None and again.score < without.score - POLICY.evidence_doubt
            current = again if again is not None and better else without
    return current


def _on_equal_terms(current: Explanation) -> Explanation:
    """The explanation after as many steps as look-alikes of its causes are given.

    A fit ends where steps gain little beside what is missing: others would win by steps alone.
    """
    own = current.fit
    again = at_noise(own.problem, own, own.noise, POLICY.rate_steps)
    if again is None or not again.objective < own.objective:
        return current
    return Explanation(current.causes, again)


def _put_back(before: Explanation, cause: CauseId, fitted: Fit) -> Explanation | None:
    """The explanation with a cause again, from where the fit without it has ended.

    That fit may have gained by what has nothing to do with the cause.
    """
    own = before.fit
    values = {**fitted.point.effects, **of_effects(own.point.effects, {str(cause)})}
    begin = CoarseFit(own.effects, own.released, Point(fitted.point.z, values), np.inf)
    again = fitted_without(own.problem, fitted, cause, begin, POLICY.rate_steps, fitted.objective)
    return None if again is None else Explanation(before.causes, again)


def _swaps(own: Fit, pairs: Sequence[tuple[CauseId, Signal]]) -> list[Swap]:
    """Pairs with where a fit with the look-alike begins.

    Args:
        own: fit with the causes.
        pairs: causes, each with the signal of what looks like it.
    """
    return [Swap(c, signal.cause.effect, with_lookalike(own, c, signal)) for c, signal in pairs]


def _within_reach(
    own: Fit, pairs: Sequence[tuple[CauseId, Signal]], least: float = -np.inf
) -> list[Swap]:
    """Pairs whose look-alike makes up for most of what the cause explains, in a coarse fit.

    A fit with it begins where that has led: from the mildest plausible size, which may be several
    times too large, its few steps would not come as far. The coarse fit holds what runs differ in,
    and is given the leeway of one beside a misfit.

    Args:
        own: fit with the causes.
        pairs: causes, each with the signal of what looks like it.
        least: what a coarse fit may lack in any case.
    """
    fitter = CoarseFitter(own)
    lack = {c: max(least, what_may_lack(fitter, c)) for c in dict.fromkeys(c for c, _ in pairs)}
    found = list[Swap]()
    for cause, signal in pairs:
        enough = fitter.base + lack[cause]
        coarse = swapped(fitter, own, cause, signal, enough)
        if coarse is not None and coarse.objective < enough:
            found.append(Swap(cause, signal.cause.effect, coarse))
    return found


def still_alike(
    found: Explanation, before: Explanation, rivals: Sequence[Explanation], report: Report
) -> tuple[Explanation, ...]:
    """Those of an explanation's rivals that have another lag, beside the causes it still has.

    Args:
        found: the explanation, perhaps without some of its causes.
        before: the explanation with all of them.
        rivals: what could not be told from that.
        report: told what is being done.
    """
    still, pairs = list[Explanation](), late(found)
    for rival in rivals:
        swap = swap_between(before, rival)
        if swap not in pairs:
            continue
        if found is before:
            still.append(rival)
            continue
        lack = max(rival.fit.objective - before.fit.objective, 0.0)
        other = _beside_fewer(found, *swap, rival, report, lack=lack)
        if other and (as_likely_among_small_errors(found, other) or not agreed(found, other)):
            still.append(other)
    return tuple(still)


def _beside_fewer(
    found: Explanation,
    cause: CauseId,
    other: EffectName,
    rival: Explanation,
    report: Report,
    steps: int = POLICY.swap_steps,
    lack: float = 0.0,
) -> Explanation | None:
    """An explanation with another effect in the place of a cause, at its values in a rival.

    None where it would explain less by more than what it lacks already.
    """
    own = found.fit
    report(f"fitting {other} instead of {name_of(cause)}")
    effects, kept = replaced(own, cause, other)
    values = of_effects(rival.fit.point.effects, {other})
    begin = CoarseFit(effects, own.released, Point(own.point.z, {**kept, **values}), np.inf)
    enough = own.objective + POLICY.coarse_fit_leeway + lack
    fitted = fitted_without(own.problem, own, cause, begin, steps, enough)
    return None if fitted is None else Explanation(found.causes_with(other, cause), fitted)


def undecided(current: Explanation, shown: Screen, report: Report) -> tuple[Explanation, ...]:
    """The explanation with one of its lags replaced, where that explains nearly as much.

    Beside something unknown, where fits tell kinds of lags apart no better than by what they make
    up for: all of these are as good.

    Args:
        current: causes with their fit.
        shown: causes that are not among them.
        report: told what is being done.
    """
    own, found = current.fit, list[Explanation]()
    for swap in _within_reach(own, _shown(late(current), shown)):
        report(f"fitting {swap.other}, which explains nearly as much as {name_of(swap.cause)}")
        fitted = at_noise(own.problem, swap.begin, own.noise, POLICY.swap_steps)
        if fitted is not None:
            found.append(Explanation(current.causes_with(swap.other, swap.cause), fitted))
    return tuple(found)


def decided(
    found: Explanation, shown: Screen, report: Report
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The best of an explanation and those with another rate in it, and those as good.

    Beside something unknown. That runs disagree on which is better says little there: what is
    unknown may act in some of them.

    Args:
        found: causes that act.
        shown: causes that are not among them.
        report: told what is being done.
    """
    best, rivals = asked_of_rates(found, shown, report)
    return best, tuple(other for other in rivals if as_likely_among_small_errors(best, other))


def _shown(pairs: Sequence[Pair], shown: Screen) -> list[tuple[CauseId, Signal]]:
    """The pairs with the signals of what may be in a cause's place, where it has one."""
    signals = shown.by_effect()
    return [(cause, signals[name]) for cause, name in pairs if name in signals]
