"""Camera tilt: the overhead camera does not look straight down."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def tilt(values):
    """T = R_y(pitch) R_x(roll), from the camera's axes to the inertial frame."""
    return {"tilt_roll": values["roll"], "tilt_pitch": values["pitch"]}


def _angle(name: str) -> EffectParameter:
    return EffectParameter(name, "rad", 0.0, -0.5, 0.5, (-0.08, 0.08), f"{name} of the camera")


EFFECT = Effect(
    name="camera_tilt",
    section="measurement",
    summary="The measured path shifts with depth, and is shortened in one direction.",
    equation="measured (x, y) = those of T^T C_I, T = R_y(pitch) R_x(roll)",
    source="Extrinsic calibration of a camera: Hartley and Zisserman, Multiple View Geometry",
    parameters=(_angle("roll"), _angle("pitch")),
    geometry=tilt,
    confusable_with=(
        "attitude_misalignment",
        "marker_offset",
    ),
)
