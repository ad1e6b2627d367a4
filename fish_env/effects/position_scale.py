"""Position scale: measured positions have a wrong scale."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter

POSITION = ("x", "y", "z")


def scale_position(channels, values):
    """x, y, z (m) times the scale, where they are measured."""
    return {
        name: values["scale"] * channel if name in POSITION else channel
        for name, channel in channels.items()
    }


EFFECT = Effect(
    name="position_scale",
    section="measurement",
    summary="Measured distances are too long or too short; measured speeds are right.",
    equation="measured (x, y, z) = scale (x, y, z)",
    source="Calibration of a camera that looks through a water surface of refractive index 1.33",
    parameters=(
        EffectParameter("scale", "-", 1.0, 0.2, 5.0, (0.93, 1.07), "measured over true distance"),
    ),
    measure=scale_position,
    confusable_with=(
        "clock_scale",
        "clock_skew",
        "current",
        "refraction",
        "tail_gain",
        "tether",
    ),
)
