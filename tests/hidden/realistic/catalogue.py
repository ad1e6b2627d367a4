"""Names, neutral values and sizes of what a realistic case may hide.

Sizes are those of a 2 kg, 29 cm fish, chosen before any case was diagnosed. The names are those
that an answer would give, or the most natural ones where the package has none.
"""

from __future__ import annotations

import math

from tests.hidden.records import INF, LIBRARY, PLANTS, REAL
from tests.hidden.sizes import ABSORBED, EQUIVALENT, INVISIBLE, SIZES, Size, softer

DEGREE = math.radians(1.0)
CORRECTED: dict[str, dict[str, float]] = {
    "sensor_delay": {"camera": 0.0, "imu": 0.0, "depth": 0.0},
}
"""Effects of the catalogue that real robots have in a fuller form."""

SENSED: dict[str, dict[str, float]] = {
    "outliers": {"share": 0.0, "size": 20.0},
    "exposure_jitter": {"sd": 0.0},
    "quantisation": {"step": 0.0},
    "dropouts": {"share": 0.0, "length": 8.0},
    "moving_noise": {"factor": 1.0},
    "imu_lowpass": {"cutoff": INF},
    "clock_offset": {"offset": 0.0},
    "clock_skew": {"scale": 1.0},
    "marker_offset": dict.fromkeys("xyz", 0.0),
    "gyro_scale": dict.fromkeys("pqr", 1.0),
    "camera_tilt": {"roll": 0.0, "pitch": 0.0},
    "refraction": {"height": INF},
    "soft_iron": {"amplitude": 0.0, "angle": 0.0},
    "derived_channels": {"on": 0.0},
}
"""Sensors. Steps of quantisation and sizes of outliers are in units of the sensor's noise."""
OTHER = {"water_density": {"scale": 1.0}, "tail_phase": {"offset": 0.0}}
PHYSICAL = {**LIBRARY, **REAL, **PLANTS, **CORRECTED, **OTHER}
NEUTRAL: dict[str, dict[str, float]] = {**PHYSICAL, **SENSED}

BY_SENSORS = {
    *SENSED, "sensor_delay", "clock_scale", "gyro_bias", "attitude_misalignment", "depth_bias",
    "position_scale",
}  # fmt: skip
"""What changes the record and not the motion. A clock also moves the commands."""
STOCHASTIC = ("outliers", "exposure_jitter", "quantisation", "dropouts", "moving_noise")
"""Noise of another kind: it has no share in a misfit without noise."""
BENIGN = (*STOCHASTIC, "derived_channels")
"""What any measurement model has to live with: to name nothing is a right answer."""


def flatter(value: float, strength: float) -> float:
    """A height or stiffness whose effect is its inverse."""
    return value / strength


FULLER: dict[str, Size] = {
    "sensor_delay": Size({"camera": 0.08, "imu": 0.03, "depth": 0.05}),
}  # fmt: skip
MAIN_SIZES = {
    name: FULLER.get(name, size)
    for name, size in SIZES.items()
    if name not in (*INVISIBLE, *ABSORBED)
}
"""What may act most, or a little, in a realistic case."""

VARIATION: dict[str, dict[str, float]] = {
    "com_offset": {"x": 1e-4, "y": 1e-4, "z": 1e-4},
    "buoyancy_offset": {"mass": 4e-4},
    "gyro_bias": {"p": 0.004, "q": 0.004, "r": 0.004},
    "clock_offset": {"offset": 0.010},
    "battery_sag": {"rate": 3e-4},
    "current": {"north": 0.004, "east": 0.004, "down": 0.001},
    "frequency_scale": {"scale": 0.004},
    "tail_phase": {"offset": 0.1},
}
"""One sigma from run to run: trim, buoyancy, gyro zero, clock, battery, current, beat, phase."""

DIRT: dict[str, Size] = {
    "outliers": Size({}, shape={"share": (0.001, 0.01), "size": (10.0, 30.0)}),
    "exposure_jitter": Size({}, shape={"sd": (0.001, 0.004)}),
    "quantisation": Size({}, shape={"step": (0.3, 1.5)}),
    "dropouts": Size({}, shape={"share": (0.005, 0.03), "length": (4.0, 12.0)}),
    "moving_noise": Size({}, shape={"factor": (1.0, 2.0)}),
}
"""Dirt of every realistic case."""
SOMETIMES: dict[str, Size] = {
    "imu_lowpass": Size({"cutoff": 5.0}, strengthen=softer),
    "sensor_delay": Size({}, shape={"camera": (0.02, 0.06), "imu": (0.005, 0.02),
                                    "depth": (0.01, 0.05)}),
    "marker_offset": Size({"x": 0.015, "y": 0.008, "z": -0.03}, signed=True),
    "attitude_misalignment": Size(dict.fromkeys(("roll", "pitch", "yaw"), DEGREE), signed=True),
    "gyro_scale": Size(dict.fromkeys("pqr", 1.01), signed=True),
    "camera_tilt": Size({"roll": DEGREE, "pitch": DEGREE}, signed=True),
    "refraction": Size({}, shape={"height": (3.0, 5.0)}),
    "soft_iron": Size({"amplitude": 1.5 * DEGREE}, shape={"angle": (-3.0, 3.0)}),
}  # fmt: skip
"""Dirt of a part of the realistic cases, each with `CHANCE`."""
CHANCE = 0.4

ALONE: dict[str, Size] = {
    "outliers": Size({}, shape={"share": (0.005, 0.01), "size": (15.0, 30.0)}),
    "exposure_jitter": Size({"sd": 0.005}),
    "quantisation": Size({"step": 3.0}),
    "dropouts": Size({}, shape={"share": (0.08, 0.15), "length": (8.0, 20.0)}),
    "moving_noise": Size({"factor": 3.0}),
    "imu_lowpass": Size({"cutoff": 5.0}, strengthen=softer),
    "sensor_delay": Size({"camera": 0.10, "imu": 0.02, "depth": 0.05}),
    "marker_offset": Size({"x": 0.06, "y": 0.03, "z": -0.08}, signed=True),
    "attitude_misalignment": Size(dict.fromkeys(("roll", "pitch", "yaw"), 0.08), signed=True),
    "gyro_scale": Size(dict.fromkeys("pqr", 0.90), signed=True),
    "camera_tilt": Size({"roll": 0.07, "pitch": 0.07}, signed=True),
    "refraction": Size({"height": 2.0}, strengthen=flatter),
    "soft_iron": Size({"amplitude": 0.15}, shape={"angle": (-3.0, 3.0)}),
    "derived_channels": Size({"on": 1.0}),
    "tail_bias": Size({"offset": 0.10}, signed=True),
    "offset_gain": Size({"gain": 0.75}, signed=True),
    "swing_loss": Size({"per_radian": 0.5}),
    "angle_limit": Size({}, shape={"lower": (-0.45, -0.3), "upper": (0.3, 0.45)}),
    "beat_load": Size({"offset": 0.25, "load": 0.012}),
    "servo_torque_limit": Size({"torque": 0.02}, strengthen=flatter),
    "tail_stall": Size({"loss": 0.6}, shape={"onset": (0.9, 1.2), "width": (0.05, 0.08)}),
    "body_flexibility": Size({"stiffness": 0.1}, strengthen=flatter),
    "wall_effect": Size(
        {"gain": 2.5},
        shape={"distance": (0.4, 0.8), "heading": (-3.0, 3.0), "range": (0.2, 0.4)},
    ),
    "floor_effect": Size({"gain": 2.5}, shape={"depth": (0.8, 1.2), "range": (0.2, 0.3)}),
    "surface_piercing": Size({"height": 0.05}),
    "bubbles": Size({"mass": 0.004}, shape={"x": (-0.06, 0.06)}),
    "water_density": Size({"scale": 1.002}, signed=True),
    "side_load": Size({"swing": 0.16, "beat": 0.05}),
}
"""Sizes of a suspect that acts alone."""
PLANT_SIZES: dict[str, Size] = {
    "linked_tail": Size({"share": 1.0}, shape={"stiffness": (0.03, 0.08)}),
    "strip_hull": Size({"coefficient": 8.0}, shape={"onset": (0.3, 0.5)}),
    "wake_oscillator": Size({"lift": 4.0}),
    "bistable_wake": Size({"coefficient": 3.0}),
}

SAME: dict[str, tuple[str, ...]] = {
    **EQUIVALENT,
    "tail_phase": (),
    "clock_offset": ("sensor_delay",),
    "sensor_delay": ("clock_offset",),
    "imu_lowpass": ("imu_filter",),
    "marker_offset": ("lever_arm", "marker_lever_arm"),
    "swing_loss": ("offset_swing_loss",),
    "angle_limit": ("angle_saturation", "tail_saturation"),
    "beat_load": ("beat_slowing",),
    "body_flexibility": ("flexible_body",),
    "wall_effect": ("wall", "wall_and_floor"),
    "floor_effect": ("floor", "wall_and_floor"),
    "bubbles": ("buoyancy_offset", "parameter:mass.buoyancy"),
    "water_density": (
        "buoyancy_offset", "parameter:mass.buoyancy", "parameter:water.density",
    ),
    "offset:block_displacement": ("com_offset", *EQUIVALENT["com_offset"]),
    "unit:block_displacement": ("block_scale",),
    "unit:tail_amplitude": ("tail_gain",),
    "unit:x,y": ("position_scale",),
}  # fmt: skip
"""Other names that say the same, by name: the package's, or an effect that is equal here."""
