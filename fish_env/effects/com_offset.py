"""Centre-of-mass offset: the centre of mass differs from the fish file."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.mass_properties import with_offset


@kernel
def move_barycentre(centre, place, inputs, time, fish, e):
    """C_m + (x, y, z); the inertia about O_b stays."""
    return with_offset(centre, e.x, e.y, e.z)


def _component(axis: str, way: str) -> EffectParameter:
    text = f"displacement of the barycentre {way}"
    return EffectParameter(axis, "m", 0.0, -0.02, 0.02, (-0.002, 0.002), text)


EFFECT = Effect(
    name="com_offset",
    section="hydrostatics",
    summary="The fish pitches or rolls at rest, and its path climbs or turns.",
    equation="C_m -> C_m + (x, y, z)",
    source="Statics: tan(pitch at rest) = -x / z of the barycentre",
    parameters=(
        _component("x", "forward"),
        _component("y", "to starboard"),
        _component("z", "down"),
    ),
    hooks={"barycentre": move_barycentre},
    equals=tuple(f"mass.static_moment_rest[{axis}]" for axis in range(3)),
    confusable_with=(
        "attitude_misalignment",
        "block_scale",
        "bubbles",
        "buoyancy_offset",
        "tail_asymmetry",
        "tail_bias",
    ),
)
