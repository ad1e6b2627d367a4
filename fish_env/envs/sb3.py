"""The vector environment as a Stable-Baselines3 ``VecEnv``: a whole batch in one process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fish_env.envs.layout import OUTPUTS
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError, missing_extra

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    raise missing_extra("Training", "stable-baselines3", "train") from error


class FishVecEnv(VecEnv):
    """``FishVecEnv(num_envs=64, task="hold")``; wrap it in SB3's ``VecMonitor`` for statistics.

    Args:
        num_envs: number of fish.
        info_keys: entries of ``info`` that every step reports for every fish. Empty by default:
            a dictionary per fish and step costs more than the physics. Ended episodes always
            report everything.
        **kwargs: as for :class:`RoboticFish3DVectorEnv`.
    """

    def __init__(self, num_envs: int, info_keys: Sequence[str] = (), **kwargs: Any) -> None:
        unknown = set(info_keys) - set(OUTPUTS)
        if unknown:
            raise ConfigError(f"unknown info_keys {sorted(unknown)}; choose from {OUTPUTS}")
        self.env = RoboticFish3DVectorEnv(num_envs, autoreset_mode="SameStep", **kwargs)
        self.info_keys = tuple(info_keys)
        self.render_mode = self.env.render_mode
        super().__init__(num_envs, self.env.single_observation_space, self.env.single_action_space)
        self._actions: Any = None
        self._seed: int | None = None

    def reset(self) -> np.ndarray:
        """Start episodes for all fish; a seed or options given before are used once.

        Raises:
            ConfigError: options that differ between fish.
        """
        options = self._options[0]
        if any(other != options for other in self._options):
            raise ConfigError("set_options: all fish take the same options")
        obs, infos = self.env.reset(seed=self._seed, options=options)
        self._seed = None
        self._reset_options()
        self.reset_infos = [self._info(infos, lane, OUTPUTS) for lane in range(self.num_envs)]
        return obs

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """One control step; ended fish return the first observation of their next episode."""
        obs, reward, terminated, truncated, vector_infos = self.env.step(self._actions)
        done = terminated | truncated
        keys = self.info_keys
        infos = [self._info(vector_infos, lane, keys) for lane in range(self.num_envs)]
        for lane in np.flatnonzero(done).tolist():
            final = self._info(vector_infos["final_info"], lane, OUTPUTS)
            final["is_success"] = bool(final["is_success"])
            final["terminal_observation"] = vector_infos["final_obs"][lane]
            final["TimeLimit.truncated"] = bool(truncated[lane])
            infos[lane] = final
        return obs, reward.astype(np.float32), done, infos

    @staticmethod
    def _info(infos: dict[str, Any], lane: int, keys: Sequence[str]) -> dict[str, Any]:
        return {key: float(infos[key][lane]) for key in keys}

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the next reset: fish i gets seed + i."""
        self._seed = None if seed is None else int(seed)
        return [None if seed is None else seed + i for i in range(self.num_envs)]

    def close(self) -> None:
        """Close the window, if there is one."""
        self.env.close()

    def get_images(self) -> Sequence[np.ndarray | None]:
        """A picture of every fish, which SB3 puts together; needs ``render_mode="rgb_array"``."""
        return list(self.env.render() or ())

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the vector environment, once for each fish asked for."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of the vector environment, which all fish share."""
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of the vector environment once; all fish share it."""
        result = getattr(self.env, method_name)(*method_args, **method_kwargs)
        return [result for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """No fish is wrapped by a Gymnasium wrapper."""
        return [False for _ in self._get_indices(indices)]
