"""Tail stall: the lift of the tail falls beyond an angle of incidence.

sin(alpha - onset) replaces alpha - onset; near the onset both are equal to third order.
"""

from __future__ import annotations

import math

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.trigonometry import exponential, sincos


@kernel
def lose_lift(coefficient, sine, fish, e):
    """C_L -> C_L (1 - loss / (1 + exp(-sin(alpha - onset) / width))), alpha the incidence."""
    at, level = sincos(e.onset)
    size = abs(sine)
    cosine = math.sqrt(max(1.0 - size * size, 0.0))
    beyond = (size * level - cosine * at) / e.width
    return coefficient * (1.0 - e.loss / (1.0 + exponential(-beyond)))


EFFECT = Effect(
    name="tail_stall",
    section="hydrodynamics",
    summary="The tail loses lift at large incidence: strong strokes give less thrust.",
    equation="C_L -> C_L (1 - loss / (1 + exp(-sin(alpha - onset) / width))), alpha in [0, pi/2]",
    source="Static stall of a low-aspect-ratio plate: Hoerner, Fluid-Dynamic Lift, chapter 4",
    parameters=(
        EffectParameter("loss", "-", 0.0, 0.0, 1.0, (0.1, 0.7), "share of the lift that is lost"),
        EffectParameter(
            "onset", "rad", 0.9, 0.05, 1.5, (0.5, 1.2), "incidence at half the loss", shapes=True
        ),
        EffectParameter(
            "width",
            "rad",
            0.06,
            0.01,
            0.5,
            (0.05, 0.1),
            "width of the transition",
            shapes=True,
            probed=False,
        ),
    ),
    hooks={"tail_lift": lose_lift},
    confusable_with=(
        "tail_gain",
        "tail_reactive",
        "wake_fraction",
    ),
)
