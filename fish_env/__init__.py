"""Simulation, Gymnasium environment and identification of a tail-driven robotic fish."""

from fish_env.envs.registration import register_envs
from fish_env.params.io import list_fish, load_fish
from fish_env.params.schema import FishParams
from fish_env.simulator import InitialState, Simulator, schedule
from fish_env.trajectory import Trajectory

__version__ = "0.1.0"

register_envs()

__all__ = [
    "FishParams",
    "InitialState",
    "Simulator",
    "Trajectory",
    "list_fish",
    "load_fish",
    "schedule",
]
