"""The networks that PPO over tensors trains, and its settings."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import torch
from torch import Tensor, nn

from fish_env.arrays import FloatArray
from robofish_agents.policies.network import Network

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
        reward_scale: rewards are multiplied by this.
        log_std_end: largest logarithm of the deviation at the end; the limit falls linearly from
            ``log_std``. None: no limit.
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
    reward_scale: float = 1.0
    log_std_end: float | None = None

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
        self.activation = recipe.activation
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

    def limit_noise(self, recipe: Recipe, done: float) -> None:
        """Let the policy explore less, the larger the share of a training is that is done."""
        if recipe.log_std_end is not None:
            limit = recipe.log_std + (recipe.log_std_end - recipe.log_std) * min(done, 1.0)
            with torch.no_grad():
                self.log_std.clamp_(max=limit)

    def act(self, observed: Tensor) -> tuple[Tensor, Tensor]:
        """Drawn actions (N, actions) and the logarithm of their density (N,)."""
        mean = self.mean(observed)
        noise = torch.randn_like(mean)
        constant = noise.shape[-1] * 0.5 * math.log(2.0 * math.pi)
        density = -0.5 * (noise * noise).sum(-1) - self.log_std.sum() - constant
        return mean + noise * torch.exp(self.log_std), density


def network_of(
    policy: ActorCritic, mean: FloatArray, deviation: FloatArray, limit: float
) -> Network:
    """The deterministic policy in NumPy.

    Args:
        policy: trained on normalised observations.
        mean: (n,) what was subtracted from observations.
        deviation: (n,) what the rest was divided by.
        limit: what the result was clipped to.
    """
    layers = [layer for layer in policy.mean if isinstance(layer, nn.Linear)]
    return Network(
        mean,
        deviation,
        limit,
        tuple(layer.weight.detach().cpu().numpy().copy() for layer in layers),
        tuple(layer.bias.detach().cpu().numpy().copy() for layer in layers),
        policy.activation,
        "clip",
    )


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
