"""Training with Stable-Baselines3."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from stable_baselines3 import PPO
from stable_baselines3.common import logger

from fish_env.errors import ConfigError
from robofish_agents.policies.export import export_policy
from robofish_agents.policies.files import PolicyFile
from robofish_agents.training.books import Books
from robofish_agents.training.callback import Between
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.imitation import imitate
from robofish_agents.training.learner_state import learner_state, restore_learner
from robofish_agents.training.model import make_model
from robofish_agents.training.stack import Stack

OF_NO_NUMBERS = "Expected parameter"
"""How PyTorch begins to say that a distribution is asked for with NaN."""


class Sb3Engine:
    """A learner of Stable-Baselines3, see :class:`robofish_agents.training.engines.Engine`.

    Args:
        config: of the training.
        stack: its fish.
    """

    def __init__(self, config: TrainConfig, stack: Stack) -> None:
        self.config, self.stack = config, stack
        self.model = make_model(config, stack)
        self._log: logger.Logger | None = None

    def imitate(self) -> None:
        """Fits policy and values to the configuration's teacher."""
        assert isinstance(self.model, PPO)
        imitate(self.model, self.stack, self.config, self.config.imitate)

    def learn(self, books: Books) -> None:
        """Learns from the books' steps to those of the configuration.

        Raises:
            ConfigError: the policy has diverged.
        """
        steps = books.progress.steps
        left = self.config.total_steps - steps
        try:
            self.model.learn(left, callback=Between(books), reset_num_timesteps=steps == 0)
        except ValueError as error:
            if not str(error).startswith(OF_NO_NUMBERS):
                raise
            raise ConfigError(
                "the policy has diverged, its actions are no longer numbers; lower "
                f"{self.config.algorithm}.learning_rate.start"
            ) from None

    def log_to(self, folder: Path) -> Callable[[str, float], object]:
        """Opens a TensorBoard log in a folder; returns a function that logs a name and a value."""
        self._log = logger.configure(str(folder), ["tensorboard"])
        self.model.set_logger(self._log)
        return self._log.record

    def policy(self, about: Mapping[str, Any]) -> PolicyFile:
        """Returns the present deterministic policy, with a card."""
        spec = self.stack.past.history.spec
        return export_policy(self.model, self.stack.outside, spec, self.config.task, about)

    def state(self) -> dict[str, Any]:
        """Returns plain values from which a later process continues with the same bits."""
        return learner_state(self.model)

    def restore(self, state: dict[str, Any]) -> None:
        """Restores a state; the state of the fish is restored before."""
        restore_learner(self.model, state)

    def close(self) -> None:
        """Closes the log, which has a thread."""
        if self._log is not None:
            self._log.close()
