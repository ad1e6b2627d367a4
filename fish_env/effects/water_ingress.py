"""Water ingress: the hull fills slowly."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.mass_properties import with_buoyancy


@kernel
def fill(centre, place, inputs, time, fish, e):
    """m_b - rate t, t since the run's start (s)."""
    return with_buoyancy(centre, centre.buoyancy_mass - e.rate * time)


EFFECT = Effect(
    name="water_ingress",
    section="hydrostatics",
    summary="The fish grows heavier in the water as the run goes on.",
    equation="m_b -> m_b - rate t, t since the run's start",
    source="Archimedes' principle; a leak of 1 ml a minute is 1.7e-5 kg/s",
    parameters=(
        EffectParameter(
            "rate", "kg/s", 0.0, -0.05, 0.05, (0.00001, 0.0005), "displaced mass lost a second"
        ),
    ),
    hooks={"barycentre": fill},
    confusable_with=(
        "buoyancy_offset",
        "hull_compression",
    ),
)
