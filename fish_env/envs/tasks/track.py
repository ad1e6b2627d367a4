"""Track: depth and heading references that step, ramp or swing, independently of each other."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.config import EnvConfig
from fish_env.envs.tasks.hold import between, hold_goal


def track_goal(config: EnvConfig, draws: FloatArray) -> dict[str, FloatArray]:
    """One signal in {step, ramp, sine} for depth and one for heading, with random sign.

    Depth signals are shrunk where needed so that the goal stays inside ``goal.depth``, widened by
    the same margin that this range keeps to the tank.
    """
    goals = hold_goal(config, draws)
    for channel, first in (("depth", 3), ("heading", 9)):
        goals |= _signal(config, channel, draws[first : first + 6])
    return _inside_tank(config, goals)


def _signal(config: EnvConfig, channel: str, draws: FloatArray) -> dict[str, FloatArray]:
    track = config.tree["goal"]["track"]
    kind = np.floor(3.0 * draws[0])
    sign = np.where(draws[1] < 0.5, -1.0, 1.0)
    start = between(track["ramp"]["time"], draws[3])
    return {
        f"{channel}_step": (kind == 0) * sign * between(track["step"][channel], draws[2]),
        f"{channel}_step_time": between(track["step"]["time"], draws[3]),
        f"{channel}_ramp_rate": (kind == 1) * sign * between(track["ramp"][channel], draws[2]),
        f"{channel}_ramp_start": start,
        f"{channel}_ramp_end": start + between(track["ramp"]["duration"], draws[4]),
        f"{channel}_sine_amplitude": (kind == 2) * sign * between(track["sine"][channel], draws[2]),
        f"{channel}_sine_frequency": 1.0 / between(track["sine"]["period"], draws[4]),
        f"{channel}_sine_phase": np.zeros_like(sign),
    }


def _inside_tank(config: EnvConfig, goals: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Turn depth signals round that would leave the goal range, and shrink what still would."""
    low, high = config.tree["goal"]["depth"]
    low, high = (low + config.top) / 2, (high + config.bottom) / 2
    base = goals["depth_base"]
    ramped = goals["depth_ramp_rate"] * (goals["depth_ramp_end"] - goals["depth_ramp_start"])
    one_way = goals["depth_step"] + ramped
    up, down = base - low, high - base
    sign = np.where((one_way > down) & (up > down), -1.0, 1.0)
    sign = np.where((-one_way > up) & (down > up), -1.0, sign)
    room = np.where(one_way * sign > 0, down, up)
    size = np.abs(one_way)
    shrink = np.where(size > room, room / np.where(size > 0, size, 1.0), 1.0) * sign
    swing = np.abs(goals["depth_sine_amplitude"])
    fit = np.minimum(up, down) / np.where(swing > 0, swing, 1.0)
    goals["depth_step"] = goals["depth_step"] * shrink
    goals["depth_ramp_rate"] = goals["depth_ramp_rate"] * shrink
    goals["depth_sine_amplitude"] = goals["depth_sine_amplitude"] * np.minimum(fit, 1.0)
    return goals
