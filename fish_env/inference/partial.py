"""Known causes beside something unknown: which of them act, although the model stays inadequate.

A force that no known cause exerts is often imitated by one that does. Such an imitation is not
needed once an empirical model of the residual, a sum of generic forces, may stand in for it. A
cause that acts is: without it, no such sum explains the data as well.
"""

from __future__ import annotations

from collections.abc import Callable

from fish_env.inference.adequacy import disturbance_at_limit, implausible_estimates
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem
from fish_env.inference.result import ResidualModel
from fish_env.inference.search import without

Describe = Callable[[Fit, float, Problem | None], ResidualModel | None]
"""Models what a fit leaves: the fit, the log p-value that a term has to pass, runs to judge on."""


def confirmed(accepted: Explanation, threshold: float, describe: Describe) -> Explanation | None:
    """The explanation with those of its causes that no sum of generic forces can stand in for.

    Args:
        accepted: causes that explain part of the data.
        threshold: log p-value that a generic force has to pass.
        describe: models what a fit leaves.

    Returns:
        The causes that are left with their fit. None where none is, or where the disturbance is at
        its limit even beside the generic forces: then something is missing that is neither.
    """
    while accepted.causes:
        if implausible_causes(accepted):
            return None
        whole = _score(accepted, threshold, describe)
        if whole is None:
            return None
        gaps = {name: _gap(accepted, name, whole, threshold, describe) for name in accepted.causes}
        weakest = min(gaps, key=lambda name: gaps[name])
        if gaps[weakest] >= POLICY.evidence_doubt:
            return accepted
        smaller = without(accepted, weakest)
        if smaller is None:
            return None
        accepted = smaller
    return None


def implausible_causes(accepted: Explanation) -> bool:
    """Whether an estimate of a cause is implausible."""
    return bool(implausible_estimates(accepted.fit))


def _score(explanation: Explanation, threshold: float, describe: Describe) -> float | None:
    """-2 log evidence with the empirical model of the residual in place; None at the limit."""
    model = describe(explanation.fit, threshold, None)
    beside = explanation.fit if model is None else model.fit
    if disturbance_at_limit(beside):
        return None
    return Explanation(explanation.causes, beside).score


def _gap(
    accepted: Explanation, name: str, whole: float, threshold: float, describe: Describe
) -> float:
    """What -2 log evidence loses without a cause, generic forces being allowed to stand in."""
    smaller = without(accepted, name)
    if smaller is None:
        return float("inf")
    score = _score(smaller, threshold, describe)
    return float("inf") if score is None else score - whole
