"""Known causes beside something unknown: which of them act, although the model stays inadequate.

A force that no known cause exerts is often imitated by one that does. Such an imitation is not
needed once a sum of generic forces may stand in for it. A cause that acts is: without it, no such
sum explains the data as well. All sums are formed in the linear model of one fit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fish_env.inference.adequacy import (
    Implausible,
    contradicts_priors,
    implausible_estimates,
)
from fish_env.inference.elimination import log_p_of, surely_acts
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import (
    CauseId,
    Coefficient,
    EffectName,
    ParameterId,
    listed,
    name_of,
)
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem
from fish_env.inference.progress import Report, silent
from fish_env.inference.projection import Projector
from fish_env.inference.result import ResidualModel
from fish_env.inference.rivals import alike
from fish_env.inference.stand_ins import StandIns
from fish_env.inference.substitution import without_in_step
from fish_env.inference.switched_off import distance, from_off, off_values

Describe = Callable[[Fit, float, Problem | None], ResidualModel | None]
"""Models what a fit leaves: the fit, the log p-value that a term has to pass, runs to judge on."""
Rejected = Callable[[Explanation, Sequence[CauseId]], tuple[CauseId, str] | None]
"""A test of causes: an explanation, those of its causes in question -> the worst, and why."""


def confirmed(
    accepted: Explanation, threshold: float, report: Report = silent
) -> Explanation | None:
    """The explanation with those of its causes that no sum of generic forces can stand in for.

    What is left may be a disturbance of implausible strength: it is estimated with the rest, and
    the evidence for a cause is counted beside it. What was measured of a drive without a model
    needs no model to confirm it. Where coefficients as a whole contradict their priors they make up
    for what is missing, and so may any cause that depends on them: none of those is believed.

    Args:
        accepted: causes that explain part of the data.
        threshold: log p-value that a generic force has to pass, and a cause beside such forces.
        report: told what is dropped and why.

    Returns:
        The causes that are left with their fit; None where none is.
    """
    measured = surely_measured(accepted)
    if doubtful := _dependent(accepted) - measured:
        left_out = listed(sorted(doubtful, key=name_of))
        report(f"rejecting {left_out}: coefficients contradict their priors")
        smaller = without_in_step(accepted, doubtful) if doubtful < {*accepted.causes} else None
        if smaller is None:
            return None
        accepted = smaller
    plausible = rejected_in_turn(accepted, _implausible, report)
    others = [name for name in plausible.causes if name not in measured] if plausible else []
    if plausible is None or not others:
        return plausible
    replaced = StandIns(plausible, threshold).replaced(others)
    for name in replaced:
        report(f"rejecting {name_of(name)}: generic forces explain as much")
    if not replaced:
        return plausible
    # A fit without these explains less: it says only whether estimates are plausible.
    smaller = without_in_step(plausible, replaced)
    return rejected_in_turn(smaller, _implausible, report) if smaller else None


def rejected_in_turn(found: Explanation, rejected: Rejected, report: Report) -> Explanation | None:
    """The explanation without causes that a test rejects, one fit after another.

    What was measured of a drive stays.

    Args:
        found: causes that act beside something unknown.
        rejected: the test, of an explanation and those of its causes that are in question.
        report: told what is dropped and why.

    Returns:
        The causes that are left with their fit; None where none is, or a simulation diverges.
    """
    measured = surely_measured(found)
    while others := [name for name in found.causes if name not in measured]:
        told = rejected(found, others)
        if told is None:
            return found
        cause, reason = told
        report(f"rejecting {name_of(cause)}: {reason}")
        smaller = without_in_step(found, (cause,))
        if smaller is None:
            return None
        found = smaller
    return found if found.causes else None


def _implausible(found: Explanation, others: Sequence[CauseId]) -> tuple[CauseId, str] | None:
    """The first cause with an implausible estimate, and what is implausible."""
    odd = implausible_estimates(found.fit)
    blamed = _blamed(others, odd)
    if blamed is None:
        return None
    return blamed, f"its estimate is implausible ({'; '.join(one.words for one in odd)})"


def beyond_small_errors(
    found: Explanation, threshold: float, report: Report = silent
) -> Explanation | None:
    """The explanation with those of its causes that small errors of all else cannot stand in for.

    Args:
        found: causes that act beside something unknown.
        threshold: log p-value that an effect has to pass among such errors.
        report: told what is dropped and why.

    Returns:
        The causes that are left with their fit; None where none is.
    """

    def rejected(found: Explanation, others: Sequence[CauseId]) -> tuple[CauseId, str] | None:
        judged = [cause for cause in others if not isinstance(cause, Coefficient)]
        if not judged:
            return None
        wide = found.small_errors.widened()
        log_p = {cause: log_p_of(wide, cause) for cause in judged}
        weakest = max(judged, key=lambda cause: log_p[cause])
        return None if log_p[weakest] < threshold else (weakest, "small errors explain as much")

    return rejected_in_turn(found, rejected, report)


def needed(found: Explanation, report: Report = silent) -> Explanation | None:
    """The explanation with those of its causes that fits without them lack.

    What others explained was theirs while these were there; and the linear model of one fit, which
    the sums of forces are formed in, is of small changes. So each cause that may not act is left
    out in a fit. It is not needed if the evidence is not strong, or runs do not agree on it.

    Args:
        found: causes that act beside something unknown.
        report: told what is dropped and why.

    Returns:
        The causes that are left with their fit; None where none is.
    """
    measured = surely_measured(found)
    while found.causes:
        judged = [c for c in found.causes if c not in measured and not surely_acts(found.fit, c)]
        fits = {cause: without_in_step(found, (cause,)) for cause in judged}
        enough = {cause: e for cause, e in fits.items() if e is not None and alike(found, e)}
        if not enough:
            return found
        idle = min(enough, key=lambda cause: enough[cause].score)
        report(f"rejecting {name_of(idle)}: a fit without it explains as much")
        found = enough[idle]
    return None


def _dependent(found: Explanation) -> frozenset[CauseId]:
    """Causes that depend on coefficients which contradict their priors; none where these do not."""
    if not contradicts_priors(found.fit):
        return frozenset()
    return frozenset(found.causes) - independent(found.fit)


def owed_to_coefficients(fit: Fit) -> dict[ParameterId, float]:
    """How much further each effect parameter is than with nominal coefficients.

    In the linear model, all effects following.
    """
    count = len(fit.problem.baseline)
    hessian = Projector(fit).hessian
    moved = np.linalg.solve(hessian[count:, count:], hessian[count:, :count] @ fit.point.z)
    return dict(zip(fit.ids[count:], (-moved).tolist(), strict=True))


def independent(fit: Fit) -> frozenset[EffectName]:
    """Effects that owe little to how far the coefficients are from their priors.

    Each parameter that switches the effect on owes them no more than its standard error; or
    together they owe them a small share of what they are, seen from where the effect is off: nearly
    all of it is there with the coefficients as they were known too.
    """
    owed = owed_to_coefficients(fit)
    return frozenset(name for name in map(EffectName, fit.effects) if _owes_little(fit, name, owed))


def _owes_little(own: Fit, name: EffectName, owed: Mapping[ParameterId, float]) -> bool:
    off = off_values(own, name)
    at = [own.ids.index(id) for id in off]
    debt = np.array([owed[id] for id in off])
    covariance = own.covariance[np.ix_(at, at)]
    if np.all(np.abs(debt) < np.sqrt(np.diag(covariance))):
        return True
    share = POLICY.most_owed_to_coefficients
    return distance(debt, covariance) < share**2 * from_off(own, off)


def surely_measured(found: Explanation) -> frozenset[EffectName]:
    """Causes that were measured without a model, and not by chance."""
    drive = found.fit.problem.drive
    return drive.effects & {*found.causes} if drive.certain else frozenset()


def _blamed(causes: Sequence[CauseId], found: Sequence[Implausible]) -> CauseId | None:
    """The first cause with an implausible estimate; None if none has."""
    blamed = {one.cause for one in found}
    return next((cause for cause in causes if cause in blamed), None)
