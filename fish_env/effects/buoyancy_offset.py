"""Buoyancy offset: the displaced mass differs from the fish file."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.mass_properties import with_buoyancy


@kernel
def shift_buoyancy(centre, place, inputs, time, fish, e):
    """m_b + mass."""
    return with_buoyancy(centre, centre.buoyancy_mass + e.mass)


EFFECT = Effect(
    name="buoyancy_offset",
    section="hydrostatics",
    summary="The fish displaces more or less water than its file says, and rises or sinks.",
    equation="m_b -> m_b + mass",
    source="Archimedes' principle",
    parameters=(
        EffectParameter("mass", "kg", 0.0, -1.0, 1.0, (-0.01, 0.01), "extra displaced mass"),
    ),
    hooks={"barycentre": shift_buoyancy},
    equals=("mass.buoyancy",),
    confusable_with=(
        "bubbles",
        "com_offset",
        "current",
        "depth_bias",
        "hull_compression",
        "surface_piercing",
        "water_density",
        "water_ingress",
        "wave",
    ),
)
