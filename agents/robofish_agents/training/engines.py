"""The interface of a learning library, and the choice between libraries."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from fish_env.errors import missing_extra
from robofish_agents.policies.files import PolicyFile
from robofish_agents.training.books import Books
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.stack import Stack


class Engine(Protocol):
    """A learner and the fish that it learns with."""

    def imitate(self) -> None:
        """Fits policy and values to the configuration's teacher."""

    def learn(self, books: Books) -> None:
        """Learns from the books' steps to those of the configuration."""

    def log_to(self, folder: Path) -> Callable[[str, float], object]:
        """Opens a TensorBoard log in a folder; returns a function that logs a name and a value."""

    def policy(self, about: Mapping[str, Any]) -> PolicyFile:
        """Returns the present deterministic policy, with a card."""

    def state(self) -> dict[str, Any]:
        """Returns plain values from which a later process continues with the same bits."""

    def restore(self, state: dict[str, Any]) -> None:
        """Restores a state; the state of the fish is restored before."""

    def close(self) -> None:
        """Closes everything that was opened."""


def make_engine(config: TrainConfig, stack: Stack) -> Engine:
    """Makes an untrained learner.

    Args:
        config: of the training; ``engine`` says which library.
        stack: its fish.

    Raises:
        MissingExtraError: the library is not installed.
    """
    if config.engine == "rllib":
        try:
            from robofish_agents.training.rllib.engine import RllibEngine
        except ModuleNotFoundError as error:
            package = str(error.name).partition(".")[0]
            raise missing_extra("engine rllib", package, "ray") from error
        return RllibEngine(config, stack)
    if config.engine == "tensor":
        from robofish_agents.training.tensor_engine import TensorEngine

        return TensorEngine(config, stack)
    from robofish_agents.training.sb3_engine import Sb3Engine

    return Sb3Engine(config, stack)
