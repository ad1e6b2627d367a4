"""Attitude misalignment: the inertial unit is not aligned with the hull."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def mounting(values):
    """M = R_z(yaw) R_y(pitch) R_x(roll), from the sensor's axes to the body's."""
    return {f"mount_{name}": values[name] for name in ("roll", "pitch", "yaw")}


def _angle(name: str) -> EffectParameter:
    return EffectParameter(name, "rad", 0.0, -1.0, 1.0, (-0.08, 0.08), f"{name} of the sensor")


EFFECT = Effect(
    name="attitude_misalignment",
    section="measurement",
    summary="Angles and rates are measured about the axes of a sensor that is rotated in the hull.",
    equation="measured R = R M, measured omega = M^T omega, M = R_z(yaw) R_y(pitch) R_x(roll)",
    source="Mounting error of a strapdown unit: Titterton and Weston, Strapdown Inertial "
    "Navigation Technology, chapter 3",
    parameters=(_angle("roll"), _angle("pitch"), _angle("yaw")),
    geometry=mounting,
    confusable_with=(
        "camera_tilt",
        "com_offset",
        "gyro_bias",
        "soft_iron",
    ),
)
