"""Training with Ray RLlib.

RLlib's PPO collects experience from the native batch and learns from it, in this process. The
networks begin as those of Stable-Baselines3, imitation included, and are exported like them.
"""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import torch
from ray.rllib.core import DEFAULT_MODULE_ID
from ray.rllib.utils.metrics import LEARNER_RESULTS
from stable_baselines3 import PPO
from stable_baselines3.common import logger

from fish_env.cluster import ClusterSettings, connected
from robofish_agents.policies.export import export_policy
from robofish_agents.policies.files import PolicyFile
from robofish_agents.training.books import Books
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.imitation import imitate
from robofish_agents.training.learner_state import (
    optimiser_state,
    random_state,
    restore_optimiser,
    restore_random,
    weights_state,
    weights_tensors,
)
from robofish_agents.training.model import make_model
from robofish_agents.training.rllib.runner import BatchRunner
from robofish_agents.training.rllib.settings import build
from robofish_agents.training.stack import Stack

EPISODE = ("ep_rew_mean", "ep_len_mean", "success_rate")
"""Means over the episodes that ended in a rollout, named as in Stable-Baselines3."""


class RllibEngine:
    """A learner of RLlib, see :class:`robofish_agents.training.engines.Engine`.

    Args:
        config: of the training.
        stack: its fish.

    Raises:
        ConfigError: Ray cannot be started.
    """

    def __init__(self, config: TrainConfig, stack: Stack) -> None:
        self.config, self.stack = config, stack
        first = make_model(config, stack)
        assert isinstance(first, PPO)
        # Networks of Stable-Baselines3: where learning begins, and the form of exported policies.
        self.shape = first
        self._open = ExitStack()
        self._log: logger.Logger | None = None
        try:
            self._open.enter_context(connected(ClusterSettings(cpus=1)))
            place = self._open.enter_context(tempfile.TemporaryDirectory())
            logging.getLogger("ray.rllib").setLevel(logging.ERROR)
            self.algorithm = build(config, stack, place)
            self._open.callback(self.algorithm.stop)
        except BaseException:
            self._open.close()
            raise
        self._take_over()

    @property
    def runner(self) -> BatchRunner:
        """The environment runner, which collects experience."""
        found: BatchRunner = self.algorithm.env_runner
        return found

    @property
    def _learner(self) -> Any:
        (learner,) = self.algorithm.learner_group.foreach_learner(lambda each: each)
        return learner.get()

    @property
    def _networks(self) -> Any:
        return self._learner.module[DEFAULT_MODULE_ID]

    def _take_over(self) -> None:
        """Copies the networks of Stable-Baselines3 into RLlib."""
        self._put(self.shape.policy.state_dict())

    def _put(self, weights: Mapping[str, torch.Tensor]) -> None:
        self._networks.load_state_dict(dict(weights))
        self.runner.module.load_state_dict(dict(weights))

    def imitate(self) -> None:
        """Fits policy and values to the configuration's teacher."""
        imitate(self.shape, self.stack, self.config, self.config.imitate)
        self._take_over()

    def log_to(self, folder: Path) -> Callable[[str, float], object]:
        """Opens a TensorBoard log in a folder; returns a function that logs a name and a value."""
        self._log = logger.configure(str(folder), ["tensorboard"])
        self._open.callback(self._log.close)
        return self._log.record

    def learn(self, books: Books) -> None:
        """Learns from the books' steps to those of the configuration."""
        runner, optimiser = self.runner, self._learner.get_optimizer()
        total, rollout = self.config.total_steps, self.config.ppo.n_steps * self.config.num_envs
        runner.books, runner.steps = books, books.progress.steps
        books.begin()
        while runner.steps < total:
            books.before_rollout(runner.steps)
            for group in optimiser.param_groups:
                group["lr"] = self._rate((runner.steps + rollout) / total)
            self._record(self.algorithm.train())
        books.end(runner.steps)

    def _rate(self, done: float) -> float:
        """Step size of Adam after this share of the training, as in Stable-Baselines3."""
        rate = self.config.ppo.learning_rate
        if rate.end is None:
            return rate.start
        return rate.start + min(done, 1.0) * (rate.end - rate.start)

    def _record(self, result: Mapping[str, Any]) -> None:
        """Writes losses and returns into the log."""
        log, runner = self._log, self.runner
        assert log is not None
        if runner.ended:
            means = np.mean(runner.ended, axis=0).tolist()
            for name, value in zip(EPISODE, means, strict=True):
                log.record(f"rollout/{name}", value)
        for name, value in result[LEARNER_RESULTS][DEFAULT_MODULE_ID].items():
            if isinstance(value, (int, float, np.number)):
                log.record(f"train/{name}", float(value))
        log.dump(runner.steps)

    def policy(self, about: Mapping[str, Any]) -> PolicyFile:
        """Returns the present deterministic policy, with a card."""
        self.shape.policy.load_state_dict(self._networks.state_dict())
        spec = self.stack.past.history.spec
        return export_policy(self.shape, self.stack.outside, spec, self.config.task, about)

    def state(self) -> dict[str, Any]:
        """Returns plain values from which a later process continues with the same bits."""
        return {
            "weights": weights_state(self._networks.state_dict()),
            "optimiser": optimiser_state(self._learner.get_optimizer()),
            "seen": self.runner.seen,
            "random": random_state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restores a state; the state of the fish is restored before.

        Raises:
            KeyError, ValueError, RuntimeError: the state is not that of such a learner.
        """
        seen, space = np.asarray(state["seen"], np.float32), self.stack.outside.observation_space
        if seen.shape != (self.config.num_envs, *(space.shape or ())):
            raise ValueError(f"observations of shape {seen.shape}")
        self._put(weights_tensors(state["weights"]))
        restore_optimiser(self._learner.get_optimizer(), state["optimiser"])
        self.runner.seen = seen
        restore_random(state["random"])

    def close(self) -> None:
        """Closes log and algorithm, and stops Ray if it was not running before."""
        self._open.close()
