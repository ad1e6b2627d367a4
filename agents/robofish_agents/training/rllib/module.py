"""The networks that RLlib trains, with the shapes and names that Stable-Baselines3 gives them."""

from __future__ import annotations

from typing import Any

import torch
from ray.rllib.core.columns import Columns
from ray.rllib.core.distribution.torch.torch_distribution import TorchDiagGaussian
from ray.rllib.core.rl_module.apis.value_function_api import ValueFunctionAPI
from ray.rllib.core.rl_module.torch import TorchRLModule
from torch import nn

from robofish_agents.training.actor_critic import ACTIVATION


class FishModule(TorchRLModule, ValueFunctionAPI):  # type: ignore[misc]
    """A perceptron for mean actions, one for values, and free standard deviations.

    ``model_config`` has the ``layers`` and the ``activation`` of the training. A state of
    Stable-Baselines3's ``MlpPolicy`` fits as it is.
    """

    def setup(self) -> None:
        """Makes the networks."""
        seen, acted = self.observation_space.shape[0], self.action_space.shape[0]
        layers = self.model_config["layers"]
        kind = ACTIVATION[self.model_config["activation"]]
        names = ("policy_net", "value_net")
        self.mlp_extractor = nn.ModuleDict({name: _hidden(seen, layers, kind) for name in names})
        self.action_net = nn.Linear(layers[-1], acted)
        self.value_net = nn.Linear(layers[-1], 1)
        self.log_std = nn.Parameter(torch.zeros(acted))

    def _forward(self, batch: dict[str, Any], **kwargs: Any) -> dict[str, Any]:
        mean = self.action_net(self.mlp_extractor["policy_net"](batch[Columns.OBS]))
        spread = self.log_std.expand_as(mean)
        return {Columns.ACTION_DIST_INPUTS: torch.cat([mean, spread], dim=-1)}

    def compute_values(self, batch: dict[str, Any], embeddings: Any = None) -> torch.Tensor:
        """Values (N,) of the observations of a batch."""
        hidden = self.mlp_extractor["value_net"](batch[Columns.OBS])
        values: torch.Tensor = self.value_net(hidden).squeeze(-1)
        return values

    def get_exploration_action_dist_cls(self) -> Any:
        """Normal and independent."""
        return TorchDiagGaussian

    def get_train_action_dist_cls(self) -> Any:
        """Normal and independent."""
        return TorchDiagGaussian

    def get_inference_action_dist_cls(self) -> Any:
        """Normal and independent."""
        return TorchDiagGaussian


def _hidden(seen: int, layers: tuple[int, ...], kind: type[nn.Module]) -> nn.Sequential:
    parts: list[nn.Module] = []
    for before, after in zip((seen, *layers), layers, strict=False):
        parts += [nn.Linear(before, after), kind()]
    return nn.Sequential(*parts)
