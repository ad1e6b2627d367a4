"""Intervals by likelihood: how far an effect may go before the fit with all else free is worse.

An effect and the coefficients near it may trade along a curve, with a second minimum as good as the
first; what a fit looks like close to its minimum then says too little.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from fish_env.diagnosis.steady.fitting import (
    SteadyFit,
    fit_near,
    objective_at,
)
from fish_env.diagnosis.steady.freedoms import freedoms_of
from fish_env.diagnosis.steady.orbit import Orbits
from fish_env.identification.problem import Point

WORSE = float(chdtri(1, 0.05))
BETTER = 0.1
"""A fit whose objective is lower by less is the same fit."""
FIRST, GROWTH = 2.2, 1.5
"""First step in standard deviations, just beyond a normal interval, and how much longer each is
than the one before."""
MOST_STEPS = 8
NARROW, CLOSE = 0.1, 0.3
"""An end is settled to this share of its distance from the estimate, or this close in objective."""


class Held(NamedTuple):
    """The best fit with one parameter held."""

    value: float
    objective: float
    point: Point
    orbits: Orbits


def profiled(fit: SteadyFit) -> SteadyFit:
    """The fit with likelihood intervals of its effects' parameters.

    Where the search comes upon a better minimum, the fit moves there. Source: Bates and Watts
    (1988), Nonlinear Regression Analysis, section 6.1.
    """
    ends = {}
    for path in (freedom.path for freedom in freedoms_of(fit.problem, fit.effects)):
        seen = [*_outwards(fit, path, -1.0)[::-1], *_outwards(fit, path, 1.0)]
        best = min(seen, key=lambda held: held.objective)
        if best.objective < fit.objective - BETTER:
            return profiled(fit_near(fit, best.point, best.orbits))
        ends[path] = (_end(fit, path, seen), _end(fit, path, seen[::-1]))
    return replace(fit, profiles=ends)


def _outwards(fit: SteadyFit, path: str, side: float) -> list[Held]:
    """Fits with the parameter held further and further out, until one is worse or at the bound."""
    i = fit.names.index(path)
    bound = fit.bounds(path)[0 if side < 0.0 else 1]
    step = FIRST * float(np.sqrt(fit.covariance[i, i]))
    seen = [Held(float(fit.estimates[i]), fit.objective, fit.point, fit.orbits)]
    while len(seen) <= MOST_STEPS and seen[-1].objective < fit.objective + WORSE:
        value = side * min(side * (seen[-1].value + side * step), side * bound)
        if value == seen[-1].value:
            break
        seen.append(_held(fit, path, value, seen[-1]))
        step *= GROWTH
    return seen


def _held(fit: SteadyFit, path: str, value: float, near: Held) -> Held:
    return Held(value, *objective_at(fit, path, value, (near.point, near.orbits)))


def _end(fit: SteadyFit, path: str, seen: list[Held]) -> float:
    """Where the objective passes WORSE between the first two of the fits."""
    outside, inside = seen[0], seen[1]
    if outside.objective < fit.objective + WORSE:
        return outside.value
    middle = float(fit.estimates[fit.names.index(path)])
    while abs(outside.value - inside.value) > NARROW * abs(outside.value - middle):
        trial = _held(fit, path, _crossing(fit, inside, outside), inside)
        if abs(trial.objective - fit.objective - WORSE) < CLOSE:
            return trial.value
        if trial.objective < fit.objective + WORSE:
            inside = trial
        else:
            outside = trial
    return 0.5 * (outside.value + inside.value)


def _crossing(fit: SteadyFit, inside: Held, outside: Held) -> float:
    """Where the objective passes WORSE if its root is straight; half way where motion is lost."""
    low, high, level = np.sqrt(
        np.maximum([inside.objective - fit.objective, outside.objective - fit.objective, WORSE], 0)
    )
    share = (level - low) / (high - low) if np.isfinite(high) else 0.5
    return float(inside.value + np.clip(share, 0.1, 0.9) * (outside.value - inside.value))
