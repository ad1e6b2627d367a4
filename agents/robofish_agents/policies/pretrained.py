"""Trained policies as agents, without PyTorch; also those that come with the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from fish_env.envs.layout import OBSERVATION
from fish_env.errors import ConfigError
from robofish_agents.policies.files import PolicyFile, read_policy
from robofish_agents.policies.history import History

Float32Array = npt.NDArray[np.float32]
SHIPPED = Path(__file__).resolve().parents[1] / "pretrained"
STANDS_FOR = {"path": "track"}
"""Task -> the task whose policies are run on it unchanged: the observations are the same."""


class PretrainedPolicy:
    """Controls N fish with a trained network; deterministic.

    Args:
        policy: a policy file that was read.
    """

    def __init__(self, policy: PolicyFile) -> None:
        self.policy = policy
        self._history: History | None = None

    @classmethod
    def load(cls, path: str | Path) -> PretrainedPolicy:
        """Reads a policy file; loading cannot run code.

        Raises:
            ConfigError: missing, damaged, foreign, or of another environment version.
        """
        return cls(read_policy(path))

    def reset(self, count: int) -> None:
        """Resets past observations at the start of ``count`` episodes."""
        self._history = History(self.policy.history, count, len(OBSERVATION))

    def act(self, observations: npt.ArrayLike) -> Float32Array:
        """Actions (N, 5) in [-1, 1] for observations (N, 33) as the environment gives them.

        Raises:
            ConfigError: before the first :meth:`reset`, or another number of fish.
        """
        if self._history is None:
            raise ConfigError("call reset(count) before act()")
        seen = np.asarray(observations, np.float32)
        return self.policy.network(self._history.push(seen))


def shipped(task: str) -> list[Path]:
    """Files of the policies that come with the package for a task, one for each training seed.

    On paths the policies of ``track`` swim.

    Raises:
        ConfigError: there are none.
    """
    files = sorted((SHIPPED / STANDS_FOR.get(task, task)).glob("*.npz"))
    if not files:
        tasks = sorted({file.parent.name for file in SHIPPED.glob("*/*.npz")})
        raise ConfigError(f"no policy is shipped for task '{task}'; there are: {', '.join(tasks)}")
    return files
