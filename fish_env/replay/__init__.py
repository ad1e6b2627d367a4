"""Replay: a page that opens offline, with fish swimming in three dimensions beside time plots."""

from fish_env.replay.motion import (
    Group,
    Motion,
    motion_from_channels,
    motion_from_run,
    motion_from_trajectory,
    motion_of_goals,
)
from fish_env.replay.page import component, component_scripts, component_style, write_replay

__all__ = [
    "Group",
    "Motion",
    "component",
    "component_scripts",
    "component_style",
    "motion_from_channels",
    "motion_from_run",
    "motion_from_trajectory",
    "motion_of_goals",
    "write_replay",
]
