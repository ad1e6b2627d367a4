"""Gyro scale: the gain of the rate sensor is wrong."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def scale_rates(channels, values):
    """p, q, r (rad/s) times their scales, where they are measured."""
    return {name: channel * values.get(name, 1.0) for name, channel in channels.items()}


def _axis(name: str, axis: str) -> EffectParameter:
    return EffectParameter(name, "-", 1.0, 0.2, 5.0, (0.85, 1.1), f"gain about {axis}")


EFFECT = Effect(
    name="gyro_scale",
    section="measurement",
    summary="The measured rates are larger or smaller than the measured attitude shows.",
    equation="measured (p, q, r) = scale (p, q, r)",
    source="Scale-factor error of a gyro: Titterton and Weston, section 4.2",
    parameters=(_axis("p", "x"), _axis("q", "y"), _axis("r", "z")),
    measure=scale_rates,
    order=-1,
    confusable_with=(
        "clock_scale",
        "gyro_bias",
    ),
)
