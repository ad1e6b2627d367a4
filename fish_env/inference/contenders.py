"""An explanation and others with a look-alike in the place of one of its causes, side by side.

First on a few runs, then the closest on all. Beside small errors of everything else, as what such
errors leave may be what a wrong look-alike explains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fish_env.inference.estimate.coarse_fit import CoarseFit, where_ended
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation, reached
from fish_env.inference.hypotheses import CauseId, EffectName, listed, name_of
from fish_env.inference.in_place import in_step
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Problem
from fish_env.inference.progress import Report
from fish_env.inference.rivals import gains_by_small_errors, told_apart_among_small_errors
from fish_env.inference.search import at_noise


@dataclass(frozen=True, eq=False)
class Swap:
    """A look-alike in the place of a cause.

    Attributes:
        cause: the cause.
        other: what looks like it.
        begin: where a fit with that begins, or has led.
        lack: what it explains less than the cause and small errors may make up for, in -2 log
            likelihood.
    """

    cause: CauseId
    other: EffectName
    begin: CoarseFit
    lack: float = 0.0


def asked(
    runs: Problem,
    current: Explanation,
    swaps: Sequence[Swap],
    steps: int,
    leeway: float,
    report: Report,
) -> tuple[Explanation, tuple[Explanation, ...]]:
    """The best of an explanation and those with look-alikes in it, and those as good.

    Args:
        runs: those of the explanation, in the steps to compare in.
        current: causes with their fit; where it was made in other steps it does not compete.
        swaps: what to try.
        steps: most Gauss-Newton steps of each fit.
        leeway: by how much the objective of a rival may be larger. Of residuals with a colour the
            evidence tells less than their objectives do.
        report: told what is being done.
    """
    own, found = current.fit, list[Explanation]()
    coarse = runs is not own.problem
    enough = np.inf if coarse else own.objective + leeway
    closest = _closest(runs, current, swaps, steps, leeway, report)
    for swap in closest[: POLICY.most_lookalikes]:
        causes = current.causes_with(swap.other, swap.cause)
        report(f"fitting {listed(causes, ' and ')}")
        whole = fitted_without(runs, own, swap.cause, swap.begin, steps, enough + swap.lack)
        if whole is not None and whole.objective < enough + swap.lack:
            found.append(Explanation(causes, whole))
    if not found:
        return current, ()
    best, rivals = told_apart_among_small_errors(found if coarse else [current, *found])
    return best, () if coarse else rivals


def _closest(
    runs: Problem,
    current: Explanation,
    swaps: Sequence[Swap],
    steps: int,
    leeway: float,
    report: Report,
) -> list[Swap]:
    """Those whose look-alike explains as much in a few runs, with its fit to these, best first.

    Each among small errors. See :func:`asked`.
    """
    own, few = current.fit, runs.subset(POLICY.few_runs)
    share = few.run_count / runs.run_count
    usual = at_noise(few, own, own.noise, steps) if swaps else None
    enough = usual.objective + POLICY.out_of_reach * share if usual else np.inf
    known, tried = [Explanation(current.causes, usual)] if usual else [], []
    for swap in swaps:
        report(f"trying {swap.other} instead of {name_of(swap.cause)}")
        fitted = fitted_without(few, own, swap.cause, swap.begin, steps, enough)
        if fitted is not None:
            causes = current.causes_with(swap.other, swap.cause)
            tried.append((swap, Explanation(causes, fitted)))
    if not tried:
        return []
    found, first = [*known, *(e for _, e in tried)], len(known)
    gains = gains_by_small_errors(found)
    left = [e.fit.objective - gain for e, gain in zip(found, gains, strict=True)]
    near = min(left) + leeway * share
    ranked = sorted(zip(left[first:], gains[first:], tried, strict=True), key=lambda one: one[0])
    return [
        replace(swap, begin=where_ended(e.fit), lack=max(gain - gains[0], 0.0) / share)
        for value, gain, (swap, e) in ranked
        if value < near
    ]


def fitted_without(
    runs: Problem, own: Fit, cause: CauseId, begin: CoarseFit, steps: int, enough: float
) -> Fit | None:
    """A fit without a cause under the same noise; None where the simulation diverges.

    It is given up where no step will lead below an objective.
    """
    kept = reached(partial(in_step, runs, own, cause, begin))
    if kept is None:
        return None
    return at_noise(kept, begin, own.noise, steps, enough)
