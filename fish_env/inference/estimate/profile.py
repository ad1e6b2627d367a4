"""Intervals by likelihood: how far an effect may go before the fit with all else free is worse.

An effect and the coefficients near it may trade along a curve, with a second minimum as good as the
first; what a fit looks like close to its minimum then says too little. Source: Bates and Watts
(1988), Nonlinear Regression Analysis, section 6.1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from fish_env.inference.estimate.fit import Fit, fit, gauss_newton
from fish_env.inference.estimate.free import Free, objective_with
from fish_env.inference.estimate.information import information
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.evaluation import Evaluation
from fish_env.inference.hypotheses import EffectParameterId, ParameterId
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point

BETTER = 0.1
"""A fit whose objective is lower by less is the same fit."""
FIRST, GROWTH = 2.2, 1.5
"""First step in standard deviations, just beyond a normal interval, and how much longer each is
than the one before."""
MOST_STEPS = 8
NARROW, CLOSE = 0.1, 0.3
"""An end is settled to this share of its distance from the estimate, or this close in objective."""
STEPS, TOLERANCE = 12, 0.3


class Held(NamedTuple):
    """The best fit with one parameter held.

    Attributes:
        value: where it is held.
        objective: reached, infinite where the simulation diverges.
        point: all parameters.
        filtered: evaluation at the point.
    """

    value: float
    objective: float
    point: Point
    filtered: Sequence[Evaluation]


@dataclass(frozen=True)
class Profile:
    """The objective along one parameter, all else fitted again.

    Attributes:
        refit: the best fit with the parameter held at a value, from one held close by.
        start: the fit itself.
        sd: standard deviation of the parameter.
        bounds: lowest and highest value.
        worse: by how much the objective grows at the ends of the interval.
    """

    refit: Callable[[float, Held], Held]
    start: Held
    sd: float
    bounds: tuple[float, float]
    worse: float

    def seen(self) -> list[Held]:
        """Fits from beyond the lower end to beyond the upper one, in order."""
        return [*self._outwards(-1.0)[::-1], *self._outwards(1.0)]

    def interval(self, seen: Sequence[Held]) -> tuple[float, float]:
        """The two ends.

        Args:
            seen: fits in order.
        """
        return self._end(seen), self._end(seen[::-1])

    def _outwards(self, side: float) -> list[Held]:
        """Fits with the parameter further and further out, until one is worse or at the bound."""
        bound = self.bounds[0 if side < 0.0 else 1]
        step = FIRST * self.sd
        seen = [self.start]
        while len(seen) <= MOST_STEPS and seen[-1].objective < self._limit:
            value = side * min(side * (seen[-1].value + side * step), side * bound)
            if value == seen[-1].value:
                break
            seen.append(self.refit(value, seen[-1]))
            step *= GROWTH
        return seen

    @property
    def _limit(self) -> float:
        return self.start.objective + self.worse

    def _end(self, seen: Sequence[Held]) -> float:
        """Where the objective passes the limit between the first two of the fits."""
        outside, inside = seen[0], seen[1]
        if outside.objective < self._limit:
            return outside.value
        while abs(outside.value - inside.value) > NARROW * abs(outside.value - self.start.value):
            trial = self.refit(self._crossing(inside, outside), inside)
            if abs(trial.objective - self._limit) < CLOSE:
                return trial.value
            if trial.objective < self._limit:
                inside = trial
            else:
                outside = trial
        return 0.5 * (outside.value + inside.value)

    def _crossing(self, inside: Held, outside: Held) -> float:
        """Where the objective passes the limit if its root is straight; half way where infinite."""
        over = [held.objective - self.start.objective for held in (inside, outside)]
        low, high, level = np.sqrt(np.maximum([*over, self.worse], 0.0))
        share = (level - low) / (high - low) if np.isfinite(high) else 0.5
        return float(inside.value + np.clip(share, 0.1, 0.9) * (outside.value - inside.value))


def profiled(own: Fit) -> Fit:
    """The fit with likelihood intervals of its effects' parameters.

    Where the search comes upon a better minimum, the fit moves there. Coloured residuals widen
    these intervals as they widen normal ones.
    """
    ends: dict[ParameterId, tuple[float, float]] = {}
    for freedom in own.problem.freedoms(own.effects):
        profile = profile_of(own, freedom.id, (freedom.lower, freedom.upper))
        seen = profile.seen()
        best = min(seen, key=lambda held: held.objective)
        if best.objective < profile.start.objective - BETTER:
            return profiled(_moved(own, best.point))
        ends[freedom.id] = profile.interval(seen)
    return replace(own, profiles=ends)


def profile_of(own: Fit, parameter: EffectParameterId, bounds: tuple[float, float]) -> Profile:
    """The objective of a fit along one parameter of an effect.

    Args:
        own: the fit; its noise is kept.
        parameter: the parameter.
        bounds: lowest and highest value.
    """
    i = own.ids.index(parameter)
    free = Free(own.problem, own.effects, own.released)
    white = np.linalg.inv(information(own.linearised.slopes, free.prior))[i, i]
    widened = float(own.covariance[i, i] / white)
    start = Held(float(own.estimates[i]), _followed(own, free), own.point, own.filtered)
    sd = float(np.sqrt(own.covariance[i, i]))
    worse = float(chdtri(1, 1.0 - POLICY.interval_level)) * widened
    return Profile(partial(_held, own, parameter), start, sd, bounds, worse)


def _followed(own: Fit, free: Free) -> float:
    """The objective of a fit as those with a parameter held have it.

    There the runs' own numbers follow in the linear model, as far as that says.
    """
    marginal = own.linearised.marginal
    if marginal is None:
        return own.objective
    return objective_with(free, free.pack(own.point), own.filtered, marginal)


def _held(own: Fit, parameter: EffectParameterId, value: float, near: Held) -> Held:
    """The best fit with one effect's parameter held."""
    free = Free(own.problem, own.effects, own.released, {parameter: value})
    vector = free.bounds.clip(free.pack(near.point))
    try:
        found, objective, filtered = gauss_newton(
            own.problem, Slopes(free, own.noise), vector, STEPS, TOLERANCE,
            marginal=own.linearised.marginal, near=near.filtered,
        )  # fmt: skip
    except np.linalg.LinAlgError:
        return Held(value, np.inf, near.point, near.filtered)
    return Held(value, objective, free.unpack(found), filtered)


def _moved(own: Fit, point: Point) -> Fit:
    """The fit from another point, under the same noise."""
    return fit(
        own.problem, own.effects, point, own.noise, own.released,
        refit_noise=False, iterations=STEPS,
    )  # fmt: skip
