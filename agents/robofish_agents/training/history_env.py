"""A vector environment for Stable-Baselines3 that adds past observations."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Box
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from fish_env.envs.layout import OBSERVATION_LIMIT
from robofish_agents.policies.history import History, HistorySpec


class HistoryVecEnv(VecEnvWrapper):
    """Replaces observations by what :class:`robofish_agents.policies.History` makes of them.

    Args:
        venv: fish.
        spec: past observations that the policy sees.
    """

    def __init__(self, venv: VecEnv, spec: HistorySpec) -> None:
        assert venv.observation_space.shape is not None
        (self._size,) = venv.observation_space.shape
        self._spec = spec
        shape = (spec.width(self._size),)
        space = Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, shape, np.float32)
        super().__init__(venv, observation_space=space)
        self.history = History(spec, venv.num_envs, self._size)

    def reset(self) -> np.ndarray:
        """Begins all episodes."""
        self.history = History(self._spec, self.num_envs, self._size)
        return self.history.push(np.asarray(self.venv.reset()))

    def step_wait(self) -> VecEnvStepReturn:
        """Takes one control step; the last observation of an ended episode gets its own past."""
        observations, rewards, dones, infos = self.venv.step_wait()
        for lane in np.flatnonzero(dones).tolist():
            info: dict[str, Any] = infos[lane]
            last = info["terminal_observation"]
            info["terminal_observation"] = self.history.last(lane, last)
        self.history.restart(dones)
        return self.history.push(np.asarray(observations)), rewards, dones, infos
