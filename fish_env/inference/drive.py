"""Causes beside a periodic drive that is out of step.

A drive that is slower or quicker than commanded hides what else is wrong, and is hidden by it: no
single cause explains much, and what compensates best wins a contest of single causes. Under relaxed
noise the filter follows the drive whatever its frequency. What else is wrong then shows first, and
beside it what puts the drive in step again. All that is compared in the end is in step by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.inference.adequacy import disturbance_at_limit, implausible_estimates
from fish_env.inference.effort import Effort
from fish_env.inference.estimate.again import to_search
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.settle import usual_runs
from fish_env.inference.explanation import Explanation, fitted_again, on_few_runs
from fish_env.inference.hypotheses import EffectName
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import Cause
from fish_env.inference.problem import Point
from fish_env.inference.progress import Report
from fish_env.inference.projection import Signal
from fish_env.inference.screening import Screen, screen
from fish_env.inference.search import refits
from fish_env.inference.shortlist import shortlisted
from fish_env.inference.starts import baselines


@dataclass(frozen=True, eq=False)
class Followed:
    """What was found while the drive was followed.

    Attributes:
        explanation: causes with their fit, the drive in step by them.
        tried: fits with one cause each while the drive was followed, best first.
        base: the fit without a cause, under the noise of the best.
    """

    explanation: Explanation
    tried: Sequence[Explanation]
    base: Explanation


def measured(nothing: Explanation, report: Report) -> Explanation | None:
    """The effects that were measured to put the drive in step, fitted.

    Args:
        nothing: the refitted baseline.
        report: told what is being done.

    Returns:
        The explanation by these effects; None where none was measured, or where they explain no
        more than the baseline does.
    """
    own = nothing.fit
    values = own.problem.drive.in_step
    if not values:
        return None
    effects = tuple(dict.fromkeys(EffectName(id.effect) for id in values))
    report(f"fitting the drive with {' and '.join(effects)}")
    noise = own.problem.default_noise()
    begin = [Point(z, values) for z in baselines(own)]
    # The runs' own numbers have gone far to make up for what was measured.
    fresh = usual_runs(to_search(own.problem), begin[0], noise)
    best = on_few_runs(fresh, effects, begin, noise)
    whole = fitted_again(fresh, best, best.noise) if best else None
    if whole is None:
        return None
    found = Explanation(effects, whole).varied(beside_misfit=own.problem.drive.uneven)
    return found if nothing.score - found.score >= POLICY.evidence_doubt else None


def beside_drive(
    nothing: Explanation,
    best: Explanation,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    effort: Effort,
    report: Report,
) -> Followed | None:
    """A cause with what puts the drive in step, if they explain more than the best single cause.

    Args:
        nothing: the refitted baseline.
        best: the best single cause; the baseline where none is significant.
        causes: causes to consider.
        rng: for null distributions.
        effort: how much to spend.
        report: told what is being done.

    Returns:
        What was found; None where the drive explains less than the best cause, or nothing more is
        found.
    """
    loose = _relaxed(nothing.fit, best.fit.objective, report)
    if loose is None:
        return None
    problem = loose.fit.problem
    # What else is missing pulls at coefficients, and one of them would win.
    effects = [cause for cause in causes if cause.is_effect]
    chosen = shortlisted(problem, screen(loose.fit, effects, rng), effort.shortlist)
    tried, base = refits(loose, chosen, report, effort=effort)
    tried = [e for e in tried if not implausible_estimates(e.fit)]
    if not tried or base is None or base.score - tried[0].score < POLICY.evidence_doubt:
        return None
    first = tried[0]
    own = fitted_again(problem, first.fit, nothing.fit.noise)
    if own is None:
        return None
    begun = Explanation(first.causes, own)
    found = min(
        (begun, *_with_drive(begun, first.fit, causes, rng, effort, report)), key=lambda e: e.score
    )
    return Followed(found, tried, base) if found.score < best.score else None


def _relaxed(baseline: Fit, objective: float, report: Report) -> Explanation | None:
    """The baseline under relaxed noise; None where that explains less than an objective says."""
    noise = baseline.problem.relaxed_noise(baseline.noise)
    if noise is None:
        return None
    report("fitting with a random-walk phase of the drive")
    loose = fitted_again(baseline.problem, baseline, noise)
    if loose is None or loose.objective > objective - POLICY.evidence_doubt:
        return None
    return Explanation((), loose).varied(beside_misfit=True)


def _with_drive(
    begun: Explanation,
    followed: Fit,
    causes: Sequence[Cause],
    rng: np.random.Generator,
    effort: Effort,
    report: Report,
) -> list[Explanation]:
    """Fits with a cause and one effect that puts the drive in step, best first."""
    problem = begun.fit.problem
    if problem.drive.known:
        return []
    known = problem.known
    drives = [c for c in causes if c.is_effect and known[c.effect].drifts_in_phase]
    shown = list(screen(followed, drives, rng).best())
    few = fitted_again(problem.subset(POLICY.few_runs), followed, followed.noise, rounds=1)
    if few is None or not shown:
        return []
    return refits(begun, shown, report, (few, shown), effort)[0]


def under_relaxed_noise(
    current: Explanation,
    chosen: Sequence[Signal],
    causes: Sequence[Cause],
    rng: np.random.Generator,
) -> tuple[Fit, Sequence[Signal]] | None:
    """The fit under relaxed noise where a drive may be out of step, and the effects it shows."""
    if not _may_be_out_of_step(current, chosen):
        return None
    relaxed = current.with_relaxed_noise
    if relaxed is None:
        return None
    shown = screen(relaxed, causes, rng)
    effects = sorted((s for s in shown.best() if s.cause.is_effect), key=lambda s: -s.uncorrected)
    first = [s for s in effects[: POLICY.most_relaxed] if s.uncorrected > POLICY.worth_coarse_fit]
    tried_anyway = current.fit.problem.out_of_step
    return relaxed, first + [s for s in effects if s.cause.id in tried_anyway and s not in first]


def drifting(current: Explanation, shown: Screen, chosen: Sequence[Signal]) -> list[Signal]:
    """Effects that drift in phase.

    After many periods out of step the screen shows them no more than it shows others.
    """
    if not _may_be_out_of_step(current, chosen):
        return []
    known = current.fit.problem.known
    effects = [s for s in shown.best() if s.cause.is_effect and s not in chosen]
    return [s for s in effects if known[s.cause.effect].drifts_in_phase]


def _may_be_out_of_step(current: Explanation, chosen: Sequence[Signal]) -> bool:
    """Whether a periodic drive may be out of step: no plausible disturbance explains the misfit.

    A drive out of step hides everything else, so it is the first cause to be found or none.
    """
    if current.causes or current.fit.problem.drive.known:
        return False
    return bool(chosen) and bool(disturbance_at_limit(current.fit))
