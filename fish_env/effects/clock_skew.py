"""Clock skew: the clock of the measurements runs at another rate than that of the commands."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def true_time(recorded_s, values):
    """Recorded time = time of the commands' clock / scale (s)."""
    return recorded_s * values["scale"]


EFFECT = Effect(
    name="clock_skew",
    section="measurement",
    summary="The clock of the measurements runs at another rate than that of the commands.",
    equation="recorded time = time on the commands' clock / scale, of measurements alone",
    source="Clock skew between two recorders",
    parameters=(
        EffectParameter(
            "scale", "-", 1.0, 0.2, 5.0, (0.97, 1.03), "rate of the clock of the commands"
        ),
    ),
    sample_time=true_time,
    confusable_with=(
        "battery_sag",
        "clock_scale",
        "frequency_scale",
        "position_scale",
        "sensor_delay",
        "servo_delay",
    ),
)
