"""Forces of no particular origin, as the motion of whole simulated runs suggests them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Filtered
from fish_env.identification.generic_forces import BoundForces, generic_forces
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.series import SeriesProblem
from fish_env.identification.whole_runs.own_numbers import OwnNumbers
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point

BLIND_SD = 1e9
"""Sensor noise (SI) with which a filter corrects nothing."""


def forces_of(
    fit: Any,
    series: SeriesProblem,
    kinds: Sequence[OwnNumbers],
    own: Sequence[FloatArray],
    scale: EffectParameterId,
) -> BoundForces:
    """Forces and moments that depend on simulated motion, attitude, time, beat or commands.

    Args:
        fit: to whole runs.
        series: its runs.
        kinds: what the own numbers of each run are.
        own: of each run, (K,).
        scale: effect parameter that multiplies the commanded tail frequency.
    """
    blind = NoiseModel(np.full(len(series.channels), BLIND_SD), 1e-9, 1e-9, 1.0)
    found: list[Filtered] = []
    for i, (kind, values) in enumerate(zip(kinds, own, strict=True)):
        run = series.runs[i]
        state0 = kind.states(run, values[:, None])[:, 0]
        pace = float(kind.pace(values[:, None])[0])
        effects = {**fit.point.effects, scale: pace * fit.point.effects[scale]}
        alone = series.with_runs([replace(run, state0=state0, as_measured=False)])
        found += alone.filtered(Point(fit.point.z, effects), blind)
    return BoundForces(fit, generic_forces(series.runs, found, series.channels))
