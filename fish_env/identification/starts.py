"""Where to begin: Gauss-Newton finds the nearest minimum, which need not be the right one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.identification.series import SeriesProblem
from fish_env.inference.estimate.fit import objective_at
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.model.effect import Effect

SHARES = (0.1, 0.4, 1.0)
"""Where in the plausible range of a parameter a start may lie."""
RUNS = 3


def likely_start(problem: SeriesProblem, effects: Sequence[str]) -> Point:
    """The likeliest of some points over the plausible range of each effect, one effect at a time.

    Args:
        problem: some of its runs are judged with nominal coefficients.
        effects: effects that will be free.
    """
    few, noise = problem.subset(RUNS), problem.default_noise()
    best = Point(np.zeros(len(problem.baseline)), problem.neutral(effects))
    for name in effects:
        points = [best, *(_moved(best, problem.known[name], share) for share in SHARES)]
        points += [_moved(best, problem.known[name], -share) for share in SHARES]
        best = min(points, key=lambda point: objective_at(few, effects, point, noise))
    return best


def _moved(point: Point, effect: Effect, share: float) -> Point:
    """A point with an effect at a share of its plausible range, downwards where it is negative."""
    values = dict(point.effects)
    for p in effect.parameters:
        low, high = p.plausible
        if np.isfinite(p.neutral):
            value = p.neutral + share * (high - p.neutral)
            if share < 0:
                value = p.neutral - share * (low - p.neutral)
        else:
            value = low + (high - low) * (1.0 - abs(share))
        values[EffectParameterId(effect.name, p.name)] = float(np.clip(value, p.lower, p.upper))
    return Point(point.z, values)
