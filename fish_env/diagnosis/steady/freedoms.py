"""Free numbers of effects in a fit to a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.effects.extended import PREFIX
from fish_env.identification.parameters import least_followed

REACH = 3.0
"""How many times its plausible departure an effect may be off."""


@dataclass(frozen=True)
class Freedom:
    """A free number of a fit, in units of its own.

    Attributes:
        path: of a coefficient, or ``effects.<name>.<parameter>``.
        lower, upper: bounds.
        unit: natural size of a change.
    """

    path: str
    lower: float
    upper: float
    unit: float


def freedoms_of(problem: SteadyProblem, effects: Sequence[str]) -> list[Freedom]:
    """Free numbers of effects: within physical bounds and some times what is plausible."""
    found = []
    for name in effects:
        effect = problem.known[name]
        for p in effect.parameters:
            low, high = p.plausible
            if np.isfinite(p.neutral):
                away = REACH * max(abs(low - p.neutral), abs(high - p.neutral))
                lower, upper = max(p.lower, p.neutral - away), min(p.upper, p.neutral + away)
            else:
                lower, upper = max(p.lower, low / REACH), min(p.upper, high * REACH)
            lower = max(lower, least_followed(effect, p, problem.dt))
            found.append(Freedom(f"{PREFIX}{name}.{p.name}", lower, upper, 0.25 * (high - low)))
    return found
