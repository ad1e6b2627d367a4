"""Which parameters of effects a set of runs shows at all."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fish_env.identification.whole_runs.simulated_runs import SimulatedRuns
from fish_env.inference.effects import EffectParameter
from fish_env.inference.hypotheses import EffectParameterId

FEW_RUNS = 3
SILENT = 0.003
"""Change of every sample by a tenth of a parameter, in standard deviations of a simulation's first
noise, below which nothing shows the parameter."""


def middling(parameter: EffectParameter) -> float:
    """A size of a parameter at which its effect acts: halfway to an end of its plausible range.

    The middle of a range that lies on both sides of the neutral value would be no effect at all.
    """
    low, high = parameter.plausible
    if not low < parameter.neutral < high:
        return 0.5 * (low + high)
    return 0.5 * (parameter.neutral + parameter.far_end(parameter.neutral))


def shown_parameters(
    problem: SimulatedRuns, values: Mapping[EffectParameterId, float]
) -> set[EffectParameterId]:
    """Effect parameters whose change by a tenth changes what is measured.

    Args:
        problem: the runs.
        values: effect parameter -> value, beside nominal coefficients.
    """
    few = problem.some(problem.spread(FEW_RUNS))
    count = 1 + len(values)
    effects = {id: np.full(count, value) for id, value in values.items()}
    for i, id in enumerate(values, start=1):
        effects[id][i] *= 0.9
    z = np.zeros((len(problem.baseline), count))
    own = [np.repeat(kind.guess[:, None], count, axis=1) for kind in few.own]
    moved = np.zeros(count)
    for errors in few.errors(z, effects, own):
        away = np.abs(np.nan_to_num(errors - errors[:1]) / np.array(few.default_noise().sd))
        away = away.reshape(count, -1)
        moved = np.maximum(moved, away.max(axis=1))
    return {id for id, change in zip(values, moved[1:], strict=True) if change > SILENT}
