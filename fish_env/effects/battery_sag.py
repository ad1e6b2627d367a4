"""Battery sag: the tail frequency falls as the battery empties."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.inputs import with_tail_frequency
from fish_env.model.jit import kernel


@kernel
def slow_down(inputs, time, fish, e):
    """f1 -> f1 (1 - rate t), t since the run's start (s); never below zero."""
    left = max(1.0 - e.rate * time, 0.0)
    loss = e.rate if left > 0.0 else 0.0
    return with_tail_frequency(
        inputs,
        left * inputs.tail_frequency,
        left * inputs.tail_frequency_rate - loss * inputs.tail_frequency,
    )


EFFECT = Effect(
    name="battery_sag",
    section="actuation",
    summary="The same command gives a lower tail frequency late in a run than early.",
    equation="f1 -> f1 (1 - rate t), t since the run's start, f1 >= 0",
    source="Speed of a d.c. motor under load follows its voltage, which falls with the charge used",
    parameters=(
        EffectParameter(
            "rate", "1/s", 0.0, -0.01, 0.1, (0.0002, 0.01), "share of f1 lost per second"
        ),
    ),
    hooks={"inputs": slow_down},
    drifts_in_phase=True,
    confusable_with=(
        "beat_load",
        "clock_scale",
        "clock_skew",
        "frequency_scale",
    ),
)
