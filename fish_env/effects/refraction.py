"""Refraction: in a camera above the water, a deep fish looks smaller than a shallow one."""

from __future__ import annotations

from math import inf

import numpy as np

from fish_env.model.effect import Effect, EffectParameter

INDEX = 1.333
"""Refractive index of water."""


def bent(values):
    """1 / (n height) (1/m)."""
    return {"refraction": 1.0 / (INDEX * np.asarray(values["height"], float))}


EFFECT = Effect(
    name="refraction",
    section="measurement",
    summary="Measured horizontal distances shrink with depth.",
    equation="measured (x, y) = (x, y) (height + d0/n) / (height + z/n), n = 1.333, d0 = 0.5 m",
    source="Snell's law for rays close to the vertical: apparent depth z/n; Hecht, Optics",
    parameters=(
        EffectParameter("height", "m", inf, 0.1, inf, (1.0, 5.0), "camera above the water"),
    ),
    geometry=bent,
    confusable_with=("position_scale",),
)
