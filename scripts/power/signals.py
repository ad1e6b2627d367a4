"""Whether an effect's signal, as the diagnosis simulates it, is in the data when the effect is.

Two data sets of one design share all of their noise; one has the effect, the other has not. The
difference of their residuals, which another implementation of the physics makes, should be what
the filter predicts. What a refit follows is taken off both.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from threadpoolctl import threadpool_limits

from fish_env.data import Dataset
from fish_env.diagnosis.pipeline import fitted_and_final
from fish_env.identification.series import SeriesProblem
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.hypotheses import EffectName, EffectParameterId
from fish_env.inference.probes import Cause, effect_values
from fish_env.inference.projection import Projector
from scripts.power.looks import Target, Values, measured
from tests.hidden.records import LIBRARY
from tests.hidden.sizes import SIZES

NOISE_NUMBER = 999


def agreement(design: int, published: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """effect.parameter -> cosine of the two signals, and the share of one that is in the other.

    Left out are effects that are off at infinity and those without a signal in either.
    """
    with threadpool_limits(1, "blas"):
        still = problem_of(design, {})
        base = fit(still, rounds=2)
        found = {}
        for name, size in published.items():
            target = Target(*name.split("."))
            if np.isfinite(LIBRARY[target.effect][target.parameter]):
                pair = compared(base, design, target, size)
                if pair is not None:
                    found[name] = pair
    return found


def problem_of(design: int, effects: Values) -> SeriesProblem:
    """The runs of a design that a diagnosis would fit, with some effects."""
    dataset: Dataset = measured(design, NOISE_NUMBER, "nominal", effects)[0]
    return SeriesProblem(dataset, None, fitted_and_final(dataset, design)[0])


def compared(base: Fit, design: int, target: Target, size: float) -> dict[str, float] | None:
    """The signal that is expected and the one that is there."""
    (values,) = target.values(size).values()
    shapes = SIZES[target.effect].shape or {}
    values |= {name: 0.5 * (low + high) for name, (low, high) in shapes.items()}
    before = innovations(base, base.problem, {})
    there = innovations(base, problem_of(design, {target.effect: values}), {}) - before
    expected = innovations(base, base.problem, effect_values(base.problem, target.effect, values))
    projector, cause = Projector(base), Cause(EffectName(target.effect))
    mine = projector.signal(cause, 0, (expected - before)[:, None])
    theirs = projector.signal(cause, 0, -there[:, None])
    if mine is None or theirs is None:
        return None
    shared = -float(mine.left[:, 0] @ there)
    energies = float(mine.projected[0, 0]), float(theirs.projected[0, 0])
    return {
        "cosine": shared / float(np.sqrt(energies[0] * energies[1])),
        "share": shared / energies[0],
    }


def innovations(
    base: Fit, problem: SeriesProblem, effects: Mapping[EffectParameterId, float]
) -> np.ndarray:
    """Whitened residuals of some runs at a fit, with its gains."""
    lanes = {id: np.array([value]) for id, value in effects.items()}
    return problem.innovations(base.point.z[:, None], lanes, base.noise, base.filtered)[0]
