"""Which causes to try next, by what the screen makes of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.inference.hypotheses import CauseId, Coefficient
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem
from fish_env.inference.projection import Signal
from fish_env.inference.screening import Screen


def shortlisted(
    problem: Problem,
    screen: Screen,
    count: int,
    relaxed_log_p: float = 0.0,
    found: int = 0,
) -> list[Signal]:
    """The most significant causes, and among the others those known to look like the first.

    Effects and coefficients are two lists: what the tests of the two make of a large misfit does
    not compare. A strong effect is screened far from where it is, so its place among its like
    means little.

    Args:
        problem: what is fitted.
        screen: all causes against the present explanation.
        count: how many effects to try.
        relaxed_log_p: added to the log p-value that makes a cause significant.
        found: coefficients in the present explanation.
    """
    strong = screen.best()
    effects = [
        s for s in strong if s.cause.is_effect and s.log_p < screen.threshold + relaxed_log_p
    ]
    lifted = [s for s in strong if not s.cause.is_effect]
    enough = threshold_of_coefficients(screen, found, relaxed_log_p)
    coefficients = [s for s in lifted if s.log_p < enough]
    first = problem.known[effects[0].cause.effect] if effects else None
    alike = set(first.confusable_with) if first else set()
    like_first = [s for s in effects[count:] if s.cause.id in alike]
    return [
        *effects[:count],
        *like_first,
        *coefficients[: max(1, int(POLICY.coefficients_per_effect * count))],
    ]


def threshold_of_coefficients(screen: Screen, found: int, relaxed_log_p: float = 0.0) -> float:
    """Log p-value that makes a coefficient significant.

    The first has to stand out among all causes. A parameter file that is wrong in one place is
    often wrong in several, so the next ones are judged among coefficients alone, and the share of
    false names is bounded (Benjamini and Hochberg, 1995).

    Args:
        screen: all causes against the present explanation.
        found: coefficients in it.
        relaxed_log_p: added to it.
    """
    if not found:
        return screen.threshold + relaxed_log_p
    count = sum(not s.cause.is_effect for s in screen.signals) + found
    among_alike = float(np.log(screen.level * (found + 1) / count))
    return max(screen.threshold, among_alike) + relaxed_log_p


def newly_shown(after: Screen, chosen: Sequence[Signal]) -> list[Signal]:
    """Effects that the first screen had not shown: the misfit then hid them."""
    known = {s.cause.id for s in chosen}
    leading = [s for s in after.best() if s.log_p < after.threshold and s.cause.is_effect]
    return [s for s in leading if s.cause.id not in known][: POLICY.most_newly_shown]


def like(
    winner: CauseId, before: Screen, chosen: Sequence[Signal], problem: Problem
) -> list[Signal]:
    """Effects known to look like the winner, whatever the screen made of them."""
    if isinstance(winner, Coefficient):
        return []
    alike = set(problem.known[winner].confusable_with)
    known = {winner, *(s.cause.id for s in chosen)}
    return [s for s in before.best() if s.cause.id in alike - known]
