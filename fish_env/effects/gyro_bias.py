"""Gyro bias: the rate sensor does not read zero at rest."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def add_bias(channels, values):
    """p, q, r (rad/s) with the bias added, where they are measured."""
    return {name: channel + values.get(name, 0.0) for name, channel in channels.items()}


def _axis(name: str, axis: str) -> EffectParameter:
    return EffectParameter(name, "rad/s", 0.0, -2.0, 2.0, (-0.05, 0.05), f"bias about {axis}")


EFFECT = Effect(
    name="gyro_bias",
    section="measurement",
    summary="The measured rates have a constant error that the measured attitude does not show.",
    equation="measured (p, q, r) = true (p, q, r) + bias",
    source="Zero-rate offset of low-cost gyros, some degrees a second",
    parameters=(_axis("p", "x"), _axis("q", "y"), _axis("r", "z")),
    measure=add_bias,
    confusable_with=(
        "attitude_misalignment",
        "gyro_scale",
        "tail_bias",
    ),
)
