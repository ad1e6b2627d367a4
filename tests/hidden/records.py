"""The numbers that the hidden physics reads: one record for the fish, one for what is added."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

AXES = ("x", "y", "z")

PATHS = {
    "density": "water.density",
    "gravity": "water.gravity",
    "mass": "mass.total",
    "buoyancy": "mass.buoyancy",
    "block_mass": "mass.weight_block",
    **{f"static_{a}": f"mass.static_moment_rest[{i}]" for i, a in enumerate(AXES)},
    **{f"rest_inertia_{a}": f"inertia.rest[{i}]" for i, a in enumerate(AXES)},
    **{f"block_inertia_{a}": f"inertia.weight_block[{i}]" for i, a in enumerate(AXES)},
    **{f"bracket_{a}": f"weight_block.bracket_origin[{i}]" for i, a in enumerate(AXES)},
    **{name: f"weight_block.{name}" for name in ("d1", "d2", "d3", "s_w0")},
    **{f"root_{a}": f"tail.root[{i}]" for i, a in enumerate(AXES)},
    "r_c": "tail.center_of_pressure",
    "tail_area": "tail.area",
    "tail_c0": "tail.drag.c0",
    "tail_c2": "tail.drag.c2",
    "tail_c1": "tail.lift.c1",
    **{f"area_{a}": f"body.area[{i}]" for i, a in enumerate(AXES)},
    **{
        f"{plane}_{short}": f"body.plane_{plane}.{key}"
        for plane in ("xz", "xy")
        for short, key in (
            ("c0", "drag.c0"),
            ("c2", "drag.c2"),
            ("c1", "lift.c1"),
            ("k", "impact_moment"),
        )
    },
    **{f"damping_{a}": f"body.rotational_damping[{i}]" for i, a in enumerate(AXES)},
}
FISH = np.dtype([(name, np.float64) for name in PATHS])

INF = math.inf
LIBRARY: dict[str, dict[str, float]] = {
    "tail_bias": {"offset": 0.0},
    "tail_gain": {"gain": 1.0},
    "tail_asymmetry": {"ratio": 0.0},
    "servo_lag": {"time_constant": 0.0},
    "servo_rate_limit": {"rate": INF},
    "servo_delay": {"delay": 0.0},
    "servo_backlash": {"gap": 0.0},
    "tail_flexibility": {"natural_frequency": INF, "damping_ratio": 1.0},
    "frequency_scale": {"scale": 1.0},
    "battery_sag": {"rate": 0.0},
    "block_scale": {"scale": 1.0},
    "block_lag": {"time_constant": 0.0},
    "added_mass": dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 0.0),
    "block_reaction": {"scale": 0.0},
    "linear_drag": dict.fromkeys(("surge", "sway", "heave"), 0.0),
    "quadratic_damping": dict.fromkeys(("roll", "pitch", "yaw"), 0.0),
    "cross_flow_drag": dict.fromkeys(("sway", "heave"), 0.0),
    "tail_reactive": {"scale": 0.0},
    "wake_fraction": {"fraction": 0.0},
    "wake_memory": {"time_constant": 0.0},
    "offset_drag": {"coefficient": 0.0},
    "buoyancy_offset": {"mass": 0.0},
    "hull_compression": {"rate": 0.0},
    "water_ingress": {"rate": 0.0, "x": 0.0},
    "com_offset": dict.fromkeys(AXES, 0.0),
    "current": dict.fromkeys(("north", "east", "down"), 0.0),
    "wave": {"amplitude": 0.0, "frequency": 0.5, "phase": 0.0, "heading": 0.0, "tank_depth": INF},
    "surface_drag": {"gain": 0.0, "depth": 0.2},
    "tether": {"stiffness": 0.0, "x": 0.0, "y": 0.0, "z": 0.0, "slack": 0.0, "attach_x": 0.0},
    "clock_scale": {"scale": 1.0},
    "clock_skew": {"scale": 1.0},
    "sensor_delay": {"delay": 0.0},
    "gyro_bias": dict.fromkeys("pqr", 0.0),
    "attitude_misalignment": dict.fromkeys(("roll", "pitch", "yaw"), 0.0),
    "depth_bias": {"offset": 0.0},
    "position_scale": {"scale": 1.0},
}
"""The catalogue, with the values at which each effect is off."""

FOREIGN: dict[str, dict[str, float]] = {
    "floor_suction": {"gain": 0.0, "depth": 1.5, "range": 0.2},
    "sloshing": {"mass": 0.0, "frequency": 1.6, "damping": 0.08},
    "thrust_loss": {"per_speed": 0.0},
    "pump": {"force": 0.0, "period": 6.0, "moment": 0.0},
    "thermocline": {"mass": 0.0, "depth": 0.7, "width": 0.05},
    "roll_yaw_damping": {"coefficient": 0.0},
    "sticking_fin": {"moment": 0.0, "threshold": 0.25},
    "one_sided_lift": {"coefficient": 0.0},
    "swirl": {"coefficient": 0.0},
    "block_hysteresis": {"play": 0.0},
    "pitch_heave": {"coefficient": 0.0},
    "downwash": {"coefficient": 0.0},
    "shear_current": {"rate": 0.0, "depth": 0.6, "heading": 0.0},
    "hull_memory": {"time_constant": 0.0},
    "compass_torque": {"moment": 0.0, "heading": 0.0},
}
"""What no catalogue entry describes, off."""

REAL: dict[str, dict[str, float]] = {
    "offset_gain": {"gain": 1.0},
    "swing_loss": {"per_radian": 0.0},
    "angle_limit": {"lower": -INF, "upper": INF},
    "beat_load": {"offset": 0.0, "load": 0.0},
    "side_load": {"swing": 0.0, "beat": 0.0},
    "tail_stall": {"loss": 0.0, "onset": 0.5, "width": 0.06},
    "servo_torque_limit": {"torque": INF},
    "body_flexibility": {"stiffness": INF},
    "wall_effect": {"gain": 0.0, "distance": 1.0, "heading": 0.0, "range": 0.3},
    "floor_effect": {"gain": 0.0, "depth": 1.5, "range": 0.2},
    "surface_piercing": {"height": 0.0},
    "bubbles": {"mass": 0.0, "x": 0.0},
}
"""Further physics of real robots, off."""

PLANTS: dict[str, dict[str, float]] = {
    "linked_tail": {"share": 0.0, "stiffness": 0.05},
    "strip_hull": {"coefficient": 0.0, "onset": 0.4},
    "wake_oscillator": {"lift": 0.0},
    "bistable_wake": {"coefficient": 0.0},
}
"""Water and bodies of another kind than the model's, off."""

GRAVITY = 9.81
PUSH = {"push_start": 0.0, "push_step": 1.0, "push_inertial": 0.0}
ADDED = {**LIBRARY, **FOREIGN, **REAL, **PLANTS}
EXTRA = np.dtype(
    [(f"{name}_{key}", np.float64) for name, values in ADDED.items() for key in values]
    + [(name, np.float64) for name in ("wave_number", "wave_mirror", *PUSH)]
)


def wave_number(frequency: float, tank_depth: float) -> float:
    """Wave number of a frequency in water of this depth, 1/m: (2 pi f)^2 = g k tanh(k h)."""
    turn = 2.0 * math.pi * frequency
    number = turn**2 / GRAVITY
    if number > 0.0 and math.isfinite(tank_depth):
        for _ in range(100):  # a contraction: k = w^2 / (g tanh(k h)), averaged
            number = 0.5 * (number + turn**2 / (GRAVITY * math.tanh(number * tank_depth)))
    return number


def fish_record(values: Mapping[str, float]) -> np.void:
    """The record of a fish from its numbers by path."""
    record = np.zeros(1, FISH)
    for name, path in PATHS.items():
        record[name] = values[path]
    return record[0]


def extra_record(effects: Mapping[str, Mapping[str, float]]) -> np.void:
    """The record of everything added; what is not named stays off."""
    record = np.zeros(1, EXTRA)
    for name in effects:
        if name not in ADDED or set(effects[name]) - set(ADDED[name]):
            raise KeyError(f"{name}: {effects[name]}")
    for name, values in ADDED.items():
        for key, neutral in values.items():
            record[f"{name}_{key}"] = effects.get(name, {}).get(key, neutral)
    for name, value in PUSH.items():
        record[name] = value
    wave = {**ADDED["wave"], **effects.get("wave", {})}
    number = wave_number(wave["frequency"], wave["tank_depth"])
    record["wave_number"] = number
    record["wave_mirror"] = math.exp(-2.0 * number * wave["tank_depth"]) if number > 0.0 else 0.0
    return record[0]
