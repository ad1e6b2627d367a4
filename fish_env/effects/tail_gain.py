"""Tail gain: the tail amplitude is larger or smaller than commanded."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.inputs import with_tail_command
from fish_env.model.jit import kernel


@kernel
def scale_amplitude(inputs, time, fish, e):
    """A1 -> gain A1; the offset stays."""
    return with_tail_command(
        inputs,
        inputs.tail_offset,
        e.gain * inputs.tail_amplitude,
        inputs.tail_frequency,
        inputs.tail_offset_rate,
        e.gain * inputs.tail_amplitude_rate,
        inputs.tail_frequency_rate,
    )


EFFECT = Effect(
    name="tail_gain",
    section="actuation",
    summary="The tail amplitude differs from its command by a factor, the same at every frequency.",
    equation="A1 -> gain A1",
    source="Scale error of servo and linkage",
    parameters=(
        EffectParameter(
            "gain", "-", 1.0, 0.0, 3.0, (0.8, 1.1), "amplitude over commanded amplitude"
        ),
    ),
    hooks={"inputs": scale_amplitude},
    confusable_with=(
        "angle_limit",
        "body_flexibility",
        "frequency_scale",
        "linear_drag",
        "position_scale",
        "servo_backlash",
        "servo_lag",
        "servo_rate_limit",
        "servo_torque_limit",
        "side_load",
        "swing_loss",
        "tail_flexibility",
        "tail_reactive",
        "tail_stall",
        "wake_fraction",
    ),
)
