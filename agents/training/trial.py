"""Evaluation on the side: a policy on episodes that it is not trained on."""

from __future__ import annotations

import numpy as np

from agents.evaluation.metrics import METRICS
from agents.evaluation.record import swim_suite
from agents.evaluation.suites import Suite
from agents.registry import Agent
from agents.training.config import TrainConfig
from fish_env.envs.registration import MAX_EPISODE_STEPS

FIRST_SEED = 2_000_000
"""Episodes of evaluations on the side; neither trainings nor suites use these."""
LOOKED_AT = ("success_rate", "depth_rmse_m", "heading_rmse_rad", "mean_power_w", "episode_return")


def try_policy(config: TrainConfig, agent: Agent) -> dict[str, float]:
    """Means of the metrics LOOKED_AT over episodes from random starts.

    The conditions are those of the training, the reward is that of the environment.
    """
    options = config.options(training=False)
    task = options.pop("task")
    episodes = config.evaluation.episodes
    suite = Suite(
        "side", 1, "evaluation on the side", FIRST_SEED, episodes, MAX_EPISODE_STEPS, options, {}
    )
    record = swim_suite(suite, task, agent, threads=config.threads.environment)
    return {name: float(np.mean(METRICS[name](record))) for name in LOOKED_AT}
