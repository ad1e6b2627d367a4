"""Registers ``RoboticFish3D-v0`` with Gymnasium, and with OpenAI gym before 0.26."""

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


def register_with_gym() -> None:
    """Register with OpenAI gym, which calls this when it is imported.

    From 0.26 on, gym calls environments as Gymnasium does; those programs can use Gymnasium.
    """
    from gym.envs.registration import register
    from gym.version import VERSION

    if tuple(int(part) for part in VERSION.split(".")[:2]) < (0, 26):
        register(
            ENV_ID,
            entry_point="fish_env.envs.openai_gym:OpenAIGymRoboticFish3DEnv",
            max_episode_steps=MAX_EPISODE_STEPS,
        )
