"""Causes that an explanation can do without."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from fish_env.inference.estimate.fit import Fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import PARAMETER, PREFIX
from fish_env.inference.policy import POLICY
from fish_env.inference.search import without


def backward_elimination(current: Explanation) -> Explanation:
    """The explanation without causes that later ones made unnecessary.

    Also without any cause whose interval, beside the others, contains its neutral value: the
    evidence takes the residuals for white, the interval does not. Of a single cause that is the
    only question, for its evidence has just been found enough.
    """
    alone = len(current.causes) == 1
    for name in current.causes:
        doubtful = may_not_act(current.fit, name)
        if alone and not doubtful:
            return current
        smaller = without(current, name)
        if smaller and (doubtful or smaller.score < current.score + POLICY.evidence_doubt):
            return backward_elimination(smaller)
    return current


def may_not_act(fit: Fit, name: str) -> bool:
    """Whether the 95 % region of what switches a cause on holds the values at which it is off.

    The region is corrected for coloured residuals. What is off at infinity acts at any finite
    value.
    """
    if name in fit.effects:
        switching = fit.problem.known[name].switching
        off = {f"{PREFIX}{name}.{p.name}": p.neutral for p in switching}
    else:
        path = name.removeprefix(PARAMETER)
        off = {path: float(fit.problem.baseline.mean[fit.problem.baseline.paths.index(path)])}
    if not np.isfinite(list(off.values())).all():
        return False
    at = [fit.names.index(path) for path in off]
    gap = fit.estimates[at] - np.array(list(off.values()))
    distance = gap @ np.linalg.solve(fit.covariance[np.ix_(at, at)], gap)
    return bool(distance < chdtri(len(at), 0.05))
