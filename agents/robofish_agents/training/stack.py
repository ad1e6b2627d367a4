"""The fish of a training with all wrappers, and their state."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from fish_env.envs.sb3 import FishVecEnv
from robofish_agents.training.config import MOST_FISH, TrainConfig
from robofish_agents.training.forms import check_form
from robofish_agents.training.history_env import HistoryVecEnv

FIRST_SEED = 10_000_000
"""Episodes of trainings are seeded from here on, away from suites and evaluations."""


class Shoal(VecEnv):
    """Fish under several conditions as one batch, with the processor time of their steps.

    Args:
        parts: batches side by side, with the same spaces.
    """

    def __init__(self, parts: Sequence[FishVecEnv]) -> None:
        self.parts = tuple(parts)
        self.cpu_s = 0.0
        self._ends = np.cumsum([part.num_envs for part in parts])
        first = self.parts[0]
        self.render_mode = first.render_mode
        super().__init__(int(self._ends[-1]), first.observation_space, first.action_space)

    def reset(self) -> np.ndarray:
        """Begins all episodes."""
        observations = np.concatenate([part.reset() for part in self.parts])
        self.reset_infos = [info for part in self.parts for info in part.reset_infos]
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Hands each part its actions."""
        for part, rows in zip(self.parts, np.split(actions, self._ends[:-1]), strict=True):
            part.step_async(rows)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """One control step, timed."""
        started = time.process_time()
        rows = [part.step_wait() for part in self.parts]
        observations, rewards, dones = (np.concatenate([row[i] for row in rows]) for i in range(3))
        infos = [info for row in rows for info in row[3]]
        self.cpu_s += time.process_time() - started
        return observations, rewards, dones, infos

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seeds the next reset: fish i gets seed + i."""
        if seed is None:
            return [None] * self.num_envs
        for part, end in zip(self.parts, self._ends.tolist(), strict=True):
            part.seed(seed + end - part.num_envs)
        return list(range(seed, seed + self.num_envs))

    def close(self) -> None:
        """Does nothing: there is nothing to release."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the first part, once for each fish asked for."""
        return [getattr(self.parts[0], attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Sets an attribute of all parts."""
        for part in self.parts:
            part.set_attr(attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Calls a method of each part; returns its result once for each fish."""
        return [
            result
            for part in self.parts
            for result in part.env_method(method_name, *method_args, **method_kwargs)
        ]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """No fish is wrapped by a Gymnasium wrapper."""
        return [False for _ in self._get_indices(indices)]


@dataclass(frozen=True, eq=False)
class Stack:
    """The environment of a training with its wrappers; ``outside`` is the outermost."""

    fish: Shoal
    monitor: VecMonitor
    past: HistoryVecEnv
    outside: VecNormalize

    def state(self) -> dict[str, Any]:
        """Returns plain values from which a later process continues with the same bits."""
        outside = self.outside
        return {
            "envs": [part.env.save_state() for part in self.fish.parts],
            "cpu_s": self.fish.cpu_s,
            "monitor": [self.monitor.episode_returns, self.monitor.episode_lengths],
            "past": self.past.history.save_state(),
            "means": [[m.mean, m.var, m.count] for m in self._means()],
            "returns": outside.returns,
            "latest": [outside.old_obs, outside.old_reward],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restores a state.

        Raises:
            KeyError, ValueError: the state is not that of such fish.
        """
        self.outside.reset()  # so that everything has the form that it has in a training
        check_form(state, self._like(state), "stack")
        self.fish.cpu_s = state["cpu_s"]
        for part, env in zip(self.fish.parts, state["envs"], strict=True):
            part.env.load_state(env)
        self.monitor.episode_returns, self.monitor.episode_lengths = state["monitor"]
        self.past.history.load_state(state["past"])
        outside = self.outside
        for running, saved in zip(self._means(), state["means"], strict=True):
            running.mean, running.var, running.count = saved
        outside.returns = state["returns"]
        outside.old_obs, outside.old_reward = state["latest"]

    def _like(self, state: dict[str, Any]) -> dict[str, Any]:
        """The present state, with rewards of a last step if another state has some."""
        own, (_, rewards) = self.state(), state["latest"]
        if np.size(rewards):
            own["latest"][1] = np.zeros(self.fish.num_envs, np.float32)
        return own

    def _means(self) -> list[RunningMeanStd]:
        """Returns the running means of observations and returns."""
        seen = self.outside.obs_rms
        assert isinstance(seen, RunningMeanStd)
        return [seen, self.outside.ret_rms]


def make_stack(config: TrainConfig) -> Stack:
    """Makes the fish of a configuration, seeded, with monitor, history and normalisation."""
    names = config.disturbances
    count, threads = config.num_envs // len(names), config.threads.environment
    options = [config.options(name, training=True) for name in names]
    fish = Shoal([FishVecEnv(count, threads=threads, **given) for given in options])
    monitor = VecMonitor(fish)
    spec = config.history_spec(fish.parts[0].env.options.config.control_period)
    past = HistoryVecEnv(monitor, spec)
    gamma = config.ppo.gamma if config.algorithm == "ppo" else config.sac.gamma
    outside = VecNormalize(past, norm_reward=config.normalise_reward, gamma=gamma)
    return Stack(fish, monitor, past, outside)


def seed_episodes(stack: Stack, config: TrainConfig) -> None:
    """Seeds the fish; no two seeds of a training share an episode."""
    stack.fish.seed(FIRST_SEED + MOST_FISH * config.seed)
