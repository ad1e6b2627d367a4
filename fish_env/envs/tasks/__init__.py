"""Tasks: what the goal of an episode is.

``hold`` keeps depth and heading constant, ``track`` moves them, ``path`` is a path in three
dimensions and ``station`` a place to stay at.
"""

from collections.abc import Callable

from fish_env.arrays import FloatArray
from fish_env.envs.config import EnvConfig
from fish_env.envs.tasks.hold import hold_goal
from fish_env.envs.tasks.path import path_goal
from fish_env.envs.tasks.station import station_goal
from fish_env.envs.tasks.track import track_goal

Goals = dict[str, FloatArray]

TASKS: dict[str, Callable[[EnvConfig, FloatArray], Goals]] = {
    "hold": hold_goal,
    "track": track_goal,
    "path": path_goal,
    "station": station_goal,
}
"""Task name -> function from settings and uniform draws (GOAL_DRAWS, N) to goals (N,) each."""

SIGNAL_TASKS = ("hold", "track")
"""Tasks whose goals are signals over time: agents are trained, tuned and shipped for these."""

GOAL_DRAWS = 16
"""Uniform numbers in [0, 1) that a task may use for one episode."""
