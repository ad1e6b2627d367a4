"""The part of `robofish demo` with the environment under a PID controller."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from rich.console import Console
from rich.progress import track

from fish_env.envs.config import EnvConfig
from fish_env.envs.registration import ENV_ID
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from robofish_agents.controllers import PIDController
from robofish_agents.episode import Episode, Float32Array
from robofish_agents.episode import swim as swim_episode
from robofish_agents.pictures import draw_actuators, draw_path, draw_tracking

SEEDS = range(20)
SHOWN = 4
"""The seed whose swims are drawn: one that begins far from its goals."""
JUDGED_S = 10.0
GOALS = {"hold": "constant goals", "track": "goals that step, ramp and swing"}
"""Task -> what it asks for."""

Env = gym.Env[Float32Array, Float32Array]


def swim(console: Console, out: Path) -> list[Path]:
    """RoboticFish3D-v0 under a PID controller.

    Args:
        console: Where words and progress go.
        out: Folder for pictures.

    Returns:
        The pictures.
    """
    pictures: list[Path] = []
    for task, goals in GOALS.items():
        env = gym.make(ENV_ID, task=task)
        config = settings(env)
        swims = _swims(env, task, console)
        for sentence in in_words(list(swims.values()), config):
            console.print(f"• {goals}: {sentence}", highlight=False)
        with console.status("drawing"):
            pictures += _pictures(task, swims[SHOWN], config, out)
        env.close()
    return pictures


def settings(env: Env) -> EnvConfig:
    """Settings of the environment below its wrappers."""
    fish = env.unwrapped
    assert isinstance(fish, RoboticFish3DEnv)
    return fish.options.config


def _swims(env: Env, task: str, console: Console) -> dict[int, Episode]:
    """Episodes of one task by seed. The first of all may have to compile the environment."""
    seeds = track(SEEDS, f"swimming task {task}", console=console, transient=True)
    return {seed: swim_episode(env, PIDController(), seed) for seed in seeds}


def in_words(swims: list[Episode], config: EnvConfig) -> list[str]:
    """Returns sentences with the errors of depth, heading and speed at the end of the episodes."""
    limits = config.tree["success"]
    count = sum(episode.succeeded for episode in swims)
    return [
        f"{count} of {len(swims)} swims from random starts succeeded: depth within "
        f"{100 * limits['depth']:g} cm, heading within {np.degrees(limits['heading']):.3g} degrees "
        f"and speed within {100 * limits['speed']:g} % for {limits['time']:g} s.",
        f"largest errors in the last {JUDGED_S:g} s, median over the swims: "
        f"{_errors(swims, np.median)}. Maximum over the swims: {_errors(swims, np.max)}.",
    ]


def _errors(swims: list[Episode], over: Callable[[list[float]], Any]) -> str:
    ends = [episode.last(JUDGED_S) for episode in swims]
    depth, heading, instant = (
        float(over([end.worst(key) for end in ends]))
        for key in ("depth_error", "heading_error", "heading_error_instant")
    )
    speed = float(over([end.worst("speed_error") / end.worst("goal_speed") for end in ends]))
    return (
        f"{100 * depth:.1f} cm, {np.degrees(heading):.1f} degrees over a tail beat "
        f"({np.degrees(instant):.1f} instantaneous) and {100 * speed:.0f} % of the speed"
    )


def _pictures(task: str, episode: Episode, config: EnvConfig, out: Path) -> list[Path]:
    title = f"{ENV_ID}, {GOALS[task]}, PID controller"
    tracking = draw_tracking(episode, config, title, out, f"swim_{task}")
    if task == "hold":
        return [tracking, draw_actuators(episode, config, out, "swim_actuators")]
    return [tracking, draw_path(episode, config, title, out, "swim_path")]
