"""Sensor delay: measurements are recorded late."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def true_time(recorded_s, values):
    """Every channel at t shows the state at t - delay (s). The rate of the clock comes first."""
    return recorded_s - values["delay"]


EFFECT = Effect(
    name="sensor_delay",
    section="measurement",
    summary="All measured channels lag the commands by the same time.",
    equation="measured(t) = true(t - delay)",
    source="Exposure, transmission and filtering of camera and sensors",
    parameters=(
        EffectParameter("delay", "s", 0.0, 0.0, 5.0, (0.01, 0.2), "age of the recorded values"),
    ),
    sample_time=true_time,
    order=1,
    confusable_with=(
        "clock_scale",
        "clock_skew",
        "servo_delay",
        "servo_lag",
        "wake_memory",
    ),
)
