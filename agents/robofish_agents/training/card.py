"""The card of a trained policy: origin, costs and scores."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fish_env.envs.registration import ENV_ID
from robofish_agents.training.checkpoint import Progress
from robofish_agents.training.config import TrainConfig

MADE_WITH = ("robotic-fish", "stable-baselines3", "torch", "gymnasium", "numpy")


def card(config: TrainConfig, progress: Progress, row: dict[str, float]) -> dict[str, Any]:
    """Returns origin, costs and scores of a policy as plain numbers and texts.

    Args:
        config: the training.
        progress: its steps and times when the policy was taken.
        row: the evaluation of this policy during training.
    """
    made_with = (*MADE_WITH, "ray") if config.engine == "rllib" else MADE_WITH
    return {
        "environment": ENV_ID,
        "task": config.task,
        "seed": config.seed,
        "training": {
            "steps": progress.steps,
            "cpu_s": round(progress.cpu_s, 1),
            "wall_s": round(progress.wall_s, 1),
            "processor": processor(),
        },
        "evaluation_on_the_side": {name: round(value, 5) for name, value in row.items()},
        "made_with": {name: version(name) for name in made_with},
        "configuration": config.tree(),
    }


def shares(progress: Progress, env_cpu_s: float) -> dict[str, float]:
    """Returns how the processor time of training is divided.

    Returns:
        ``imitation``: what came before learning, if anything; of the rest,
        ``environment``: physics and its adapter; ``inference``: the rest of collecting experience
        (actions, values, normalisation, buffers); ``gradient``: updates, and what is left.
    """
    total = max(progress.cpu_s, 1e-9)
    imitation = progress.imitation_cpu_s
    before = {"imitation": imitation / total} if imitation else {}
    return before | {
        "environment": env_cpu_s / total,
        "inference": (progress.rollout_cpu_s - env_cpu_s) / total,
        "gradient": (progress.cpu_s - imitation - progress.rollout_cpu_s) / total,
    }


def processor() -> str:
    """Returns the name of the processor."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
