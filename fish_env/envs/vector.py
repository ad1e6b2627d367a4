"""Many fish at once: the native ``VectorEnv`` on the same compiled step."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.envs.batch import FishBatch, generator, real_actions
from fish_env.envs.config_checks import check_count, elapsed_steps
from fish_env.envs.layout import OUTPUTS
from fish_env.envs.options import env_options
from fish_env.envs.robotic_fish_3d import (
    ACTION_SHAPE,
    FAILURE,
    PARAMETER,
    action_space,
    observation_space,
)
from fish_env.envs.start import reset_mapping
from fish_env.envs.viewing import Frame, Viewer, Watched
from fish_env.errors import ConfigError
from fish_env.reading import shown
from fish_env.rendering import Scene

Float32Array = npt.NDArray[np.float32]


MOST_FISH = 200_000
"""A batch of so many takes some gigabytes."""
MOST_THREADS = 4096


def _autoreset(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        known = ", ".join(f"'{known.value}'" for known in AutoresetMode)
        raise ConfigError(f"autoreset_mode {shown(mode)}: one of {known}") from None


class RoboticFish3DVectorEnv(Watched, VectorEnv[Float32Array, Float32Array, npt.NDArray[Any]]):
    """N independent :class:`RoboticFish3DEnv`, advanced together on all cores.

    Fish i behaves to the last bit like a single environment that was reset with seed + i, whatever
    the number of threads. Make it with ``gymnasium.make_vec("RoboticFish3D-v0", num_envs=N)``.

    Args:
        num_envs: number of fish.
        max_episode_steps: control steps until truncation. A fish that fails at its last step is
            terminated, not truncated.
        autoreset_mode: NEXT_STEP (default): the step after an end returns the reset observation
            and zero reward. SAME_STEP: the step that ends an episode returns the first
            observation of the next. ``info["final_obs"]`` has the last observation, and
            ``info["final_info"]`` its info. DISABLED: the caller resets with
            ``options={"reset_mask": mask}``.
        threads: threads for a step; default: all cores of this process.
        render_mode: None, ``"rgb_array"`` (a picture of every fish, as Gymnasium's wrappers for
            videos expect), ``"mosaic"`` (one picture of the first fish side by side) or
            ``"human"`` (a window with that mosaic).
        render_count: how many fish a mosaic and a window show.
        render_size: width and height (pixels) of the picture of one fish, or of the mosaic.
        **kwargs: as for :class:`RoboticFish3DEnv`.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": ["human", "rgb_array", "mosaic"],
        "render_fps": 10,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int = 400,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        render_mode: str | None = None,
        render_count: int = 9,
        render_size: tuple[int, int] = (640, 480),
        **kwargs: Any,
    ) -> None:
        check_count("num_envs", num_envs, MOST_FISH)
        check_count("max_episode_steps", max_episode_steps, sys.maxsize)
        check_count("render_count", render_count, MOST_FISH)
        if threads is not None:
            check_count("threads", threads, MOST_THREADS)
        self.num_envs = num_envs
        self.max_episode_steps = max_episode_steps
        self.autoreset_mode = _autoreset(autoreset_mode)
        self.render_mode = render_mode
        self.options = env_options(**kwargs)
        self.metadata = {
            **self.metadata,
            "render_fps": 1.0 / self.options.config.control_period,
            "autoreset_mode": self.autoreset_mode,
        }
        self.single_action_space = action_space()
        self.single_observation_space = observation_space()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.batch = FishBatch(self.options, num_envs, threads)
        shown = num_envs if render_mode == "rgb_array" else min(render_count, num_envs)
        modes = self.metadata["render_modes"]
        self._viewer = Viewer(self.options, render_mode, modes, render_size, shown)
        self._rngs: list[np.random.Generator] = []
        self._steps = np.zeros(num_envs, np.int64)
        self._ended = np.zeros(num_envs, bool)
        self._all = np.arange(num_envs)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Float32Array, dict[str, Any]]:
        """Start episodes for all fish, or for those in ``options["reset_mask"]``.

        Args:
            seed: fish i is seeded with seed + i, or with the i-th of a sequence (None: goes on).
            options: as for the single environment, for all fish alike, and ``reset_mask``:
                (num_envs,) bool.
        """
        given = dict(reset_mapping(options))
        mask = given.pop("reset_mask", None)
        lanes = self._all if mask is None else self._masked(mask)
        self._seed(seed, lanes)
        self._restart(lanes, given)
        self._viewer.after_step(self.batch)
        fresh = np.isin(self._all, lanes)
        return self.batch.obs.copy(), self._infos(fresh) | self._drawn(fresh)

    def step(
        self, actions: npt.ArrayLike
    ) -> tuple[Float32Array, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """One control step of every fish.

        Raises:
            ConfigError: actions of another shape or with a NaN, a step before the first reset, or
                a fish that has ended and was not reset (autoreset DISABLED).
        """
        shape = (self.num_envs, *ACTION_SHAPE)
        given = real_actions(actions, shape)
        self._check_step()
        batch, mode = self.batch, self.autoreset_mode
        batch.step(given)
        self._steps += 1
        reward = batch.reward.copy()
        terminated = batch.outputs[FAILURE] > 0
        truncated = (self._steps >= self.max_episode_steps) & ~terminated
        fresh = self._ended
        if mode is AutoresetMode.NEXT_STEP and fresh.any():
            self._restart(np.flatnonzero(fresh), {})
            reward[fresh] = 0.0
            terminated[fresh] = truncated[fresh] = False
        self._ended = terminated | truncated
        final: dict[str, Any] = {}
        if mode is AutoresetMode.SAME_STEP and self._ended.any():
            fresh = self._ended.copy()
            final = self._finish(fresh)
        self._viewer.after_step(batch)
        infos = self._infos(np.ones(self.num_envs, bool)) | self._drawn(fresh) | final
        return batch.obs.copy(), reward, terminated, truncated, infos

    def set_elapsed(self, steps: npt.ArrayLike) -> None:
        """Count control steps as taken already, so that present episodes are truncated earlier.

        Fish that begin together then begin their later episodes at different times.

        Args:
            steps: (num_envs,) control steps, from 0 to max_episode_steps - 1.

        Raises:
            ConfigError: other numbers.
        """
        self._steps[:] = elapsed_steps(steps, self.num_envs, self.max_episode_steps)

    def save_state(self) -> dict[str, Any]:
        """All that steps change, as arrays and plain values; :meth:`load_state` takes it."""
        return {
            "batch": self.batch.save_state(),
            "random": [rng.bit_generator.state for rng in self._rngs],
            "steps": self._steps,
            "ended": self._ended,
        }

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from a state of an environment made alike, to the same bits.

        Raises:
            KeyError, ValueError: the state is not that of such an environment.
        """
        self.batch.load_state(state["batch"])
        self._rngs = [generator(saved) for saved in state["random"]]
        self._steps[:] = state["steps"]
        self._ended = np.array(state["ended"], bool)

    def render(self) -> tuple[Frame, ...] | Frame | None:  # type: ignore[override]
        """Pictures (height, width, 3), uint8.

        Mode "rgb_array" gives one of each fish, "mosaic" one of the first fish side by side; the
        window of mode "human" shows every step by itself.

        Raises:
            ConfigError: before the first reset.
        """
        if self.render_mode == "rgb_array":
            return tuple(self._viewer.frames(self.batch))
        if self.render_mode == "mosaic":
            return self._viewer.mosaic(self.batch)
        return None

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window, if there is one."""
        self._viewer.close()

    def scene(self, fish: int = 0) -> Scene:
        """One fish as it is now, to be drawn by :mod:`fish_env.rendering` at any time."""
        return self._viewer.scene(self.batch, fish)

    def _check_step(self) -> None:
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            raise ConfigError(
                f"fish {np.flatnonzero(self._ended).tolist()} have ended: reset them with "
                "options={'reset_mask': terminated | truncated}"
            )

    def _finish(self, mask: BoolArray) -> dict[str, Any]:
        """Keep the last observation and info of ended episodes, then start new ones."""
        final_obs = np.full(self.num_envs, None, dtype=object)
        for lane in np.flatnonzero(mask):
            final_obs[lane] = self.batch.obs[lane].copy()
        final_info = self._infos(mask)
        self._restart(np.flatnonzero(mask), {})
        return {
            "final_obs": final_obs,
            "_final_obs": mask.copy(),
            "final_info": final_info,
            "_final_info": mask.copy(),
        }

    def _restart(self, lanes: IntArray, given: dict[str, Any]) -> None:
        self.batch.reset(lanes, [self._rngs[lane] for lane in lanes], given)
        self._steps[lanes] = 0
        self._ended = self._ended & ~np.isin(self._all, lanes)

    def _seed(self, seed: int | Sequence[int | None] | None, lanes: IntArray) -> None:
        if not self._rngs:
            first = seed if isinstance(seed, int) else None
            self._np_random, self._np_random_seed = seeding.np_random(first)
            self._rngs = [seeding.np_random(None)[0] for _ in self._all]
        if seed is None:
            return
        if isinstance(seed, (int, np.integer)):
            self._np_random, self._np_random_seed = seeding.np_random(seed)
            seed = [seed + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ConfigError(f"give one seed or {self.num_envs} of them, not {len(seed)}")
        for lane in lanes:
            if seed[lane] is not None:
                self._rngs[lane] = seeding.np_random(seed[lane])[0]

    def _masked(self, mask: Any) -> IntArray:
        chosen = np.asarray(mask)
        if chosen.dtype != bool or chosen.shape != (self.num_envs,) or not chosen.any():
            raise ConfigError(
                f"reset_mask must be a boolean array of shape ({self.num_envs},), not all False"
            )
        if not self._rngs and not chosen.all():
            raise ConfigError("the first reset must be of all fish")
        return np.flatnonzero(chosen)

    def _infos(self, mask: BoolArray) -> dict[str, Any]:
        return _masked_infos(OUTPUTS, self.batch.outputs, mask)

    def _drawn(self, fresh: BoolArray) -> dict[str, Any]:
        """Randomised parameters of the fish that have just been reset."""
        drawn = self.batch.drawn
        if not drawn or not fresh.any():
            return {}
        names = [PARAMETER + path for path in drawn]
        return _masked_infos(names, np.stack(list(drawn.values())), fresh)


def _masked_infos(names: Sequence[str], values: FloatArray, mask: BoolArray) -> dict[str, Any]:
    """Gymnasium's form: an array for each name, and beside it where it holds."""
    infos: dict[str, Any] = {}
    rows = np.where(mask, values, 0.0)
    masks = np.repeat(mask[None, :], len(rows), axis=0)
    for name, row, where in zip(names, rows, masks, strict=True):
        infos[name] = row
        infos[f"_{name}"] = where
    return infos
