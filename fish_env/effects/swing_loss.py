"""Swing loss: the tail amplitude falls with the tail offset."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.inputs import offset_size, with_tail_command
from fish_env.model.jit import kernel


@kernel
def lose_swing(inputs, time, fish, e):
    """A1 -> A1 (1 - per_radian |xi1_bar|), never below zero."""
    size, size_rate = offset_size(inputs)
    left = max(1.0 - e.per_radian * size, 0.0)
    loss = e.per_radian * size_rate if left > 0.0 else 0.0
    return with_tail_command(
        inputs,
        inputs.tail_offset,
        left * inputs.tail_amplitude,
        inputs.tail_frequency,
        inputs.tail_offset_rate,
        left * inputs.tail_amplitude_rate - loss * inputs.tail_amplitude,
        inputs.tail_frequency_rate,
    )


EFFECT = Effect(
    name="swing_loss",
    section="actuation",
    summary="The amplitude falls with the tail offset: the fish loses speed in a turn.",
    equation="A1 -> A1 (1 - per_radian |xi1_bar|)",
    source="A tendon or linkage that shortens its stroke away from the centre",
    parameters=(
        EffectParameter(
            "per_radian", "1/rad", 0.0, -1.0, 2.0, (0.1, 0.7), "share of A1 lost per radian"
        ),
    ),
    hooks={"inputs": lose_swing},
    order=1,
    confusable_with=(
        "angle_limit",
        "offset_drag",
        "offset_gain",
        "side_load",
        "tail_gain",
    ),
)
