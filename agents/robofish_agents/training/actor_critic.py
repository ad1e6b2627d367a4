"""The networks that PPO over tensors trains, and its settings."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import torch
from torch import Tensor, nn

ACTIVATION: dict[str, type[nn.Module]] = {"tanh": nn.Tanh, "relu": nn.ReLU}


@dataclass(frozen=True)
class Recipe:
    """What a training does.

    Attributes:
        iterations: rollouts, each followed by an update.
        steps: control steps of each fish in a rollout.
        epochs: passes of an update over its rollout.
        minibatches: gradient steps of a pass.
        learning_rate: at the start; falls linearly to zero.
        gamma: discount of a control step.
        trace: decay lambda of the advantages.
        clip: largest change of the ratio of probabilities that is rewarded.
        layers: widths of hidden layers, of policy and value each.
        log_std: logarithm of the deviation of actions at the start.
        critic_layers: widths of hidden layers of the value; None: as ``layers``.
        activation: of hidden layers, ``tanh`` or ``relu``.
        entropy: weight of the entropy of actions in the loss.
        value_weight: weight of the squared error of values in the loss.
        largest_gradient: longer gradients are shortened to this norm.
    """

    iterations: int = 40
    steps: int = 32
    epochs: int = 5
    minibatches: int = 8
    learning_rate: float = 2e-3
    gamma: float = 0.98
    trace: float = 0.95
    clip: float = 0.2
    layers: tuple[int, ...] = (64, 64)
    log_std: float = -0.5
    critic_layers: tuple[int, ...] | None = None
    activation: str = "tanh"
    entropy: float = 0.0
    value_weight: float = 0.5
    largest_gradient: float = 0.5

    def shortened(self, iterations: int) -> Recipe:
        """The same with fewer iterations."""
        return replace(self, iterations=iterations)


HOLD = Recipe(minibatches=4, learning_rate=3e-3)
"""Learns `hold` in still water, with HOLD_FISH fish, in few gradient steps: on a GPU, a minibatch
takes about as long whatever its size."""
HOLD_FISH = 2048


class ActorCritic(nn.Module):
    """A normal policy of actions, and the value of what the critic sees."""

    def __init__(
        self, observed: int, actions: int, recipe: Recipe, judged: int | None = None
    ) -> None:
        """Draw the weights.

        Args:
            observed: numbers of an observation.
            actions: numbers of an action.
            recipe: layers and deviation.
            judged: numbers that the critic sees; None: it sees the observation.
        """
        super().__init__()
        widths = recipe.layers if recipe.critic_layers is None else recipe.critic_layers
        between = ACTIVATION[recipe.activation]
        self.mean = _perceptron(observed, recipe.layers, actions, 0.01, between)
        self.value = _perceptron(judged or observed, widths, 1, 1.0, between)
        self.log_std = nn.Parameter(torch.full((actions,), recipe.log_std))

    def log_probability(self, observed: Tensor, actions: Tensor) -> Tensor:
        """Logarithm of the density (N,) of actions (N, actions)."""
        scaled = (actions - self.mean(observed)) * torch.exp(-self.log_std)
        constant = actions.shape[-1] * 0.5 * math.log(2.0 * math.pi)
        density: Tensor = -0.5 * (scaled * scaled).sum(-1) - self.log_std.sum() - constant
        return density

    def act(self, observed: Tensor) -> tuple[Tensor, Tensor]:
        """Drawn actions (N, actions) and the logarithm of their density (N,)."""
        mean = self.mean(observed)
        noise = torch.randn_like(mean)
        constant = noise.shape[-1] * 0.5 * math.log(2.0 * math.pi)
        density = -0.5 * (noise * noise).sum(-1) - self.log_std.sum() - constant
        return mean + noise * torch.exp(self.log_std), density


def _perceptron(
    inputs: int,
    widths: tuple[int, ...],
    outputs: int,
    gain: float,
    between: type[nn.Module] = nn.Tanh,
) -> nn.Sequential:
    layers: list[nn.Module] = []
    for width in widths:
        layers += [_linear(inputs, width, math.sqrt(2.0)), between()]
        inputs = width
    return nn.Sequential(*layers, _linear(inputs, outputs, gain))


def _linear(inputs: int, outputs: int, gain: float) -> nn.Linear:
    layer = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer
