"""Clock scale: the recorder's clock runs fast or slow."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def true_time(recorded_s, values):
    """Recorded time = true time / scale, so true time = recorded time x scale (s)."""
    return recorded_s * values["scale"]


EFFECT = Effect(
    name="clock_scale",
    section="measurement",
    summary="Measurements carry times of a clock that runs at another rate than the servos'.",
    equation="recorded time = true time / scale",
    source="Clock skew between two recorders",
    parameters=(EffectParameter("scale", "-", 1.0, 0.5, 2.0, (0.97, 1.03), "rate of true time"),),
    sample_time=true_time,
    confusable_with=(
        "battery_sag",
        "frequency_scale",
        "position_scale",
        "sensor_delay",
        "servo_delay",
    ),
)
