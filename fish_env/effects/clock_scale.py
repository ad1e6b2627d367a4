"""Clock scale: the clock of a log runs fast or slow."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def true_time(recorded_s, values):
    """Recorded time = true time / scale, so true time = recorded time x scale (s)."""
    return recorded_s * values["scale"]


EFFECT = Effect(
    name="clock_scale",
    section="measurement",
    summary="The clock of commands and measurements runs at another rate than true time.",
    equation="recorded time = true time / scale, of commands and measurements alike",
    source="Rate error of the recorder's oscillator, or a log replayed at another speed",
    parameters=(EffectParameter("scale", "-", 1.0, 0.2, 5.0, (0.97, 1.03), "rate of true time"),),
    sample_time=true_time,
    command_time=true_time,
    confusable_with=(
        "battery_sag",
        "clock_skew",
        "frequency_scale",
        "gyro_scale",
        "position_scale",
        "sensor_delay",
        "servo_delay",
    ),
)
