"""Low-pass filter of the inertial unit: its angles and rates are late, and jumps are smeared."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter


def low_pass(values):
    """Frequency of half power (Hz)."""
    return values["cutoff"]


EFFECT = Effect(
    name="imu_lowpass",
    section="measurement",
    summary="The inertial unit filters its angles and rates, which makes them late.",
    equation=(
        "roll, pitch, yaw, p, q, r: second-order Butterworth filter. A simulation has its group "
        "delay, measured(t) = true(t - sqrt(2) / (2 pi cutoff)); a fit has the whole filter"
    ),
    source="Oppenheim and Schafer, Discrete-Time Signal Processing, section 5.1 and appendix B",
    parameters=(
        EffectParameter(
            "cutoff", "Hz", float("inf"), 0.5, float("inf"), (3.0, 20.0), "frequency of half power"
        ),
    ),
    low_pass=low_pass,
    order=2,
    confusable_with=("sensor_delay",),
)
