"""Tasks: what the goal of an episode is. ``hold`` keeps it constant, ``track`` moves it."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from fish_env.envs.config import EnvConfig
from fish_env.envs.tasks.hold import hold_goal
from fish_env.envs.tasks.track import track_goal

FloatArray = npt.NDArray[np.float64]
Goals = dict[str, FloatArray]

TASKS: dict[str, Callable[[EnvConfig, FloatArray], Goals]] = {
    "hold": hold_goal,
    "track": track_goal,
}
"""Task name -> function from settings and uniform draws (GOAL_DRAWS, N) to goals (N,) each."""

GOAL_DRAWS = 16
"""Uniform numbers in [0, 1) that a task may use for one episode."""
