"""Simulation, Gymnasium environment and identification of a tail-driven robotic fish."""

from typing import TYPE_CHECKING, Any

from fish_env.envs.registration import register_envs
from fish_env.params.io import list_fish, load_fish
from fish_env.params.schema import FishParams
from fish_env.simulator import InitialState, Simulator, schedule
from fish_env.trajectory import Trajectory
from fish_env.version import VERSION

if TYPE_CHECKING:
    from fish_env.analysis import compare, diagnose, fit

__version__ = VERSION

register_envs()

__all__ = [
    "FishParams",
    "InitialState",
    "Simulator",
    "Trajectory",
    "compare",
    "diagnose",
    "fit",
    "list_fish",
    "load_fish",
    "schedule",
]


def __getattr__(name: str) -> Any:
    # Loaded when asked for: the environment needs neither fits nor diagnoses.
    if name not in ("compare", "diagnose", "fit"):
        raise AttributeError(f"module 'fish_env' has no attribute '{name}'")
    from fish_env import analysis

    return getattr(analysis, name)
