"""Low-pass filter of the inertial unit: its angles and rates are late, and jumps are smeared."""

from __future__ import annotations

from math import pi, sqrt

from fish_env.model.effect import Effect, EffectParameter


def late(values):
    """Group delay (s) of a second-order Butterworth filter well below its cutoff; zero without."""
    return {"inertial": sqrt(2.0) / (2.0 * pi * values["cutoff"])}


EFFECT = Effect(
    name="imu_lowpass",
    section="measurement",
    summary="The inertial unit filters its angles and rates, which makes them late.",
    equation=(
        "roll, pitch, yaw, p, q, r: measured(t) = true(t - sqrt(2) / (2 pi cutoff)), the group "
        "delay of a second-order Butterworth filter"
    ),
    source="Oppenheim and Schafer, Discrete-Time Signal Processing, section 5.1 and appendix B",
    parameters=(
        EffectParameter(
            "cutoff", "Hz", float("inf"), 0.5, float("inf"), (3.0, 20.0), "frequency of half power"
        ),
    ),
    late=late,
    order=2,
    diagnosed=False,  # the delay and smoothing of the inertial unit are estimated in every fit
    confusable_with=("sensor_delay",),
)
