"""The environment on the device: a Gymnasium ``VectorEnv`` whose arrays are PyTorch tensors."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from fish_env.envs.config_checks import check_count
from fish_env.envs.layout import OUTPUTS
from fish_env.envs.options import env_options
from fish_env.envs.robotic_fish_3d import PARAMETER, action_space, observation_space
from fish_env.errors import ConfigError
from fish_env.gpu.arrays import current_stream, tensor
from fish_env.gpu.batch import DeviceBatch

MOST_FISH = 2**24
MODES = {
    AutoresetMode.DISABLED: "disabled",
    AutoresetMode.NEXT_STEP: "next_step",
    AutoresetMode.SAME_STEP: "same_step",
}


class RoboticFish3DDeviceEnv(VectorEnv[Any, Any, Any]):
    """N independent fish on a GPU: physics, observation, reward, reset and draws run there.

    What ``reset`` and ``step`` return are PyTorch tensors of the device's own memory, which the
    next step overwrites: clone what has to last. Nothing is copied to the host, and no call waits
    for the device. The physics, spaces, rewards and distributions are those of
    ``RoboticFish3D-v0``; the random numbers are others.

    Args:
        num_envs: number of fish.
        max_episode_steps: control steps until truncation.
        autoreset_mode: SAME_STEP (default): the step that ends an episode returns the first
            observation of the next, with the last one in ``info["final_obs"]``; NEXT_STEP: the
            step after an end returns the reset observation and zero reward; DISABLED: the caller
            resets with ``options={"reset_mask": mask}``.
        precision: ``"float32"`` or ``"float64"``, of all numbers but observations and rewards,
            which are float32.
        **kwargs: as for :class:`fish_env.envs.robotic_fish_3d.RoboticFish3DEnv`.

    Raises:
        ConfigError: no GPU, or an option that cannot be.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int = 400,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        precision: str = "float32",
        **kwargs: Any,
    ) -> None:
        check_count("num_envs", num_envs, MOST_FISH)
        check_count("max_episode_steps", max_episode_steps, 2**31)
        mode = AutoresetMode(autoreset_mode)
        options = env_options(**kwargs)
        self.num_envs, self.max_episode_steps = num_envs, max_episode_steps
        self.metadata = {**self.metadata, "autoreset_mode": mode}
        self.single_action_space = action_space()
        self.single_observation_space = observation_space()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.batch = batch = DeviceBatch(
            options,
            num_envs,
            precision=precision,
            autoreset=MODES[mode],
            max_episode_steps=max_episode_steps,
        )
        self._actions = tensor(batch.actions)
        self._obs, self._reward = tensor(batch.obs), tensor(batch.reward)
        self._terminated, self._truncated = tensor(batch.terminated), tensor(batch.truncated)
        outputs, final = tensor(batch.outputs), tensor(batch.final_outputs)
        self._infos: dict[str, Any] = {name: outputs[row] for row, name in enumerate(OUTPUTS)}
        self._infos |= {PARAMETER + path: tensor(values) for path, values in batch.drawn.items()}
        self._final = {
            "final_obs": tensor(batch.final_obs),
            "final_info": {name: final[row] for row, name in enumerate(OUTPUTS)},
        }

    def set_elapsed(self, steps: npt.ArrayLike) -> None:
        """As of ``RoboticFish3DVectorEnv``; waits for the device."""
        self.batch.set_elapsed(steps)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start episodes for all fish, or for those in ``options["reset_mask"]``, (N,) bool.

        Unlike a step, this waits for the device.

        Raises:
            ConfigError: another option, or a seed for some of the fish alone.
        """
        given = dict(options or {})
        mask = given.pop("reset_mask", None)
        if given:
            raise ConfigError(
                f"reset options {sorted(given)} are unknown on a device: reset a batch on the CPU "
                "with them, and give it to batch.load"
            )
        host = None if mask is None else np.asarray(getattr(mask, "cpu", lambda: mask)())
        self.batch.check_actions()
        self.batch.reset(seed, host, stream=current_stream())
        return self._obs, dict(self._infos)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """One control step of every fish.

        Args:
            actions: (N, 5) tensor; values beyond -1 to 1 are clipped, NaN counts as 0 and is
                reported by the next reset.

        Returns:
            Observations (N, 33), rewards (N,), terminated (N,), truncated (N,), and infos: a
            tensor (N,) for each key. ``final_obs`` and ``final_info`` hold what ended episodes
            left; they are of this step where ``terminated | truncated``.
        """
        self._actions.copy_(actions)
        self.batch.step(current_stream())
        return (
            self._obs,
            self._reward,
            self._terminated,
            self._truncated,
            self._infos | self._final,
        )
