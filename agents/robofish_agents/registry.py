"""Names of agents: `pid`, `mppi`, `pretrained`, or the path of a policy."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from fish_env.errors import ConfigError
from fish_env.reading import Unreadable, located

Float32Array = npt.NDArray[np.float32]


class Agent(Protocol):
    """Controls a batch of fish: action i depends on observation i alone."""

    def reset(self, count: int) -> None:
        """Begins the episodes of ``count`` fish."""

    def act(self, observations: Float32Array) -> Float32Array:
        """Returns actions (N, 5) in [-1, 1] for observations (N, 33) of the environment."""


def load_agents(name: str, task: str) -> list[Agent]:
    """Loads the agents of a name: one, or one for each training seed of a learned policy.

    Args:
        name: ``pid``, ``mppi``, ``pretrained``, or the path of a policy or of a folder of them.
        task: for which a pretrained policy is chosen.

    Raises:
        ConfigError: no such agent; names those there are.
    """
    if name == "pid":
        from robofish_agents.controllers.pid import PIDController

        return [PIDController()]
    if name == "mppi":
        from robofish_agents.controllers.mppi import MPPIController

        return [MPPIController()]
    return _policies(name, task)


def agent_files(name: str) -> list[Path]:
    """The files that an agent of this name is read from; none for those without a file."""
    return _files(Path(name))


def _policies(name: str, task: str) -> list[Agent]:
    from robofish_agents import policies

    paths = policies.shipped(task) if name == "pretrained" else _files(_located(name))
    if not paths:
        raise ConfigError(
            f"agent '{name}': give pid, mppi, pretrained, a policy file, or a folder with policy "
            "files; `robofish train` writes one"
        )
    return [policies.PretrainedPolicy.load(path) for path in paths]


def _located(name: str) -> Path:
    try:
        return located(name)
    except Unreadable as error:
        raise ConfigError(f"agent {error}") from None


def _files(path: Path) -> list[Path]:
    if path.is_dir():
        return sorted([*path.glob("*.npz"), *path.glob("*.safetensors")])
    return [path] if path.is_file() else []
