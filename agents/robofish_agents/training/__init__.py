"""Training with Stable-Baselines3: configuration, environment, checkpoints, the loop."""

import fish_env.envs.sb3  # noqa: F401  (says which extra is missing, before anything else fails)
