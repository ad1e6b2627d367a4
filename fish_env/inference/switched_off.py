"""Where causes are off, how far estimates are from there, and what follows in the linear model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import chdtri

from fish_env.arrays import FloatArray
from fish_env.inference.estimate.coarse_fit import CoarseFit
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import Free
from fish_env.inference.estimate.information import gradient, information
from fish_env.inference.hypotheses import (
    CauseId,
    Coefficient,
    EffectName,
    EffectParameterId,
    ParameterId,
)
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point


def may_not_act(fit: Fit, cause: CauseId) -> bool:
    """Whether the 95 % region of what switches a cause on holds the values at which it is off.

    The region is corrected for coloured residuals.
    """
    off = off_values(fit, cause)
    return bool(from_off(fit, off) < chdtri(len(off), POLICY.interval_error))


def from_off(fit: Fit, off: Mapping[ParameterId, float]) -> float:
    """Squared distance of estimates from where a cause is off, in standard errors."""
    at = [fit.ids.index(id) for id in off]
    gap = fit.estimates[at] - np.array(list(off.values()))
    return distance(gap, fit.covariance[np.ix_(at, at)])


def distance(gap: FloatArray, covariance: FloatArray) -> float:
    """Square of a distance (k,) in standard errors."""
    return float(gap @ np.linalg.solve(covariance, gap))


def off_values(fit: Fit, cause: CauseId) -> dict[ParameterId, float]:
    """Values of what switches a cause on, at which it is off in the linear model.

    What is off at infinity acts by its inverse, such as the time of a lag: that of a value v is
    zero, to first order, at 2 v.
    """
    if isinstance(cause, Coefficient):
        baseline = fit.problem.baseline
        return {cause: float(baseline.mean[baseline.ids.index(cause)])}
    switching = fit.problem.known[cause].switching
    neutral = {EffectParameterId(cause, p.name): p.neutral for p in switching}
    return {
        id: off if np.isfinite(off) else 2.0 * float(fit.estimates[fit.ids.index(id)])
        for id, off in neutral.items()
    }


def where_others_follow(own: Fit, begin: CoarseFit) -> Point:
    """Where a fit without some causes ends in the linear model of the fit with them.

    Args:
        own: fit with the causes.
        begin: what is free without them, and their values in it.
    """
    free, lin = Free(own.problem, begin.effects, begin.released), own.linearised
    kept = {id: own.ids.index(id) for id in free.ids}
    off = {
        id: value
        for name in own.effects
        if name not in begin.effects
        for id, value in off_values(own, EffectName(name)).items()
    }
    gone = [own.ids.index(id) for id in off]
    shift = np.array(list(off.values())) - own.estimates[gone]
    vector, slopes = free.pack(begin.point), lin.slopes[:, [kept[id] for id in free.ids]]
    residuals = lin.residuals + lin.slopes[:, gone] @ shift
    hessian = information(slopes, free.prior)
    pull = gradient(slopes, residuals, free.prior, vector)
    step = free.bounds.beside(vector).step(hessian, pull, vector)
    return free.unpack(free.bounds.clip(vector + step))
