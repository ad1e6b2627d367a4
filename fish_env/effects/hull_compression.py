"""Hull compression: the pressure at depth compresses the hull and the air in it."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.mass_properties import with_buoyancy


@kernel
def compress(centre, place, inputs, time, fish, e):
    """m_b - rate z, z being the depth (m)."""
    return with_buoyancy(centre, centre.buoyancy_mass - e.rate * place.z)


EFFECT = Effect(
    name="hull_compression",
    section="hydrostatics",
    summary="A deeper fish displaces less water, so it does not keep its depth by itself.",
    equation="m_b -> m_b - rate z",
    source="Archimedes' principle with a volume that falls linearly with pressure",
    parameters=(
        EffectParameter(
            "rate", "kg/m", 0.0, -0.5, 0.5, (0.0005, 0.01), "displaced mass lost per metre of depth"
        ),
    ),
    hooks={"barycentre": compress},
    confusable_with=(
        "bubbles",
        "buoyancy_offset",
        "depth_bias",
        "surface_drag",
        "tether",
        "water_ingress",
    ),
)
