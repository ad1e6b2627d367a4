"""Explanations that the runs cannot tell from the best one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.special import stdtrit

from fish_env.inference.adequacy import implausible_estimates
from fish_env.inference.explanation import Explanation, swap_between
from fish_env.inference.hypotheses import CauseId, Coefficient
from fish_env.inference.left_out import left_out_scores
from fish_env.inference.limits import limit_of
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem
from fish_env.inference.projection import Projector
from fish_env.inference.screening import Screen
from fish_env.inference.switched_off import may_not_act


def rivals_of(best: Explanation, others: Iterable[Explanation]) -> tuple[Explanation, ...]:
    """Those of other explanations that the runs cannot tell from the best one."""
    return tuple(e for e in others if alike(best, e) and _is_another(best, e))


def told_apart_among_small_errors(
    found: Sequence[Explanation],
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The best of some explanations and its rivals, all other effects acting a little.

    As :func:`rivals_of`, and what the best one explains more than a rival such errors may make up
    for.

    Args:
        found: explanations that differ in a cause or two.
    """
    gains = gains_by_small_errors(found)
    scores = [e.score - gain for e, gain in zip(found, gains, strict=True)]
    order = np.argsort(scores).tolist()
    best, least = found[order[0]], scores[order[0]]
    others = [(found[i], scores[i] - least) for i in order[1:]]
    return best, tuple(
        e
        for e, gap in others
        if (_is_small(best, e, gap) or alike(best, e)) and _is_another(best, e)
    )


def gains_by_small_errors(found: Sequence[Explanation]) -> list[float]:
    """What small errors of all effects that no explanation differs in gain beside each of them.

    Else what one lacks of another would come back as a small error.
    """
    effects = [{*e.fit.effects} for e in found]
    apart = set().union(*effects) - effects[0].intersection(*effects)
    return [e.small_errors.gain(without=apart) for e in found]


def _is_another(best: Explanation, other: Explanation) -> bool:
    """Whether another explanation says something else than the best one, and is plausible."""
    return not (
        same_causes(best.fit.problem, best.causes, other.causes)
        or implausible_estimates(other.fit)
        or _is_at_limit(best, other)
    )


def _is_at_limit(best: Explanation, other: Explanation) -> bool:
    """Whether another explanation has the best one as its limit, and may not be beside it.

    A servo of a torque without end has a largest rate and nothing else: if the data do not show an
    end, the simpler effect says all that they do.
    """
    swap = swap_between(best, other)
    if swap is None:
        return False
    (cause, stand_in), own = swap, other.fit
    return limit_of(own, stand_in) == cause and may_not_act(own, stand_in)


def ranked(found: Iterable[Explanation]) -> list[Explanation]:
    """Explanations, best first.

    Of those that the evidence cannot tell from the best, one with plausible estimates leads: where
    an estimate is implausible, something similar acts instead.
    """
    best, *others = sorted(found, key=lambda e: e.score)
    if implausible_estimates(best.fit):
        sober = [e for e in others if not implausible_estimates(e.fit) and as_likely(best, e)]
        if sober:
            return [sober[0], best, *(e for e in others if e is not sober[0])]
    return [best, *others]


def tied(best: Explanation, other: Explanation) -> bool:
    """Whether the evidence for two explanations is the same, whatever the colour of the residuals.

    If it is not, a further missing cause may hide the difference: that cause is sought first.
    """
    return other.score - best.score < POLICY.evidence_doubt


def explained_away(cause: CauseId, before: Screen, after: Screen) -> bool:
    """Whether a cause lost most of its evidence when another was accepted.

    If it did not, the two explain different parts of the data: it is a further cause, no rival.
    """
    evidence = {s.cause.id: s.statistic for s in before.best()}
    left = {s.cause.id: s.statistic for s in after.best()}
    return left.get(cause, 0.0) < 0.5 * evidence.get(cause, np.inf)


def alike(best: Explanation, other: Explanation) -> bool:
    """Whether two explanations cannot be told apart on these runs.

    They are alike when the evidence differs by less than ``evidence_doubt``, counted as the screen
    counts it: with coloured residuals, divided by the variance inflation of the difference. They
    are alike too when the runs do not agree on which predicts better: what one run gains by an
    explanation that others lose by is an error of that run's, of which the evidence knows nothing.
    """
    return as_likely(best, other) or not agreed(best, other)


def as_likely(best: Explanation, other: Explanation) -> bool:
    """Whether the evidence for two explanations differs too little to tell them apart."""
    return _is_small(best, other, other.score - best.score)


def as_likely_among_small_errors(best: Explanation, other: Explanation) -> bool:
    """As :func:`as_likely`, or if all other effects may act a little."""
    if as_likely(best, other):
        return True
    gains = gains_by_small_errors([best, other])
    return _is_small(best, other, other.score - gains[1] - best.score + gains[0])


def _is_small(best: Explanation, other: Explanation, gap: float) -> bool:
    """Whether a difference in evidence is small beside the colour of what tells two apart."""
    left, there = best.fit.linearised.residuals, other.fit.linearised.residuals
    apart = (there - left)[:, None]
    noise = left - apart[:, 0] * (apart[:, 0] @ left) / max(float(apart[:, 0] @ apart[:, 0]), 1e-12)
    inflation = Projector(best.fit).variance_inflation(apart, noise)
    return bool(gap < POLICY.evidence_doubt * inflation)


def agreed(best: Explanation, other: Explanation) -> bool:
    """Whether the runs agree that the best explanation predicts them better, each left out in turn.

    They do if each of them by itself is strong evidence for it, else by Student's t of the
    differences of their log scores: one run in which the other explanation fails by far makes t
    small. Fewer runs than make an interval always agree, and those that err by their noise alone:
    the evidence has counted that. Source: Vehtari, Gelman and Gabry (2017), Statistics and
    Computing 27, section 5.1, with runs in the place of samples.
    """
    problem = best.fit.problem
    if problem.run_count < POLICY.fewest_runs_for_interval or problem.noise_is_of_runs:
        return True
    gains = left_out_scores(best) - left_out_scores(other)
    if gains.min() > 0.5 * POLICY.evidence_doubt:
        return True
    error = float(gains.std(ddof=1) / np.sqrt(len(gains)))
    return bool(gains.mean() > stdtrit(len(gains) - 1, 1.0 - POLICY.disagreement) * error)


def same_causes(problem: Problem, causes: Sequence[CauseId], others: Sequence[CauseId]) -> bool:
    """Whether two explanations say the same, one cause after the other."""
    if len(causes) != len(others):
        return False  # two causes were one taken apart, or one of them was there already
    return all(a == b or same(problem, a, b) for a, b in zip(causes, others, strict=True))


def same(problem: Problem, cause: CauseId, other: CauseId) -> bool:
    """Whether two causes say the same in other words.

    Args:
        problem: knows effects, and coefficients that act alike.
        cause: one of them.
        other: the other.
    """
    if {cause, other} in problem.interchangeable:
        return True
    pairs = ((cause, other), (other, cause))
    return any(
        not isinstance(a, Coefficient) and isinstance(b, Coefficient)
        and b.path in problem.known[a].equals
        for a, b in pairs
    )  # fmt: skip
