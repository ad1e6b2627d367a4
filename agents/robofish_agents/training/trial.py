"""Evaluation of a policy during training, on episodes that it is not trained on."""

from __future__ import annotations

import numpy as np

from fish_env.envs.registration import MAX_EPISODE_STEPS
from robofish_agents.evaluation.metrics import METRICS
from robofish_agents.evaluation.record import swim_suite
from robofish_agents.evaluation.suites import Suite
from robofish_agents.registry import Agent
from robofish_agents.training.config import TrainConfig

FIRST_SEED = 2_000_000
"""Episodes of evaluations on the side; neither trainings nor suites use these."""
LOOKED_AT = ("success_rate", "depth_rmse_m", "heading_rmse_rad", "mean_power_w", "episode_return")


def try_policy(config: TrainConfig, agent: Agent) -> dict[str, float]:
    """Returns means of the metrics LOOKED_AT over episodes from random starts.

    The conditions are those of the training, each taken once and with as many episodes; the
    reward is that of the environment. ``worst_success_rate`` is that of the worst of them.
    """
    names = list(dict.fromkeys(config.disturbances))
    rows = [_under(name, config, agent) for name in names]
    means = {key: float(np.mean([row[key] for row in rows])) for key in LOOKED_AT}
    return means | {"worst_success_rate": min(row["success_rate"] for row in rows)}


def _under(name: str, config: TrainConfig, agent: Agent) -> dict[str, float]:
    options = config.options(name, training=False)
    task = options.pop("task")
    episodes = config.evaluation.episodes
    suite = Suite(name, 1, "on the side", FIRST_SEED, episodes, MAX_EPISODE_STEPS, options, {})
    record = swim_suite(suite, task, agent, threads=config.threads.environment)
    return {key: float(np.mean(METRICS[key](record))) for key in LOOKED_AT}
