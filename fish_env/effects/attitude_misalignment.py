"""Attitude misalignment: the attitude sensor is not mounted square."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def add_angles(channels, values):
    """roll, pitch, yaw (rad) with the misalignment added, where they are measured."""
    return {name: channel + values.get(name, 0.0) for name, channel in channels.items()}


def _angle(name: str) -> EffectParameter:
    return EffectParameter(name, "rad", 0.0, -1.0, 1.0, (-0.08, 0.08), f"added to {name}")


EFFECT = Effect(
    name="attitude_misalignment",
    section="measurement",
    summary="The measured angles are off by a constant; the path does not fit the heading.",
    equation="measured (roll, pitch, yaw) = true angles + misalignment",
    source="Mounting error of a sensor, or a camera frame not turned to north",
    parameters=(_angle("roll"), _angle("pitch"), _angle("yaw")),
    measure=add_angles,
    confusable_with=(
        "com_offset",
        "gyro_bias",
    ),
)
