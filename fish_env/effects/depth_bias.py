"""Depth bias: the depth sensor has a constant error."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def add_offset(channels, values):
    """z (m) with the offset added, where it is measured."""
    return {
        name: channel + values["offset"] if name == "z" else channel
        for name, channel in channels.items()
    }


EFFECT = Effect(
    name="depth_bias",
    section="measurement",
    summary="The measured depth has a constant error.",
    equation="measured z = true z + offset",
    source="Zero of a pressure sensor: 1 mbar of air pressure is 1 cm of water",
    parameters=(EffectParameter("offset", "m", 0.0, -5.0, 5.0, (-0.1, 0.1), "added to the depth"),),
    measure=add_offset,
    confusable_with=(
        "buoyancy_offset",
        "hull_compression",
    ),
)
