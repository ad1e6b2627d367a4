"""Bubbles: air that clings to the hull or is caught in it, above O_b."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Vector
from fish_env.model.tail import wrench_at

TOP = -0.03
"""m (body, downwards). Where air gathers: on the back of a hull some 6 cm high."""
AIR_DEPTH = 10.3
"""m. Depth of water that doubles the pressure at the surface."""


@kernel
def lift(motion, tail, inputs, centre, fish, e):
    """-mass g / (1 + z / 10.3 m) down at (x, 0, -0.03 m); above z = 0 as at the surface."""
    weight = e.mass * fish.gravity / (1.0 + max(motion.z, 0.0) * (1.0 / AIR_DEPTH))
    at = motion.attitude
    return wrench_at(e.x, 0.0, TOP, Vector(-weight * at.zx, -weight * at.zy, -weight * at.zz))


EFFECT = Effect(
    name="bubbles",
    section="surroundings",
    summary="Trapped air lifts the fish where it sits, more so at a shallow depth.",
    equation="F = -mass g / (1 + z / 10.3 m) down, M = r x F, r = (x, 0, -0.03 m)",
    source="Archimedes' principle and Boyle's law; the mass of the air is left out",
    parameters=(
        EffectParameter(
            "mass", "kg", 0.0, 0.0, 0.5, (0.001, 0.01), "water that the air displaces at z = 0"
        ),
        EffectParameter(
            "x", "m", 0.0, -0.3, 0.3, (-0.06, 0.06), "where it sits, ahead of O_b", shapes=True
        ),
    ),
    hooks={"wrench": lift},
    confusable_with=(
        "buoyancy_offset",
        "com_offset",
        "hull_compression",
    ),
)
