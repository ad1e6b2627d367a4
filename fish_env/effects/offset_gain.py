"""Offset gain: the tail offset is larger or smaller than commanded."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.inputs import with_tail_command
from fish_env.model.jit import kernel


@kernel
def scale_offset(inputs, time, fish, e):
    """xi1_bar -> gain xi1_bar; the amplitude stays."""
    return with_tail_command(
        inputs,
        e.gain * inputs.tail_offset,
        inputs.tail_amplitude,
        inputs.tail_frequency,
        e.gain * inputs.tail_offset_rate,
        inputs.tail_amplitude_rate,
        inputs.tail_frequency_rate,
    )


EFFECT = Effect(
    name="offset_gain",
    section="actuation",
    summary="The tail offset is larger or smaller than commanded; the amplitude is right.",
    equation="xi1_bar -> gain xi1_bar",
    source="Scale error of servo and linkage about the tail's centre",
    parameters=(
        EffectParameter("gain", "-", 1.0, 0.0, 3.0, (0.7, 1.2), "offset over commanded offset"),
    ),
    hooks={"inputs": scale_offset},
    confusable_with=(
        "angle_limit",
        "offset_drag",
        "swing_loss",
        "tail_bias",
    ),
)
