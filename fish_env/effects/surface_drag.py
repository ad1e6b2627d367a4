"""Surface drag: near the surface the body also makes waves, which adds drag."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.trigonometry import exponential


@kernel
def raise_drag(factor, motion, fish, e):
    """Body drag x (1 + gain exp(-z/depth)); above z = 0 as at the surface."""
    return factor * (1.0 + e.gain * exponential(-max(motion.z, 0.0) / e.depth))


EFFECT = Effect(
    name="surface_drag",
    section="surroundings",
    summary="The fish is slower near the surface, where making waves adds drag.",
    equation="C_D of both body planes x (1 + gain exp(-z/depth))",
    source="Hertel (1966), Structure, Form, Movement: drag of a body against its submergence",
    parameters=(
        EffectParameter("gain", "-", 0.0, 0.0, 20.0, (0.1, 3.0), "extra drag at the surface"),
        EffectParameter(
            "depth", "m", 0.1, 0.005, 5.0, (0.03, 0.4), "depth of decay by 1/e", shapes=True
        ),
    ),
    hooks={"body_drag": raise_drag},
    confusable_with=(
        "floor_effect",
        "hull_compression",
        "linear_drag",
        "offset_drag",
        "surface_piercing",
    ),
)
