"""The whole inference in its order: from measured runs of any vehicle to a verdict.

The problem hands out residuals, see :class:`~fish_env.inference.problem.Problem`. Nothing here
knows what moves, or what was measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fish_env.inference.adequacy import (
    Adequacy,
    adequacy,
    disturbance_at_limit,
    implausible_estimates,
)
from fish_env.inference.afresh import searched_afresh
from fish_env.inference.attribution import Attribution, attribute, extended
from fish_env.inference.budget import Budget, error_budget
from fish_env.inference.effort import FULL, Effort
from fish_env.inference.elimination import without_idle
from fish_env.inference.estimate.again import (
    finished,
    refined,
    to_publish,
    to_search,
    under_noise,
)
from fish_env.inference.estimate.fit import FEWER_STEPS, Fit, fit
from fish_env.inference.explanation import Explanation, in_steps_of, reached
from fish_env.inference.gain import gap_closed
from fish_env.inference.lookalikes import decided, still_alike, undecided
from fish_env.inference.parallel import side_by_side
from fish_env.inference.partial import Describe, beyond_small_errors, confirmed, needed
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Cause, causes_of
from fish_env.inference.problem import Problem
from fish_env.inference.progress import Report, silent
from fish_env.inference.result import ResidualModel, Result
from fish_env.inference.screening import screen
from fish_env.inference.simulated import sustained
from fish_env.inference.switched_off import may_not_act
from fish_env.inference.verdict import EXTENDING, Verdict, decide, without_minor


def infer(
    problem: Problem,
    held_out: Problem | None = None,
    seed: int = 0,
    effort: Effort = FULL,
    report: Report = silent,
    describe: Describe | None = None,
) -> Result:
    """Find what a model lacks that should explain measured runs.

    Args:
        problem: the runs to fit, and the model.
        held_out: the same model on runs kept for judging; None without such runs.
        seed: of the null distributions.
        effort: how much to spend.
        report: told the name of each step.
        describe: models what no known cause explains; without it nothing is said of that.

    Raises:
        LinAlgError: the simulation diverges with the nominal coefficients.
    """
    report("refitting the baseline")
    baseline = refit_baseline(problem)
    causes = causes_of(baseline.problem)
    rng = np.random.default_rng(seed)
    return investigate(baseline, causes, rng, effort, report, held_out, describe)


def refit_baseline(problem: Problem) -> Fit:
    """The refitted baseline.

    It is iterated to convergence unless its disturbance is at the limit: the misfit that causes
    this is what comes next. A drive known to be out of step hides what the runs differ in, and its
    baseline is one to search from.

    Raises:
        LinAlgError: the simulation diverges with the nominal coefficients.
    """
    if problem.drive.in_step:
        problem = to_search(problem)
    own = fit(problem, rounds=2, iterations=FEWER_STEPS)
    return own if disturbance_at_limit(own) else finished(own)


def investigate(
    baseline: Fit,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    effort: Effort = FULL,
    report: Report = silent,
    held_out: Problem | None = None,
    describe: Describe | None = None,
) -> Result:
    """Everything after the refitted baseline.

    Args:
        baseline: refitted baseline, with the runs it was fitted to.
        causes: causes to consider.
        rng: for null distributions.
        effort: how much to spend.
        report: told the name of each step.
        held_out: the same model on runs kept for judging; None without such runs.
        describe: models what no known cause explains; without it nothing is said of that.
    """
    problem, work = baseline.problem, baseline.problem.work
    attribution = attribute(baseline, causes, rng, effort, report)
    if effort.retries and disturbance_at_limit(attribution.accepted.fit) and work.allows_more():
        attribution = searched_afresh(attribution, causes, rng, report)
    shown = attribution.preconditions
    report("testing the residual")
    left = adequacy(attribution.accepted.fit, rng)
    if effort.retries and left.slight and describe:
        left = cross_validated(attribution, left, describe, report)
    # A weaker cause may explain what is left, but no disturbance of implausible strength.
    if effort.retries and not left.reached and not left.implausible and work.allows_more():
        attribution, left = with_weaker_causes(attribution, left, causes, rng, report)
    if effort.retries and not left.reached:
        attribution, left = with_slow_causes(attribution, left, causes, rng, report)
    verdict = decide(attribution, left, shown)
    partly_known = verdict.name == "outside_library" and bool(attribution.accepted.causes)
    if effort.retries and partly_known:
        report("testing each cause beside generic forces")
        attribution, verdict = partly(attribution, left, verdict, report)
    gap = None
    if verdict.name in EXTENDING and held_out is not None:
        report("measuring the gain on final runs")
        gap = gap_closed(held_out, attribution.baseline.fit, attribution.accepted.fit)
    residual = None
    if effort.retries and not left.reached and describe:
        report("modelling the residual")
        residual = described(attribution, left, describe, held_out)
    report("computing the error budget")
    budget = budget_of(attribution, verdict, left, held_out)
    if budget is not None:
        verdict = without_minor(verdict, budget.minor(slow=problem.out_of_step))
    if effort.retries:
        attribution, verdict = among_small_errors(attribution, verdict)
    return Result(attribution, left, shown, verdict, gap, residual, budget)


def among_small_errors(attribution: Attribution, verdict: Verdict) -> tuple[Attribution, Verdict]:
    """With intervals as wide as small errors of all else make them.

    A cause is not named whose interval then holds its neutral value.
    """
    accepted = attribution.accepted
    wide = replace(accepted, fit=accepted.small_errors.widened())
    faint = [cause for cause in verdict.causes if may_not_act(wide.fit, cause)]
    return replace(attribution, accepted=wide), without_minor(verdict, faint=faint)


def unnamed(found: Result, held_out: Problem | None) -> Result:
    """The result without the names of its causes.

    For a vehicle that knows that the model is of no use with them either.

    Args:
        found: result that names causes.
        held_out: runs that chose nothing; None without such runs.
    """
    begun = found.attribution
    nothing = replace(begun, accepted=begun.baseline, rivals=())
    verdict = Verdict("outside_library")
    budget = budget_of(nothing, verdict, found.adequacy, held_out)
    return replace(found, attribution=nothing, verdict=verdict, gap=None, budget=budget)


def partly(
    attribution: Attribution,
    left: Adequacy,
    verdict: Verdict,
    report: Report,
) -> tuple[Attribution, Verdict]:
    """The verdict ``partial`` where known causes act beside something unknown.

    It names those that act for certain. Where one of several clocks, beats or lags acts besides,
    all of these explanations are its alternatives, the accepted one among them.

    Args:
        attribution: what was found.
        left: adequacy of the accepted explanation, which is not adequate.
        verdict: the verdict without such causes.
        report: told what is being done.
    """
    found = confirmed(attribution.accepted, left.threshold, report)
    found = sustained(found, report) if found else None
    found = beyond_small_errors(found, left.threshold, report) if found else None
    found = needed(found, report) if found else None
    if found is None:
        return attribution, verdict
    found, rates = decided(found, attribution.shown, report)
    lags = still_alike(found, attribution.accepted, attribution.rivals, report)
    rivals = (*rates, *lags)
    if disturbance_at_limit(found.fit):
        rivals = (*rivals, *undecided(found, attribution.shown, report))
    plain = side_by_side([partial(without_idle, other) for other in rivals])
    rivals = tuple(other for other in plain if other.causes != found.causes)
    shared = {*found.causes}.intersection(*(other.causes for other in rivals))
    if not shared:
        return attribution, verdict
    # What is published was compared in the steps of a search, or has just been changed.
    publish = refined if found.fit is attribution.accepted.fit else to_publish
    final = reached(partial(publish, found.fit))
    found = replace(found, fit=final) if final else found
    sure = tuple(cause for cause in found.causes if cause in shared)
    alike = tuple(e.causes for e in (found, *rivals)) if rivals else ()
    return replace(attribution, accepted=found, rivals=rivals), Verdict("partial", sure, alike)


def budget_of(
    attribution: Attribution,
    verdict: Verdict,
    left: Adequacy,
    held_out: Problem | None,
) -> Budget | None:
    """Where the misfit of the nominal model goes, on held-out runs where there are some.

    Args:
        attribution: what was found.
        verdict: only causes that it names have a share of their own.
        left: adequacy of the accepted explanation.
        held_out: runs that chose nothing; None without such runs.
    """
    named = verdict.name in EXTENDING
    fit = attribution.accepted.fit if named else attribution.baseline.fit
    problem = fit.problem if held_out is None else held_out
    causes = attribution.accepted.causes if named else ()
    held = held_out is not None
    return error_budget(problem, fit, causes, problem.run_ids, held, left.reached)


def described(
    attribution: Attribution, left: Adequacy, describe: Describe, held_out: Problem | None
) -> ResidualModel | None:
    """A model of what the accepted explanation leaves.

    Beside implausible estimates it would be biased: then it is one of what the baseline leaves.

    Args:
        attribution: what was found.
        left: adequacy of the accepted explanation.
        describe: makes the model.
        held_out: runs that chose nothing, to judge the model on; None without such runs.
    """
    accepted = attribution.accepted.fit
    basis = attribution.baseline.fit if implausible_estimates(accepted) else accepted
    return describe(basis, left.threshold, held_out)


def cross_validated(
    attribution: Attribution, left: Adequacy, describe: Describe, report: Report
) -> Adequacy:
    """The adequacy after the residual's model was tested on runs that did not choose it.

    Each half of the fitted runs is predicted by the model that the other half asks for. Beside
    causes it stays as it is: the residual may be the only sign of a wrong cause.

    Args:
        attribution: what was found.
        left: adequacy of the accepted explanation.
        describe: models what it leaves.
        report: told what is being done.
    """
    own = attribution.accepted.fit
    count = own.problem.run_count
    if attribution.accepted.causes or count < 2:
        return left
    report("predicting one half of the runs by the other")
    halves = [list(range(first, count, 2)) for first in (0, 1)]
    gain, tested = 0.0, False
    for mine, other in (halves, halves[::-1]):
        half = own.problem.some(mine)
        try:
            noise = half.noise_of(own)
            fitted = under_noise(half, own, noise)
        except np.linalg.LinAlgError:
            return left
        model = describe(fitted, left.threshold, own.problem.some(other))
        if model is not None and model.held_out_gain is not None:
            gain, tested = gain + model.held_out_gain, True
    return left.judged(gain) if tested else left


def with_weaker_causes(
    attribution: Attribution,
    left: Adequacy,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    report: Report,
) -> tuple[Attribution, Adequacy]:
    """One more search where something is known to be missing; kept if nothing then is.

    Beside causes it is kept if it explains more: each cause is tested beside generic forces then.
    Where no stronger one acts, a weak one stands in for what is missing.

    Args:
        attribution: what was found.
        left: adequacy of the accepted explanation.
        causes: causes to consider.
        rng: for null distributions.
        report: told what is being done.
    """
    before = attribution.accepted
    begun = in_steps_of(to_search(before.fit.problem), before)
    # Some of the causes that the last screen was made beside may have been dropped since.
    again = replace(attribution, accepted=begun, shown=screen(begun.fit, causes, rng))
    more = extended(again, causes, rng, FULL, report, POLICY.relaxed_log_p)
    if more.accepted.causes == before.causes:
        return attribution, left
    report("testing the residual")
    after = adequacy(more.accepted.fit, rng)
    more_explained = more.accepted.score < before.score - POLICY.evidence_doubt
    beside = bool(before.causes) and more_explained and not after.implausible
    return (more, after) if after.reached or beside else (attribution, left)


def with_slow_causes(
    attribution: Attribution,
    left: Adequacy,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    report: Report,
) -> tuple[Attribution, Adequacy]:
    """One more search where a disturbance that stays hides slow causes; kept if it then passes.

    The search begins under a disturbance that passes. All fits with further causes estimate it
    again, and what is kept has to be better than before under its own.

    Args:
        attribution: what was found.
        left: adequacy of the accepted explanation.
        causes: causes to consider.
        rng: for null distributions.
        report: told what is being done.
    """
    before = attribution.accepted
    own = before.fit
    noise = own.problem.passing_noise(own.noise)
    if noise is None or not own.problem.work.allows_more():
        return attribution, left
    report("searching for slow causes")
    passing = reached(partial(under_noise, own.problem, own, noise))
    if passing is None:
        return attribution, left
    begun = replace(
        attribution,
        accepted=Explanation(before.causes, passing),
        shown=screen(passing, causes, rng),
    )
    more = extended(begun, causes, rng, FULL, report)
    found = more.accepted
    better = found.score < before.score - POLICY.evidence_doubt
    if found.causes == before.causes or not better or disturbance_at_limit(found.fit):
        return attribution, left
    report("testing the residual")
    return more, adequacy(found.fit, rng)
