"""Water density: salt or warm water instead of the water of the fish file."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.mass_properties import with_buoyancy


@kernel
def scale_density(density, place, e):
    """rho -> scale rho: lift, drag, impact moments and the tail's virtual mass."""
    return density * e.scale


@kernel
def scale_buoyancy(centre, place, inputs, time, fish, e):
    """m_b -> scale m_b: the same volume in other water."""
    return with_buoyancy(centre, centre.buoyancy_mass * e.scale)


EFFECT = Effect(
    name="water_density",
    section="surroundings",
    summary="Denser or lighter water than in the fish file: the fish rises or sinks.",
    equation="rho -> scale rho, m_b -> scale m_b",
    source=(
        "Archimedes' principle; fresh water 998.2 kg/m^3 at 20 deg C, 995.6 at 30 deg C, sea water "
        "1025: Newman, Marine Hydrodynamics, appendix"
    ),
    parameters=(
        EffectParameter(
            "scale", "-", 1.0, 0.5, 1.5, (0.996, 1.03), "density over that of the fish file"
        ),
    ),
    hooks={"density": scale_density, "barycentre": scale_buoyancy},
    diagnosed=False,
    confusable_with=("buoyancy_offset",),
)
