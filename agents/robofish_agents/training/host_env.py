"""A vector environment on the CPU that gives and takes tensors."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from fish_env.envs.vector import RoboticFish3DVectorEnv


class HostEnv:
    """A vector environment on the CPU, with tensors in place of arrays.

    Args:
        envs: a ``RoboticFish3DVectorEnv`` with ``autoreset_mode="SameStep"``.
    """

    def __init__(self, envs: Any) -> None:
        self._envs, self.batch = envs, envs.batch
        self.single_action_space = envs.single_action_space
        self.num_envs, self.max_episode_steps = envs.num_envs, envs.max_episode_steps
        self.set_elapsed = envs.set_elapsed
        self._observed = torch.zeros(self.num_envs, envs.single_observation_space.shape[0])
        self._final = torch.zeros_like(self._observed)
        self._succeeded = torch.zeros(self.num_envs)

    @classmethod
    def of_fish(cls, count: int, **options: Any) -> HostEnv:
        """So many fish.

        Args:
            count: number of fish.
            **options: as for ``RoboticFish3DVectorEnv``.
        """
        return cls(RoboticFish3DVectorEnv(count, autoreset_mode="SameStep", **options))

    def reset(self, *, seed: int | None = None) -> tuple[Tensor, dict[str, Any]]:
        """As of a vector environment."""
        observed, infos = self._envs.reset(seed=seed)
        self._observed.copy_(torch.from_numpy(observed))
        return self._observed, infos

    def step(self, actions: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, dict[str, Any]]:
        """As of a vector environment; ``final_obs`` and ``final_info`` hold for ended episodes."""
        observed, reward, terminated, truncated, infos = self._envs.step(actions.numpy())
        self._observed.copy_(torch.from_numpy(observed))
        for lane in (terminated | truncated).nonzero()[0]:
            self._final[lane] = torch.from_numpy(infos["final_obs"][lane])
            self._succeeded[lane] = infos["final_info"]["is_success"][lane]
        left = {"final_obs": self._final, "final_info": {"is_success": self._succeeded}}
        return (
            self._observed,
            torch.from_numpy(reward).float(),
            torch.from_numpy(terminated),
            torch.from_numpy(truncated),
            left,
        )
