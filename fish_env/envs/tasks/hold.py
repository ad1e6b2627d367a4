"""Hold: constant depth, heading and cruise speed."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.config import EnvConfig


def between(bounds: list[float], draw: FloatArray) -> FloatArray:
    """Uniform draw in [0, 1) mapped to a range [low, high]."""
    low, high = bounds
    return np.asarray(low + (high - low) * draw)


def hold_goal(config: EnvConfig, draws: FloatArray) -> dict[str, FloatArray]:
    """Constant references.

    Args:
        config: settings; ``goal.depth`` and ``goal.cruise_speed`` are used.
        draws: (GOAL_DRAWS, N) uniform in [0, 1).

    Returns:
        Goal field -> (N,); fields that are absent are zero (see layout.GOAL).
    """
    goal = config.tree["goal"]
    return {
        "depth_base": between(goal["depth"], draws[0]),
        "heading_base": np.pi * (2.0 * draws[1] - 1.0),
        "cruise_speed": between(goal["cruise_speed"], draws[2]),
    }
