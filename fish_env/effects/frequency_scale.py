"""Frequency scale: the tail beats faster or slower than commanded."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.inputs import with_tail_frequency
from fish_env.model.jit import kernel


@kernel
def scale_frequency(inputs, time, fish, e):
    """f1 -> scale f1."""
    return with_tail_frequency(
        inputs, e.scale * inputs.tail_frequency, e.scale * inputs.tail_frequency_rate
    )


EFFECT = Effect(
    name="frequency_scale",
    section="actuation",
    summary="The tail frequency differs from its command by a constant factor.",
    equation="f1 -> scale f1",
    source="Rate error of the clock that generates the stroke",
    parameters=(
        EffectParameter(
            "scale", "-", 1.0, 0.2, 5.0, (0.9, 1.05), "frequency over commanded frequency"
        ),
    ),
    hooks={"inputs": scale_frequency},
    drifts_in_phase=True,
    confusable_with=(
        "battery_sag",
        "beat_load",
        "clock_scale",
        "clock_skew",
        "side_load",
        "tail_gain",
    ),
)
