"""Beat load: the tail frequency falls with the load and with the tail offset."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.inputs import offset_size, with_tail_frequency
from fish_env.model.jit import kernel
from fish_env.model.tail import TWO_PI


@kernel
def slow_beat(inputs, time, fish, e):
    """f1 -> f1 (1 - offset |xi1_bar|) (1 - load 2 pi A1 f1), neither factor below zero."""
    speed = TWO_PI * inputs.tail_amplitude * inputs.tail_frequency
    speed_rate = TWO_PI * (
        inputs.tail_amplitude_rate * inputs.tail_frequency
        + inputs.tail_amplitude * inputs.tail_frequency_rate
    )
    size, size_rate = offset_size(inputs)
    aside = max(1.0 - e.offset * size, 0.0)
    loaded = max(1.0 - e.load * speed, 0.0)
    left = aside * loaded
    loss = e.offset * size_rate * loaded + aside * (e.load * speed_rate)
    return with_tail_frequency(
        inputs,
        left * inputs.tail_frequency,
        left * inputs.tail_frequency_rate - loss * inputs.tail_frequency,
    )


EFFECT = Effect(
    name="beat_load",
    section="actuation",
    summary="The tail frequency is below its command, more so for fast strokes and large offsets.",
    equation="f1 -> f1 (1 - offset |xi1_bar|) (1 - load 2 pi A1 f1)",
    source="Speed of a d.c. motor falls linearly with its load, which grows with stroke and offset",
    parameters=(
        EffectParameter("offset", "1/rad", 0.0, 0.0, 2.0, (0.05, 0.4), "share lost per radian"),
        EffectParameter("load", "s/rad", 0.0, 0.0, 0.2, (0.002, 0.02), "share lost per rad/s"),
    ),
    hooks={"inputs": slow_beat},
    drifts_in_phase=True,
    confusable_with=(
        "battery_sag",
        "frequency_scale",
        "servo_torque_limit",
        "side_load",
    ),
)
