"""Runs all episodes of a suite in parallel and records what the metrics need."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from robofish_agents.evaluation.suites import Suite
from robofish_agents.registry import Agent

KEPT = (
    "depth_error",
    "heading_error",
    "speed_error",
    "goal_speed",
    "speed",
    "power",
    "is_success",
    "failure",
    "cross_track_error",
    "path_progress",
    "place_error",
)
"""Entries of ``info`` that the metrics use."""
EARTH_GRAVITY = 9.81


@dataclass(frozen=True)
class Record:
    """Episodes over time. After its end an episode keeps its last values and ``alive`` is False.

    Attributes:
        info: key of the environment's ``info`` -> (T, N), SI and radians.
        first: the same at the start, (N,).
        reward: (T, N).
        actions: (T, N, 5), clipped to [-1, 1] as the environment does.
        alive: (T, N), True for the steps before the end of the episode.
        period_s: control period (s).
        weight: (N,) of the fish (N).
        limits: success limits of the environment (depth in m, heading in rad, ...).
    """

    info: dict[str, FloatArray]
    first: dict[str, FloatArray]
    reward: FloatArray
    actions: FloatArray
    alive: BoolArray
    period_s: float
    weight: FloatArray
    limits: dict[str, float]

    @property
    def episodes(self) -> int:
        """Number of episodes."""
        return int(self.reward.shape[1])


def swim_suite(
    suite: Suite,
    task: str,
    agent: Agent,
    count: int | None = None,
    threads: int | None = None,
    report: Callable[[], object] = lambda: None,
) -> Record:
    """Runs the first ``count`` episodes of a suite in parallel.

    An episode does not depend on the number of parallel episodes, if the agent's lanes do not
    depend on each other.

    Args:
        suite: which episodes.
        task: one of the suite's.
        agent: what acts.
        count: how many of the episodes; default: all.
        threads: threads of the environment; default: all cores of this process.
        report: called after each step.
    """
    env = suite.make(task, count, threads)
    observations, first = env.reset(seed=suite.seed)
    agent.reset(env.num_envs)
    steps, fish = suite.episode_steps, env.num_envs
    info = {key: np.zeros((steps, fish)) for key in KEPT}
    reward, actions = np.zeros((steps, fish)), np.zeros((steps, fish, 5))
    alive = np.zeros((steps, fish), bool)
    swimming = np.ones(fish, bool)
    for step in range(steps):
        action = agent.act(observations)
        observations, rewards, terminated, truncated, now = env.step(action)
        alive[step] = swimming
        reward[step] = np.where(swimming, rewards, 0.0)
        actions[step] = np.clip(action, -1.0, 1.0)
        for key, values in info.items():
            values[step] = np.where(swimming, now[key], values[step - 1])
        # An ended fish begins anew; what it does then belongs to no episode of the suite.
        swimming &= ~(terminated | truncated)
        report()
    options = env.options
    mass = options.model.fish.get("mass.total")
    return Record(
        info,
        {key: first[key].copy() for key in KEPT},
        reward,
        actions,
        alive,
        options.config.control_period,
        np.full(fish, EARTH_GRAVITY * mass),
        dict(options.config.tree["success"]),
    )
