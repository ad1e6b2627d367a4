"""Converts a policy of Stable-Baselines3 to a :class:`PolicyFile`, which needs no PyTorch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from fish_env.envs.registration import ENV_ID
from fish_env.errors import ConfigError
from robofish_agents.policies.files import PolicyFile
from robofish_agents.policies.history import HistorySpec
from robofish_agents.policies.network import Network

ACTIVATION_OF = {nn.Tanh: "tanh", nn.ReLU: "relu"}


def export_policy(
    model: PPO | SAC,
    normalise: VecNormalize,
    history: HistorySpec,
    task: str,
    card: Mapping[str, Any],
) -> PolicyFile:
    """Returns the deterministic policy of a model, with its normalisation.

    Raises:
        ConfigError: a policy file cannot hold such a network.
    """
    if isinstance(model, PPO):
        policy: Any = model.policy
        hidden, last, output = policy.mlp_extractor.policy_net, policy.action_net, "clip"
    else:
        hidden, last, output = model.actor.latent_pi, model.actor.mu, "tanh"
    layers = [layer for layer in hidden if isinstance(layer, nn.Linear)]
    kinds = {type(layer) for layer in hidden} - {nn.Linear}
    if len(kinds) != 1 or not kinds <= set(ACTIVATION_OF):
        raise ConfigError(f"a policy file knows layers with tanh or relu between, not {kinds}")
    layers.append(last)
    rms: Any = normalise.obs_rms
    network = Network(
        np.array(rms.mean, float),
        np.sqrt(np.array(rms.var, float) + normalise.epsilon),
        float(normalise.clip_obs),
        tuple(layer.weight.detach().numpy().copy() for layer in layers),
        tuple(layer.bias.detach().numpy().copy() for layer in layers),
        ACTIVATION_OF[kinds.pop()],
        output,
    )
    return PolicyFile(network, history, task, ENV_ID, card)
