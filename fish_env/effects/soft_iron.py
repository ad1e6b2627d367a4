"""Soft iron: magnetic material near the compass distorts its heading twice per turn."""

from __future__ import annotations

import numpy as np

from fish_env.model.effect import Effect, EffectParameter


def iron(values):
    """amplitude sin(2 psi + angle) as sine and cosine of 2 psi (rad)."""
    amplitude, angle = values["amplitude"], values["angle"]
    return {"iron_sine": amplitude * np.cos(angle), "iron_cosine": amplitude * np.sin(angle)}


EFFECT = Effect(
    name="soft_iron",
    section="measurement",
    summary="The heading error changes sign four times in a full turn.",
    equation="measured yaw = psi + amplitude sin(2 psi + angle)",
    source="Quadrantal deviation of a compass: Bowditch, American Practical Navigator, chapter 6",
    parameters=(
        EffectParameter("amplitude", "rad", 0.0, 0.0, 0.5, (0.02, 0.2), "largest error"),
        EffectParameter(
            "angle", "rad", 0.0, -7.0, 7.0, (-np.pi, np.pi), "phase of the error", shapes=True
        ),
    ),
    geometry=iron,
    confusable_with=("attitude_misalignment",),
)
