"""Known causes beside something unknown: which of them act, although the model stays inadequate.

A force that no known cause exerts is often imitated by one that does. Such an imitation is not
needed once an empirical model of the residual, a sum of generic forces, may stand in for it. A
cause that acts is: without it, no such sum explains the data as well.
"""

from __future__ import annotations

from collections.abc import Callable

from fish_env.inference.adequacy import implausible_estimates
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import PARAMETER
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem
from fish_env.inference.result import ResidualModel
from fish_env.inference.search import without

Describe = Callable[[Fit, float, Problem | None], ResidualModel | None]
"""Models what a fit leaves: the fit, the log p-value that a term has to pass, runs to judge on."""


def confirmed(accepted: Explanation, threshold: float, describe: Describe) -> Explanation | None:
    """The explanation with those of its causes that no sum of generic forces can stand in for.

    What is left may be a disturbance of implausible strength: it is estimated with the rest, and
    the evidence for a cause is counted beside it.

    Args:
        accepted: causes that explain part of the data.
        threshold: log p-value that a generic force has to pass.
        describe: models what a fit leaves.

    Returns:
        The causes that are left with their fit; None where none is.
    """
    while accepted.causes:
        weakest = _implausible(accepted)
        if weakest is None:
            whole = _score(accepted, threshold, describe)
            gaps = {n: _gap(accepted, n, whole, threshold, describe) for n in accepted.causes}
            weakest = min(gaps, key=lambda name: gaps[name])
            if gaps[weakest] >= POLICY.evidence_doubt:
                return accepted
        smaller = without(accepted, (weakest,))
        if smaller is None:
            return None
        accepted = smaller
    return None


def _implausible(accepted: Explanation) -> str | None:
    """The first cause whose estimate is implausible; None if none is."""
    words = implausible_estimates(accepted.fit)
    blamed = (name for name in accepted.causes if any(_is_of(name, word) for word in words))
    return next(blamed, None)


def _is_of(cause: str, word: str) -> bool:
    return word.split(" ")[0] in (cause, cause.removeprefix(PARAMETER))


def _score(explanation: Explanation, threshold: float, describe: Describe) -> float:
    """-2 log evidence with the empirical model of the residual in place."""
    model = describe(explanation.fit, threshold, None)
    beside = explanation.fit if model is None else model.fit
    return Explanation(explanation.causes, beside).score


def _gap(
    accepted: Explanation, name: str, whole: float, threshold: float, describe: Describe
) -> float:
    """What -2 log evidence loses without a cause, generic forces being allowed to stand in."""
    smaller = without(accepted, (name,))
    return float("inf") if smaller is None else _score(smaller, threshold, describe) - whole
