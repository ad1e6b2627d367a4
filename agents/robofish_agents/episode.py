"""One episode of ``RoboticFish3D-v0`` as arrays over time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from robofish_agents.registry import Agent

Float32Array = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Episode:
    """Values after each control step.

    Attributes:
        info: key of the environment's ``info`` -> (T,), SI and radians.
        targets: (T, 5) targets of the actuators (rad, rad, Hz, m, rad).
        actuators: (T, 5) actuator positions reached.
        period_s: control period (s).
    """

    info: dict[str, FloatArray]
    targets: FloatArray
    actuators: FloatArray
    period_s: float

    def __getitem__(self, key: str) -> FloatArray:
        """A quantity of ``info`` over time, shape (T,)."""
        return self.info[key]

    @property
    def succeeded(self) -> bool:
        """Whether depth, heading and speed were within limits in the last ten seconds."""
        return bool(self["is_success"][-1] == 1.0)

    def last(self, seconds: float) -> Episode:
        """Values at the end of the episode."""
        steps = round(seconds / self.period_s)
        info = {key: values[-steps:] for key, values in self.info.items()}
        return Episode(info, self.targets[-steps:], self.actuators[-steps:], self.period_s)

    def worst(self, key: str) -> float:
        """Largest absolute value of a quantity."""
        return float(np.max(np.abs(self[key])))


def swim(
    env: gym.Env[Float32Array, Float32Array],
    agent: Agent,
    seed: int,
    options: dict[str, Any] | None = None,
    report: Callable[[], object] = lambda: None,
    finished: Callable[[], bool] = lambda: False,
) -> Episode:
    """Runs one episode to its end.

    Args:
        env: ``RoboticFish3D-v0``, with its time limit.
        agent: what acts.
        seed: seed of the episode.
        options: reset options, see the environment.
        report: called after each step.
        finished: called after each step; True ends the episode early.
    """
    fish = env.unwrapped
    assert isinstance(fish, RoboticFish3DEnv)
    config = fish.options.config
    rows: list[dict[str, float]] = []
    actions, actuators = [], []
    observation, _ = env.reset(seed=seed, options=options)
    agent.reset(1)
    over = False
    while not over:
        action = agent.act(observation[None])[0]
        observation, _, terminated, truncated, info = env.step(action)
        rows.append(info)
        actions.append(action)
        actuators.append(fish.actuators)
        report()
        over = terminated or truncated or finished()
    share = (np.array(actions, float) + 1.0) / 2.0
    return Episode(
        {key: np.array([row[key] for row in rows], float) for key in rows[0]},
        config.low + (config.high - config.low) * share,
        np.array(actuators),
        config.control_period,
    )
