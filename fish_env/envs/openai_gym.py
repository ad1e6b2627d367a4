"""``RoboticFish3D-v0`` for OpenAI gym before 0.26, which SAC of CleanRL 1.2.0 uses.

Observations, actions and rewards are those of the environment for Gymnasium. Only the calls differ:
`reset` returns the observation alone, and `step` has one flag for both kinds of end. gym has been
unmaintained since 2022, so use Gymnasium where you can.
"""

from __future__ import annotations

from typing import Any

import gym
import numpy as np
import numpy.typing as npt

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv

Observation = npt.NDArray[np.float32]


class OpenAIGymRoboticFish3DEnv(gym.Env):  # type: ignore[misc]  # gym has no types
    """The environment with the calls of gym before 0.26.

    Args:
        **kwargs: as for :class:`RoboticFish3DEnv`.
    """

    def __init__(self, **kwargs: Any) -> None:
        self.env = RoboticFish3DEnv(**kwargs)
        self.metadata = self.env.metadata
        self.action_space = _box(self.env.action_space)
        self.observation_space = _box(self.env.observation_space)
        self._seed: int | None = None

    def seed(self, seed: int | None = None) -> list[int | None]:
        """Set the seed that the next `reset` uses once."""
        self._seed = seed
        return [seed]

    def reset(
        self,
        *,
        seed: int | None = None,
        return_info: bool = False,
        options: dict[str, Any] | None = None,
    ) -> Observation | tuple[Observation, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: replaces one given to `seed`.
            return_info: whether to return the info too.
            options: as for :class:`RoboticFish3DEnv`.
        """
        chosen = self._seed if seed is None else seed
        self._seed = None
        observation, info = self.env.reset(seed=chosen, options=options)
        return (observation, info) if return_info else observation

    def step(self, action: npt.ArrayLike) -> tuple[Observation, float, bool, dict[str, Any]]:
        """Advance by one control step: observation, reward, whether the episode ended, info."""
        observation, reward, terminated, truncated, info = self.env.step(np.asarray(action))
        return observation, float(reward), terminated or truncated, info

    def render(self, mode: str = "human") -> Any:
        """Return a picture if ``render_mode="rgb_array"`` was given; `mode` is not used."""
        return self.env.render()

    def close(self) -> None:
        """Close the window, if there is one."""
        self.env.close()


def _box(space: Any) -> Any:
    return gym.spaces.Box(space.low, space.high, space.shape, space.dtype.type)
