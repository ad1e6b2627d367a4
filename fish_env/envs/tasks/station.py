"""Station: a place to stay at, whatever the water does."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.config import EnvConfig
from fish_env.envs.layout import GoalKind
from fish_env.envs.tasks.hold import between, hold_goal


def station_goal(config: EnvConfig, draws: FloatArray) -> dict[str, FloatArray]:
    """A place in any direction from the start, within ``goal.station.distance``.

    Args:
        config: settings; ``goal.depth``, ``goal.cruise_speed`` and ``goal.station`` are used.
        draws: (GOAL_DRAWS, N) uniform in [0, 1).

    Returns:
        Goal field -> (N,), SI: place_north, place_east and depth_base are the place, heading_base
        (rad) the bearing to it from the start, and cruise_speed the largest speed.
    """
    goals = hold_goal(config, draws)
    bearing = goals["heading_base"]
    distance = between(config.tree["goal"]["station"]["distance"], draws[3])
    return goals | {
        "kind": np.full(len(bearing), float(GoalKind.PLACE)),
        "place_north": distance * np.cos(bearing),
        "place_east": distance * np.sin(bearing),
    }
