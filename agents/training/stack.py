"""The fish that a training swims, with the wrappers around them, and their state as a whole."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from agents.training.config import MOST_FISH, TrainConfig
from agents.training.history_env import HistoryVecEnv
from fish_env.envs.sb3 import FishVecEnv

FIRST_SEED = 10_000_000
"""Episodes of trainings are seeded from here on, away from suites and evaluations."""


class TimedFish(FishVecEnv):
    """The adapter, with the processor time that its steps take (s)."""

    cpu_s = 0.0

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """One control step, timed."""
        started = time.process_time()
        result = super().step_wait()
        self.cpu_s += time.process_time() - started
        return result


@dataclass(frozen=True, eq=False)
class Stack:
    """The environment of a training from the inside out; ``outside`` is what the learner sees."""

    fish: TimedFish
    monitor: VecMonitor
    past: HistoryVecEnv
    outside: VecNormalize

    def state(self) -> dict[str, Any]:
        """All that a later process needs to go on with the same bits."""
        normalise = self.outside
        return {
            "env": self.fish.env,
            "cpu_s": self.fish.cpu_s,
            "monitor": (self.monitor.episode_returns, self.monitor.episode_lengths),
            "past": self.past.history,
            "normalise": (normalise.obs_rms, normalise.ret_rms, normalise.returns),
            "latest": (normalise.old_obs, normalise.old_reward),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Puts a state back."""
        self.fish.env, self.fish.cpu_s = state["env"], state["cpu_s"]
        self.monitor.episode_returns, self.monitor.episode_lengths = state["monitor"]
        self.past.history = state["past"]
        outside = self.outside
        outside.obs_rms, outside.ret_rms, outside.returns = state["normalise"]
        outside.old_obs, outside.old_reward = state["latest"]


def make_stack(config: TrainConfig) -> Stack:
    """The fish of a configuration, seeded, with monitor, history and normalisation."""
    fish = TimedFish(
        config.num_envs, threads=config.threads.environment, **config.options(training=True)
    )
    monitor = VecMonitor(fish)
    spec = config.history_spec(fish.env.options.config.control_period)
    past = HistoryVecEnv(monitor, spec)
    gamma = config.ppo.gamma if config.algorithm == "ppo" else config.sac.gamma
    outside = VecNormalize(past, norm_reward=config.normalise_reward, gamma=gamma)
    return Stack(fish, monitor, past, outside)


def seed_episodes(stack: Stack, config: TrainConfig) -> None:
    """Seeds the fish; no two seeds of a training share an episode."""
    stack.fish.seed(FIRST_SEED + MOST_FISH * config.seed)
