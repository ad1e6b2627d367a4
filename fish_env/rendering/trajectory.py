"""Scenes of a simulated trajectory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fish_env.model.frames import euler_from_quaternion
from fish_env.model.state import INPUTS
from fish_env.rendering.scene import Goal, Scene, Setting, Tank
from fish_env.rendering.shape import FishShape

if TYPE_CHECKING:
    from fish_env.params.schema import FishParams
    from fish_env.trajectory import Trajectory

ROOM_M = 0.35
"""m of water left above and below a trajectory that leaves the default tank."""
WAKE_S = 30.0


def scenes_of(
    trajectory: Trajectory,
    fish: FishParams,
    goal: Goal | None = None,
    label: str = "",
    tank: Tank | None = None,
) -> tuple[Setting, list[Scene]]:
    """The setting and the scenes of a trajectory, one for each sample.

    Args:
        trajectory: sampled at 20 Hz or more, or else the tail's angle between samples is taken
            from its beat.
        fish: whose shape is drawn.
        goal: shown throughout.
        label: words in the corner.
        tank: the water; default: one that holds the whole trajectory.
    """
    position = trajectory.states[:, :3]
    setting = Setting(FishShape.of(fish), tank or _tank(position[:, 2]))
    low, high = trajectory.inputs.min(axis=0), trajectory.inputs.max(axis=0)
    setting = Setting(
        setting.shape,
        setting.tank,
        np.minimum(setting.low, low),
        np.maximum(setting.high, high),
    )
    quaternion = trajectory.states[:, 3:7]
    euler = euler_from_quaternion(quaternion)
    phase = trajectory["tail_phase"]
    tail = trajectory.inputs[:, 0] + trajectory.inputs[:, 1] * np.sin(phase)
    first = np.searchsorted(trajectory.time_s, trajectory.time_s - WAKE_S)
    return setting, [
        Scene(
            float(trajectory.time_s[i]),
            position[i],
            quaternion[i],
            euler[i],
            float(trajectory["u"][i]),
            float(tail[i]),
            float(phase[i]),
            trajectory.inputs[i, : len(INPUTS)],
            position[first[i] : i],
            goal,
            label,
        )
        for i in range(len(trajectory))
    ]


def _tank(depth: np.ndarray) -> Tank:
    """The default tank, or one around depths (T,) that leave it."""
    default = Tank()
    top = min(default.top, float(depth.min()) - ROOM_M)
    bottom = max(default.bottom, float(depth.max()) + ROOM_M)
    return default if top < 0.0 and depth.min() > 0.0 else Tank(top, bottom)
