"""The learner of a configuration, by Stable-Baselines3."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.utils import LinearSchedule

from robofish_agents.training.actor_critic import ACTIVATION
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.settings import LearningRate
from robofish_agents.training.stack import Stack

Model = PPO | SAC


def make_model(config: TrainConfig, stack: Stack) -> Model:
    """Makes an untrained learner."""
    network = config.network
    policy: dict[str, Any] = {
        "net_arch": list(network.layers),
        "activation_fn": ACTIVATION[network.activation],
    }
    common: dict[str, Any] = {"device": "cpu", "seed": config.seed}
    if config.algorithm == "ppo":
        policy["log_std_init"] = network.log_std_init
        learner = PPO("MlpPolicy", stack.outside, policy_kwargs=policy, **_of(config.ppo), **common)
        if network.first_action:
            bias = learner.policy.action_net.get_parameter("bias")
            bias.data = torch.tensor(network.first_action)
        return learner
    settings = _of(config.sac)
    return SAC("MlpPolicy", stack.outside, policy_kwargs=policy, **settings, **common)


def _of(settings: Any) -> dict[str, Any]:
    values = asdict(settings)
    return values | {"learning_rate": _schedule(settings.learning_rate)}


def _schedule(rate: LearningRate) -> float | LinearSchedule:
    return rate.start if rate.end is None else LinearSchedule(rate.start, rate.end, 1.0)
