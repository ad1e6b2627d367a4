"""Explanations that the runs cannot tell from the best one."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fish_env.inference.adequacy import implausible_estimates
from fish_env.inference.explanation import Explanation
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import same_causes
from fish_env.inference.projection import Projector
from fish_env.inference.screening import Screen


def rivals_of(best: Explanation, others: Iterable[Explanation]) -> tuple[Explanation, ...]:
    """Those of other explanations that the runs cannot tell from the best one."""
    return tuple(
        e
        for e in others
        if alike(best, e)
        and not same_causes(best.fit.problem, best.causes, e.causes)
        and not implausible_estimates(e.fit)
    )


def tied(best: Explanation, other: Explanation) -> bool:
    """Whether the evidence for two explanations is the same, whatever the colour of the residuals.

    If it is not, a further missing cause may hide the difference: that cause is sought first.
    """
    return other.score - best.score < POLICY.evidence_doubt


def explained_away(cause: str, before: Screen, after: Screen) -> bool:
    """Whether a cause lost most of its evidence when another was accepted.

    If it did not, the two explain different parts of the data: it is a further cause, no rival.
    """
    evidence = {s.cause.name: s.statistic for s in before.best()}
    left = {s.cause.name: s.statistic for s in after.best()}
    return left.get(cause, 0.0) < 0.5 * evidence.get(cause, np.inf)


def alike(best: Explanation, other: Explanation) -> bool:
    """Whether two explanations cannot be told apart on these runs.

    They are alike when the evidence differs by less than :data:`DOUBT`, counted as the screen
    counts it: with coloured residuals, divided by the variance inflation of the difference.
    """
    gap = other.score - best.score
    left, there = best.fit.linearised.residuals, other.fit.linearised.residuals
    apart = (there - left)[:, None]
    noise = left - apart[:, 0] * (apart[:, 0] @ left) / max(float(apart[:, 0] @ apart[:, 0]), 1e-12)
    return bool(gap < POLICY.evidence_doubt * Projector(best.fit).variance_inflation(apart, noise))
