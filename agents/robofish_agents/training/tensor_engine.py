"""Training with PPO over tensors: a lean loop of PyTorch over the native batch.

The fish, their history and their normalisation are those of the other engines. The critic may see
the true state (:mod:`robofish_agents.training.privileged`). Episodes of different fish begin at
different times, so that every rollout has all parts of an episode.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common import logger
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.utils import set_random_seed
from torch import Tensor, nn

from fish_env.envs.layout import OBSERVATION
from fish_env.envs.registration import ENV_ID
from robofish_agents.policies.files import ACTIONS, PolicyFile
from robofish_agents.policies.network import Network
from robofish_agents.training.books import Books
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.learner_state import (
    optimiser_state,
    random_state,
    restore_optimiser,
    restore_random,
    weights_state,
    weights_tensors,
)
from robofish_agents.training.privileged import Sight
from robofish_agents.training.stack import Stack
from robofish_agents.training.tensor_ppo import (
    ActorCritic,
    Recipe,
    Samples,
    Taken,
    generalised,
    improve,
)

GROUPS = 16
"""Fish of a batch begin their episodes in so many groups, one after the other."""
LIMIT = 10.0
"""Normalised inputs of the critic are clipped to this."""


def recipe_of(config: TrainConfig) -> Recipe:
    """The settings of a configuration as a recipe of PPO over tensors."""
    ppo, network = config.ppo, config.network
    return Recipe(
        steps=ppo.n_steps,
        epochs=ppo.n_epochs,
        minibatches=ppo.n_steps * config.num_envs // ppo.batch_size,
        learning_rate=ppo.learning_rate.start,
        gamma=ppo.gamma,
        trace=ppo.gae_lambda,
        clip=ppo.clip_range,
        layers=network.layers,
        log_std=network.log_std_init,
        critic_layers=config.critic.layers or None,
        activation=network.activation,
        entropy=ppo.ent_coef,
        value_weight=ppo.vf_coef,
        largest_gradient=ppo.max_grad_norm,
    )


class TensorEngine:
    """A learner in plain PyTorch, see :class:`robofish_agents.training.engines.Engine`.

    Args:
        config: of the training.
        stack: its fish.
    """

    def __init__(self, config: TrainConfig, stack: Stack) -> None:
        self.config, self.stack = config, stack
        self.recipe = recipe_of(config)
        self._sight = self._sight_of(stack) if config.critic.privileged else None
        self._known = RunningMeanStd(shape=(self._sight.width if self._sight else 0,))
        set_random_seed(config.seed)
        (seen,) = stack.outside.observation_space.shape or (0,)
        judged = self._sight.width if self._sight else None
        self.learner = ActorCritic(seen, ACTIONS, self.recipe, judged)
        if config.network.first_action:
            self.learner.mean[-1].bias.data = torch.tensor(config.network.first_action)
        rate = config.ppo.learning_rate.start
        self.optimiser = torch.optim.Adam(self.learner.parameters(), rate, eps=1e-5)
        self._latest: np.ndarray | None = None
        self._log: logger.Logger | None = None

    @staticmethod
    def _sight_of(stack: Stack) -> Sight:
        return Sight([part.env.batch for part in stack.fish.parts])

    def imitate(self) -> None:
        """Refused by the configuration."""
        raise NotImplementedError("engine tensor does not imitate")

    def log_to(self, folder: Path) -> Callable[[str, float], object]:
        """Opens a TensorBoard log in a folder; returns a function that logs a name and a value."""
        self._log = logger.configure(str(folder), ["tensorboard"])
        return self._log.record

    def learn(self, books: Books) -> None:
        """Learns from the books' steps to those of the configuration."""
        config, steps = self.config, books.progress.steps
        if self._latest is None:
            self._latest = np.asarray(self.stack.outside.reset())
            self._stagger()
        while steps < config.total_steps:
            books.before_rollout(steps)
            taken, samples = self._collect(books, steps)
            books.after_rollout()
            steps += config.ppo.n_steps * config.num_envs
            self._set_rate(steps / config.total_steps)
            moved = improve(
                self.learner, self.optimiser, samples, self.recipe, config.ppo.target_kl
            )
            self._report(steps, taken, samples, moved)
        books.end(steps)

    def _stagger(self) -> None:
        """Lets the fish begin their later episodes in turn."""
        for part in self.stack.fish.parts:
            env = part.env
            group = np.arange(env.num_envs) * GROUPS // env.num_envs
            env.set_elapsed(group * (env.max_episode_steps // GROUPS))

    def _set_rate(self, done: float) -> None:
        rate = self.config.ppo.learning_rate
        end = rate.start if rate.end is None else rate.end
        for group in self.optimiser.param_groups:
            group["lr"] = rate.start + (end - rate.start) * min(done, 1.0)

    def _collect(self, books: Books, steps: int) -> tuple[Taken, Samples]:
        """Takes the steps of a rollout; returns its rewards and ends, and samples for an update."""
        count, outside = self.config.num_envs, self.stack.outside
        rows: list[tuple[Tensor, Tensor, Tensor]] = []
        known: list[np.ndarray] = []
        ends: list[tuple[Tensor, Tensor, Tensor]] = []
        assert self._latest is not None
        with torch.no_grad():
            for step in range(self.recipe.steps):
                seen = torch.from_numpy(self._latest)
                if self._sight:
                    known.append(self._sight.see(self._present()))
                action, density = self.learner.act(seen)
                rows.append((seen, action, density))
                limited = action.clamp(-1.0, 1.0).numpy()
                self._latest, reward, done, infos = outside.step(limited)
                ends.append(_ends(reward, done, infos))
                books.stepped(steps + (step + 1) * count)
            if self._sight:
                known.append(self._sight.see(self._present()))
            seen, action, density = (torch.stack(column) for column in zip(*rows, strict=True))
            behind = torch.from_numpy(self._latest)[None]
            judged = self._judged(known) if self._sight else torch.cat([seen, behind])
            value = self.learner.value(judged).squeeze(-1)
            taken = Taken(*(torch.stack(column) for column in zip(*ends, strict=True)))
            # The value before a truncation stands for that behind it, where an episode has begun.
            advantage, returns = generalised(taken, value, value[:-1], self.recipe)
        return taken, Samples(seen, judged[:-1], action, density, advantage, returns)

    def _present(self) -> np.ndarray:
        """The newest observations (N, 33) of the environment, not normalised."""
        return self.stack.outside.get_original_obs()[:, : len(OBSERVATION)]

    def _judged(self, known: list[np.ndarray]) -> Tensor:
        """Normalises what the critic knows, (steps + 1, N, m)."""
        rows = np.stack(known)
        self._known.update(rows.reshape(-1, rows.shape[-1]))
        normal = (rows - self._known.mean) / np.sqrt(self._known.var + 1e-8)
        return torch.from_numpy(np.clip(normal, -LIMIT, LIMIT).astype(np.float32))

    def _report(self, steps: int, taken: Taken, samples: Samples, moved: float) -> None:
        if self._log is None:
            return
        spread = samples.returns.var()
        unexplained = (samples.advantage).var() / (spread + 1e-8)
        row = {
            "rollout/reward": float(self._raw_reward),
            "train/explained_variance": float(1.0 - unexplained),
            "train/approx_kl": moved,
            "train/std": float(self.learner.log_std.exp().mean()),
            "train/learning_rate": self.optimiser.param_groups[0]["lr"],
        }
        for name, value in row.items():
            self._log.record(name, value)
        self._log.dump(steps)

    @property
    def _raw_reward(self) -> float:
        return float(np.mean(self.stack.outside.get_original_reward()))

    def policy(self, about: Mapping[str, Any]) -> PolicyFile:
        """Returns the present deterministic policy, with a card."""
        outside: Any = self.stack.outside
        layers = [layer for layer in self.learner.mean if isinstance(layer, nn.Linear)]
        network = Network(
            np.array(outside.obs_rms.mean, float),
            np.sqrt(np.array(outside.obs_rms.var, float) + outside.epsilon),
            float(outside.clip_obs),
            tuple(layer.weight.detach().numpy().copy() for layer in layers),
            tuple(layer.bias.detach().numpy().copy() for layer in layers),
            self.config.network.activation,
            "clip",
        )
        spec = self.stack.past.history.spec
        return PolicyFile(network, spec, self.config.task, ENV_ID, about)

    def state(self) -> dict[str, Any]:
        """Returns plain values from which a later process continues with the same bits."""
        known = self._known
        return {
            "weights": weights_state(self.learner.state_dict()),
            "optimiser": optimiser_state(self.optimiser),
            "latest": self._latest,
            "known": [known.mean, known.var, float(known.count)],
            "random": random_state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restores a state; the state of the fish is restored before."""
        self.learner.load_state_dict(weights_tensors(state["weights"]))
        restore_optimiser(self.optimiser, state["optimiser"])
        self._latest = state["latest"]
        self._known.mean, self._known.var, self._known.count = state["known"]
        restore_random(state["random"])

    def close(self) -> None:
        """Closes the log, which has a thread."""
        if self._log is not None:
            self._log.close()


def _ends(reward: np.ndarray, done: np.ndarray, infos: list[dict[str, Any]]) -> tuple[Tensor, ...]:
    """Rewards (N,) of a step, and whether episodes were terminated or truncated (1.0)."""
    truncated = np.zeros(len(done), np.float32)
    for lane in np.flatnonzero(done).tolist():
        truncated[lane] = infos[lane]["TimeLimit.truncated"]
    terminated = done.astype(np.float32) - truncated
    values = (np.asarray(reward, np.float32), terminated, truncated)
    return tuple(torch.from_numpy(value) for value in values)
