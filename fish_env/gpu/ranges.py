"""Settings from which starts are drawn on the device: where each stands in one flat array."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.config import EnvConfig

_PAIRS = (
    "depth",
    "cruise_speed",
    "surge",
    "tank",
    *(f"{channel}_{part}" for channel in ("depth", "heading") for part in ("step", "ramp", "sine")),
    "step_time",
    "ramp_time",
    "ramp_duration",
    "sine_period",
    "helix_radius",
    "helix_pitch",
    "helix_turns",
    "leg",
    "turn",
    "slope",
    "figure_radius",
    "figure_swing",
    "station_distance",
    "walls_north",
    "walls_east",
    "shape_ends",
)
_SINGLE = ("depth_offset", "heading_offset", "tilt", "walled")
NAMES = (*(f"{name}_{end}" for name in _PAIRS for end in ("low", "high")), *_SINGLE)


def at(name: str) -> int:
    """Index of a setting, or of the low end of a range; the high end follows it."""
    return NAMES.index(name) if name in _SINGLE else NAMES.index(f"{name}_low")


def pack_ranges(config: EnvConfig) -> FloatArray:
    """The settings as an array (len(NAMES),), SI and radians."""
    goal, start = config.tree["goal"], config.tree["start"]
    track, path = goal["track"], goal["path"]
    walls = config.tree["tank"]["walls"]
    share = np.array([path["share"][shape] for shape in ("helix", "waypoints", "figure")])
    ends = np.cumsum(share) / share.sum()
    pairs = {
        "depth": goal["depth"],
        "cruise_speed": goal["cruise_speed"],
        "surge": start["surge"],
        "tank": (config.top, config.bottom),
        **{
            f"{channel}_{part}": track[part][channel]
            for channel in ("depth", "heading")
            for part in ("step", "ramp", "sine")
        },
        "step_time": track["step"]["time"],
        "ramp_time": track["ramp"]["time"],
        "ramp_duration": track["ramp"]["duration"],
        "sine_period": track["sine"]["period"],
        "helix_radius": path["helix"]["radius"],
        "helix_pitch": path["helix"]["pitch"],
        "helix_turns": path["helix"]["turns"],
        "leg": path["waypoints"]["leg"],
        "turn": path["waypoints"]["turn"],
        "slope": path["waypoints"]["slope"],
        "figure_radius": path["figure"]["radius"],
        "figure_swing": path["figure"]["swing"],
        "station_distance": goal["station"]["distance"],
        "walls_north": (0.0, 0.0) if walls is None else walls[:2],
        "walls_east": (0.0, 0.0) if walls is None else walls[2:],
        "shape_ends": ends[:2],
    }
    single = [start["depth_offset"], start["heading_offset"], start["tilt"], walls is not None]
    return np.array([*(end for name in _PAIRS for end in pairs[name]), *single], float)
