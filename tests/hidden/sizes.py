"""How large each hidden effect is, chosen from the physics of a 2 kg, 29 cm fish beforehand.

A size is a strength times the typical departure from neutral: 1 in the full tiers, 0.3 in the
small one. Where the departure itself does not measure the strength (a rate limit binds less the
higher it is), `strengthen` says how.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tests.hidden.records import FOREIGN, LIBRARY, PLANTS

Draw = Callable[[np.random.Generator, float], dict[str, float]]


@dataclass(frozen=True)
class Size:
    """Typical parameters of an effect and how they are drawn.

    Attributes:
        typical: value of each parameter at strength 1.
        signed: whether the effect may act either way.
        shape: parameters that say where or how, not how much: drawn between two values.
        strengthen: value at a strength, for parameters whose departure is not the strength.
    """

    typical: Mapping[str, float]
    signed: bool = False
    shape: Mapping[str, tuple[float, float]] | None = None
    strengthen: Callable[[float, float], float] | None = None


def softer(value: float, strength: float) -> float:
    """A stiffness-like value: the effect falls with its square."""
    return value / math.sqrt(strength)


def looser_limit(value: float, strength: float) -> float:
    """A rate limit: 3.5 rad/s cuts most strokes, 6 only the fastest."""
    return value * strength**-0.45


SIZES: dict[str, Size] = {
    "tail_bias": Size({"offset": 0.06}, signed=True),
    "tail_gain": Size({"gain": 0.85}),
    "tail_asymmetry": Size({"ratio": 0.15}, signed=True),
    "servo_lag": Size({"time_constant": 0.05}),
    "servo_rate_limit": Size({"rate": 3.5}, strengthen=looser_limit),
    "servo_delay": Size({"delay": 0.06}),
    "servo_backlash": Size({"gap": 0.08}),
    "tail_flexibility": Size(
        {"natural_frequency": 5.0}, shape={"damping_ratio": (0.2, 0.5)}, strengthen=softer
    ),
    "frequency_scale": Size({"scale": 0.94}, signed=True),
    "battery_sag": Size({"rate": 0.004}),
    "block_scale": Size({"scale": 0.83}),
    "block_lag": Size({"time_constant": 0.6}),
    "added_mass": Size(
        {"surge": 0.2, "sway": 1.2, "heave": 1.0, "roll": 6e-4, "pitch": 4e-3, "yaw": 4e-3}
    ),
    "block_reaction": Size({"scale": 1.0}),
    "linear_drag": Size({"surge": 0.12, "sway": 0.5, "heave": 0.5}),
    "quadratic_damping": Size({"roll": 0.008, "pitch": 0.02, "yaw": 0.004}),
    "cross_flow_drag": Size({"sway": 12.0, "heave": 12.0}),
    "tail_reactive": Size({"scale": 0.6}),
    "wake_fraction": Size({"fraction": 0.25}),
    "wake_memory": Size({"time_constant": 0.06}),
    "offset_drag": Size({"coefficient": 10.0}),
    "buoyancy_offset": Size({"mass": 0.004}, signed=True),
    "hull_compression": Size({"rate": 0.003}),
    "water_ingress": Size({"rate": 2e-4}, shape={"x": (-0.06, 0.06)}),
    "com_offset": Size({"x": 0.0009, "y": 0.0009, "z": 0.0009}, signed=True),
    "current": Size({"north": 0.04, "east": 0.04, "down": 0.01}, signed=True),
    "wave": Size(
        {"amplitude": 0.03},
        shape={
            "frequency": (0.3, 0.8),
            "phase": (-3.0, 3.0),
            "heading": (-3.0, 3.0),
            "tank_depth": (0.8, 3.0),
        },
    ),
    "surface_drag": Size({"gain": 2.8}, shape={"depth": (0.2, 0.3)}),
    "tether": Size(
        {"stiffness": 0.02},
        shape={
            "x": (-1.0, 1.0),
            "y": (-1.0, 1.0),
            "z": (0, 0.5),
            "slack": (0.0, 0.5),
            "attach_x": (-0.1, 0.1),
        },
    ),
    "clock_scale": Size({"scale": 1.01}, signed=True),
    "sensor_delay": Size({"delay": 0.08}),
    "gyro_bias": Size({"p": 0.025, "q": 0.025, "r": 0.025}, signed=True),
    "attitude_misalignment": Size({"roll": 0.045, "pitch": 0.045, "yaw": 0.045}, signed=True),
    "depth_bias": Size({"offset": 0.08}, signed=True),
    "position_scale": Size({"scale": 1.04}, signed=True),
}
FOREIGN_SIZES: dict[str, Size] = {
    "floor_suction": Size({"gain": 5.0}, shape={"depth": (0.9, 1.3), "range": (0.15, 0.3)}),
    "sloshing": Size({"mass": 0.03}, shape={"frequency": (1.4, 1.9), "damping": (0.05, 0.12)}),
    "strip_hull": Size({"coefficient": 8.0}, shape={"onset": (0.3, 0.5)}),
    "thrust_loss": Size({"per_speed": 3.5}),
    "pump": Size({"force": 0.04, "moment": 0.001}, shape={"period": (4.0, 8.0)}),
    "thermocline": Size({"mass": 0.004}, shape={"depth": (0.5, 0.8), "width": (0.04, 0.08)}),
    "roll_yaw_damping": Size({"coefficient": 0.003}, signed=True),
    "sticking_fin": Size({"moment": 0.3}, shape={"threshold": (0.35, 0.6)}),
    "one_sided_lift": Size({"coefficient": 12.0}),
    "swirl": Size({"coefficient": 2.5e-4}, signed=True),
    "block_hysteresis": Size({"play": 0.005}),
    "pitch_heave": Size({"coefficient": 25.0}),
    "downwash": Size({"coefficient": 1.2e-3}, signed=True),
    "shear_current": Size({"rate": 0.10}, shape={"depth": (0.4, 0.8), "heading": (-3.0, 3.0)}),
    "hull_memory": Size({"time_constant": 3.0}),
    "compass_torque": Size({"moment": 6e-4}, shape={"heading": (-3.0, 3.0)}),
}
INVISIBLE = ("depth_bias",)
"""Effects that no run can show: an unknown offset of the start depth is absorbed by the start."""

EQUIVALENT = {
    "buoyancy_offset": ("parameter:mass.buoyancy",),
    "com_offset": tuple(f"parameter:mass.static_moment_rest[{i}]" for i in range(3)),
    "parameter:body.plane_xz.drag.c0": ("parameter:body.plane_xy.drag.c0",),
    "parameter:body.plane_xy.drag.c0": ("parameter:body.plane_xz.drag.c0",),
}
"""Names that say the same: both planes' drags at zero incidence act along the fish alike."""

ABSORBED = ("com_offset",)
"""Effects that are a draw from the baseline's own prior: a refit explains them."""


def draw_effect(
    name: str, strength: float, rng: np.random.Generator, spread: float = 0.15
) -> dict[str, float]:
    """Parameters of an effect at a strength, each within `spread` of typical, any sign allowed."""
    size = {**SIZES, **FOREIGN_SIZES}[name]
    return draw_values(size, {**LIBRARY, **FOREIGN, **PLANTS}[name], strength, rng, spread)


def draw_values(
    size: Size,
    neutral: Mapping[str, float],
    strength: float,
    rng: np.random.Generator,
    spread: float = 0.15,
) -> dict[str, float]:
    """As :func:`draw_effect`, of any effect with these neutral values."""
    values = {}
    for key, typical in size.typical.items():
        factor = strength * rng.uniform(1.0 - spread, 1.0 + spread)
        sign = rng.choice([-1.0, 1.0]) if size.signed else 1.0
        if size.strengthen:
            values[key] = size.strengthen(typical, factor)
        else:
            values[key] = neutral[key] + sign * factor * (typical - neutral[key])
    for key, (low, high) in (size.shape or {}).items():
        values[key] = rng.uniform(low, high)
    return {key: float(value) for key, value in values.items()}
