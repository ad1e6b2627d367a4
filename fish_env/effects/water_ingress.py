"""Water ingress: water leaks into the hull slowly and collects at one point."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.mass_properties import with_load


@kernel
def fill(centre, place, inputs, time, fish, e):
    """A point mass rate t at (x, 0, 0), t since the run's start (s): mass, C_m and J."""
    return with_load(centre, e.rate * time, e.x, e.rate != 0.0)


EFFECT = Effect(
    name="water_ingress",
    section="hydrostatics",
    summary="The fish becomes heavier during the run, and its trim changes.",
    equation=(
        "m -> m + w, C_m -> (m C_m + w r)/(m + w), J_y, J_z -> J + w x^2, "
        "w = rate t, r = (x, 0, 0), t since the run's start"
    ),
    source="Statics of a flooded compartment; a leak of 1 ml a minute is 1.7e-5 kg/s",
    parameters=(
        EffectParameter(
            "rate", "kg/s", 0.0, -0.05, 0.05, (0.00001, 0.0005), "water that enters per second"
        ),
        EffectParameter(
            "x",
            "m",
            0.0,
            -0.3,
            0.3,
            (-0.06, 0.06),
            "where it collects, ahead of O_b",
            shapes=True,
            probed=False,
        ),
    ),
    hooks={"barycentre": fill},
    confusable_with=(
        "buoyancy_offset",
        "hull_compression",
    ),
)
