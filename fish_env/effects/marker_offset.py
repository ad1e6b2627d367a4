"""Marker offset: the camera follows a marker that is not at O_b."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def marker(values):
    """Place of the marker from O_b (m, body)."""
    return {f"marker_{axis}": values[axis] for axis in "xyz"}


def _component(axis: str, way: str) -> EffectParameter:
    return EffectParameter(axis, "m", 0.0, -0.5, 0.5, (-0.06, 0.06), f"marker {way} of O_b")


EFFECT = Effect(
    name="marker_offset",
    section="measurement",
    summary="The measured path moves with the attitude, as the marker is not at the origin.",
    equation="measured (x, y) = those of C_I + R (x, y, z)",
    source="Lever arm of a tracked point: Titterton and Weston, section 12.3",
    parameters=(
        _component("x", "ahead"),
        _component("y", "to starboard"),
        _component("z", "below"),
    ),
    geometry=marker,
    confusable_with=("camera_tilt",),
)
