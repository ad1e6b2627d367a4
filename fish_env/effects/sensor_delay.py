"""Sensor delay: measurements are recorded late, those of some devices later than others."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def true_time(recorded_s, values):
    """Every channel at t shows the state at t - delay (s). The rate of the clock comes first."""
    return recorded_s - values["delay"]


def late(values):
    """What camera and depth sensor show is older by so much more (s)."""
    return {device: values[f"{device}_later"] for device in ("camera", "depth")}


def _further(device: str, what: str) -> EffectParameter:
    return EffectParameter(
        f"{device}_later", "s", 0.0, -1.0, 1.0, (-0.05, 0.1), f"further age of what {what} shows"
    )


EFFECT = Effect(
    name="sensor_delay",
    section="measurement",
    summary="Measured channels lag the commands, those of camera and depth sensor by more.",
    equation=(
        "measured(t) = true(t - delay); x, y, u, v, w: true(t - delay - camera_later); "
        "z: true(t - delay - depth_later)"
    ),
    source="Exposure, transmission and filtering of camera and sensors",
    parameters=(
        EffectParameter("delay", "s", 0.0, 0.0, 5.0, (0.01, 0.2), "age of the recorded values"),
        _further("camera", "the camera"),
        _further("depth", "the depth sensor"),
    ),
    sample_time=true_time,
    late=late,
    order=1,
    confusable_with=(
        "clock_scale",
        "clock_skew",
        "imu_lowpass",
        "servo_delay",
        "servo_lag",
        "wake_memory",
    ),
)
