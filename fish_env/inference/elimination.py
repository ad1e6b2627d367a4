"""Causes that an explanation can do without."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np
from scipy.special import chdtri

from fish_env.inference.estimate.coarse_fit import CoarseFitter
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import (
    CauseId,
    Coefficient,
    EffectName,
    name_of,
)
from fish_env.inference.policy import POLICY
from fish_env.inference.progress import Report
from fish_env.inference.rivals import rivals_of
from fish_env.inference.substitution import coarse_without, without
from fish_env.inference.switched_off import distance, from_off, may_not_act, off_values
from fish_env.inference.tails import chi2_log_tail


def backward_elimination(
    current: Explanation, judged: bool = False
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The explanation without causes that later ones made unnecessary, and its rivals.

    Also without any cause whose interval, beside the others, contains its neutral value: the
    evidence takes the residuals for white, the interval does not. Of a single cause that is the
    only question, for its evidence has just been found enough. Where a fit without the cause loses
    more than such an interval allows, the cause acts: what the interval follows from, a linear
    model, then does not hold as far as neutral.

    Two look-alikes make each other unnecessary. Rivals go without the other of them. What is needed
    beside more causes is needed beside fewer.

    Args:
        current: all causes.
        judged: whether the evidence for each was enough just before the estimates moved a little:
            then only causes whose interval contains the neutral value are in question.
    """
    rivals: tuple[Explanation, ...] = ()
    needed: set[CauseId] = set()
    while smaller := _smaller(current, needed, judged):
        needed = set.intersection(*({*e.causes} for e in smaller))
        current, *others = smaller
        rivals = rivals_of(current, others)
    return current, rivals


def _smaller(current: Explanation, needed: Collection[CauseId], judged: bool) -> list[Explanation]:
    """Explanations without one of the causes that do as well, best first.

    Args:
        current: all causes.
        needed: those that are known to be.
        judged: whether only causes that may not act are in question.
    """
    alone = len(current.causes) == 1
    found = []
    fitter = CoarseFitter(current.fit)
    for cause in current.causes:
        if not alone and (cause in needed or surely_acts(current.fit, cause)):
            continue
        doubtful = may_not_act(current.fit, cause)
        if (alone or judged) and not doubtful:
            continue
        least = POLICY.evidence_doubt + (allowed_loss(current.fit, cause) if doubtful else 0.0)
        if not alone and foreseen_loss(current, cause) > least + POLICY.linear_doubt:
            continue
        smaller = None if _is_needed(fitter, cause, least) else without(current, (cause,), least)
        if smaller and smaller.score < current.score + least:
            found.append(smaller)
    return sorted(found, key=lambda e: e.score)


def _is_needed(fitter: CoarseFitter, cause: CauseId, least: float) -> bool:
    """Whether a coarse fit without a cause loses so much that no full one need tell.

    Args:
        fitter: of the fit with all causes.
        cause: the cause.
        least: growth of -2 log likelihood at which it is needed.
    """
    enough = fitter.base + least + POLICY.coarse_fit_leeway
    left = coarse_without(fitter, cause, enough)
    return left is None or left.objective > enough


def without_idle(found: Explanation) -> Explanation:
    """The explanation without causes that may not act, if one fit can do without all of these."""
    idle = [cause for cause in found.causes if may_not_act(found.fit, cause)]
    least = POLICY.evidence_doubt + sum(allowed_loss(found.fit, cause) for cause in idle)
    smaller = without(found, idle, least) if idle else None
    return smaller if smaller and smaller.score < found.score + least else found


def without_insignificant(
    current: Explanation, threshold: Callable[[int], float], report: Report
) -> Explanation:
    """The explanation without causes that are not significant beside the others.

    What was missing when a cause was accepted pulled at it. Beside all others it has to be as
    significant as it had to be then. It stays where the fit without it loses more than the linear
    model foresees, and where it is the only one: that was judged by the search.

    Args:
        current: causes with their fit.
        threshold: log p-value to pass, for a number of coefficients beside the cause; that of an
            effect is the one beside none.
        report: told what is being done.
    """
    needed: set[CauseId] = set()
    while len(current.causes) > 1:
        own, judged = current.fit, [c for c in current.causes if c not in needed]
        lifted = sum(isinstance(name, Coefficient) for name in current.causes)
        enough = {c: threshold(lifted - 1 if isinstance(c, Coefficient) else 0) for c in judged}
        over = {c: log_p_of(own, c) - enough[c] for c in judged}
        weak = [c for c in judged if over[c] >= 0.0]
        if not weak:
            break
        weakest = max(weak, key=lambda cause: over[cause])
        report(f"fitting without {name_of(weakest)}, which is not significant any more")
        foreseen = allowed_loss(own, weakest, float(np.exp(enough[weakest])))
        least = POLICY.evidence_doubt + foreseen
        smaller = without(current, (weakest,), least)
        if smaller is None or smaller.score > current.score + least:
            needed.add(weakest)
        else:
            current = smaller
    return current


def log_p_of(fit: Fit, cause: CauseId) -> float:
    """Log p-value of a cause beside the others, corrected for coloured residuals."""
    if isinstance(cause, Coefficient):
        return log_p_of_departure(fit, cause)
    off = off_values(fit, cause)
    return float(chi2_log_tail(from_off(fit, off), len(off)))


def log_p_of_departure(fit: Fit, cause: Coefficient) -> float:
    """Log p-value of an estimate whose prior is lifted, if the coefficient is as its prior says.

    The spread is that of the prior and of the estimate, corrected for coloured residuals.
    """
    baseline, number = fit.problem.baseline, fit.ids.index(cause)
    known = baseline.ids.index(cause)
    variance = baseline.sd[known] ** 2 + fit.covariance[number, number]
    off = float(fit.estimates[number] - baseline.mean[known])
    return float(chi2_log_tail(off**2 / variance, 1))


def last_departs(found: Explanation, threshold: float) -> bool:
    """Whether the last cause is surely off if it is a coefficient; any effect is.

    What else is missing pulls at a coefficient, seldom in all runs alike: its spread counts errors
    of runs, and small errors of all effects that are not known to act. Runs left out do not tell.
    They measure a coefficient so well that its prior hardly holds it, and so predict the same with
    its prior and without.

    Args:
        found: with the cause, the prior of a coefficient lifted.
        threshold: log p-value for a coefficient to pass.
    """
    last = found.causes[-1]
    if not isinstance(last, Coefficient):
        return True
    return log_p_of_departure(found.small_errors.widened(), last) < threshold


def allowed_loss(fit: Fit, cause: CauseId, level: float = POLICY.interval_error) -> float:
    """Growth of -2 log likelihood without a cause, at most, if its region holds neutral values.

    In white residuals it is a quantile of chi-squared; coloured ones multiply it.

    Args:
        fit: with the cause.
        cause: the cause.
        level: share of such regions that do not hold the truth.
    """
    at = [fit.ids.index(id) for id in off_values(fit, cause)]
    return float(chdtri(len(at), level)) * fit.inflation(at)


def surely_acts(fit: Fit, cause: CauseId) -> bool:
    """Whether a cause is so many standard errors from doing nothing that no fit need tell.

    Of what is off at infinity no linear model tells that.
    """
    if not isinstance(cause, Coefficient) and not _is_off_at_finite(fit, cause):
        return False
    return from_off(fit, off_values(fit, cause)) > POLICY.sure_sd**2


def foreseen_loss(current: Explanation, cause: CauseId) -> float:
    """By how much the score grows without a cause, in the linear model; zero where none tells.

    That is of what is off at infinity, and where the motion's rate jumps.

    Args:
        current: all causes with their fit.
        cause: the one to drop.
    """
    own = current.fit
    if not isinstance(cause, Coefficient) and not _is_linear(own, cause):
        return 0.0
    return from_off(own, off_values(own, cause)) - current.narrowed_by((cause,))


def insignificant(fit: Fit, causes: Sequence[CauseId], threshold: float) -> tuple[CauseId, ...]:
    """Causes that are not significant beside the others, the weakest dropped before the next.

    Told by the covariance, which is corrected for coloured residuals: estimates of the others move
    in a linear model as one is dropped.

    Args:
        fit: with all causes.
        causes: those to judge.
        threshold: log p-value that each has to pass.
    """
    judged = {name: off_values(fit, name) for name in causes}
    estimates, covariance = fit.estimates.copy(), fit.covariance.copy()
    dropped: list[CauseId] = []
    while judged:
        log_p = {}
        for name, off in judged.items():
            own = [fit.ids.index(id) for id in off]
            gap = estimates[own] - np.array(list(off.values()))
            squared = distance(gap, covariance[np.ix_(own, own)])
            log_p[name] = float(chi2_log_tail(squared, len(own)))
        weakest = max(log_p, key=lambda name: log_p[name])
        if log_p[weakest] < threshold:
            break
        off = judged.pop(weakest)
        own = [fit.ids.index(id) for id in off]
        pull = covariance[:, own] @ np.linalg.inv(covariance[np.ix_(own, own)])
        estimates -= pull @ (estimates[own] - np.array(list(off.values())))
        covariance -= pull @ covariance[own]
        dropped.append(weakest)
    return tuple(dropped)


def _is_linear(fit: Fit, name: EffectName) -> bool:
    return _is_off_at_finite(fit, name) and not fit.problem.is_nonsmooth((name,))


def _is_off_at_finite(fit: Fit, name: str) -> bool:
    """Whether an effect is off at values that are finite."""
    return all(np.isfinite(p.neutral) for p in fit.problem.known[name].switching)
