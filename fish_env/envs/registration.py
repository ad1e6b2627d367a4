"""Registers ``RoboticFish3D-v0`` with Gymnasium."""

from __future__ import annotations

import gymnasium as gym

ENV_ID = "RoboticFish3D-v0"
MAX_EPISODE_STEPS = 400


def register_envs() -> None:
    """Register the environments once; entry points are strings, so specs can be pickled."""
    if ENV_ID in gym.registry:
        return
    gym.register(
        ENV_ID,
        entry_point="fish_env.envs.robotic_fish_3d:RoboticFish3DEnv",
        vector_entry_point="fish_env.envs.vector:RoboticFish3DVectorEnv",
        max_episode_steps=MAX_EPISODE_STEPS,
        reward_threshold=370.0,
    )
