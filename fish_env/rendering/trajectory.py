"""Scenes of a simulated trajectory."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fish_env.arrays import FloatArray
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
    *,
    goal: Goal | None = None,
    label: str = "",
    tank: Tank | None = None,
    tail_angle: FloatArray | None = None,
) -> tuple[Setting, list[Scene]]:
    """The setting and the scenes of a trajectory, one for each sample.

    Args:
        trajectory: what the fish did.
        fish: whose shape is drawn.
        goal: shown throughout.
        label: words in the corner.
        tank: the water; default: one that holds the whole trajectory.
        tail_angle: (T,) angle of the tail (rad), ``Simulator.outputs(trajectory)["tail_angle"]``;
            default: that of an ideal servo.
    """
    low, high = trajectory.inputs.min(axis=0), trajectory.inputs.max(axis=0)
    usual = Setting(FishShape.of(fish), tank or tank_around(trajectory["z"]))
    setting = replace(usual, low=np.minimum(usual.low, low), high=np.maximum(usual.high, high))
    phase = trajectory["tail_phase"]
    ideal = trajectory.inputs[:, 0] + trajectory.inputs[:, 1] * np.sin(phase)
    tail = ideal if tail_angle is None else tail_angle
    position = trajectory.states[:, :3]
    first = np.searchsorted(trajectory.time_s, trajectory.time_s - WAKE_S)
    return setting, [
        Scene(
            time_s=float(trajectory.time_s[i]),
            position=position[i],
            quaternion=trajectory.states[i, 3:7],
            speed=float(trajectory.states[i, 7]),
            tail_angle=float(tail[i]),
            tail_phase=float(phase[i]),
            actuators=trajectory.inputs[i],
            wake=position[first[i] : i],
            goal=goal,
            label=label,
        )
        for i in range(len(trajectory))
    ]


def tank_around(depth: FloatArray) -> Tank:
    """The usual tank, made higher or deeper if depths (T,) (m) leave it."""
    usual = Tank()
    low, high = float(depth.min()), float(depth.max())
    top = usual.top if low > usual.top else low - ROOM_M
    return Tank(top, usual.bottom if high < usual.bottom else high + ROOM_M)
