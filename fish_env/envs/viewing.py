"""Shows the fish of a batch: reads them, never changes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.envs.batch import FishBatch
from fish_env.envs.layout import OUTPUTS
from fish_env.envs.options import EnvOptions
from fish_env.envs.outline import outline
from fish_env.errors import ConfigError
from fish_env.model.emit import OUTPUTS as TERM_OUTPUTS
from fish_env.model.state import BASE_STATES
from fish_env.reading import shown
from fish_env.rendering import (
    Goal,
    Scene,
    Setting,
    Tank,
    check_installed,
    mosaic,
    view,
    window,
)
from fish_env.rendering.shape import FishShape

if TYPE_CHECKING:
    from fish_env.rendering.mosaics import Mosaic
    from fish_env.rendering.views import View
    from fish_env.rendering.windows import Window

Frame = npt.NDArray[np.uint8]
WAKE_S = 30.0
TAIL_PHASE = BASE_STATES.index("tail_phase")
TAIL_ANGLE = list(TERM_OUTPUTS).index("tail_angle")
SMALLEST, LARGEST = 16, 4096


def setting_of(options: EnvOptions) -> Setting:
    """The shape of the fish as its file has it, the tank, and the ranges of the actuators."""
    tank = options.config.tree["tank"]
    walls = None if tank["walls"] is None else tuple(float(wall) for wall in tank["walls"])
    water = Tank(0.0, float(tank["depth"]), walls)  # type: ignore[arg-type]
    shape = FishShape.of(options.model.fish)
    return Setting(shape, water, options.config.low, options.config.high)


def scene_of(batch: FishBatch, lane: int, wake: FloatArray, label: str) -> Scene:
    """One fish of a batch as it is now."""
    state, inputs = batch.state[:, lane], batch.inputs[:, lane].copy()
    info = dict(zip(OUTPUTS, batch.outputs[:, lane].tolist(), strict=True))
    return Scene(
        float(batch.time[lane]),
        state[0:3].copy(),
        state[3:7].copy(),
        float(state[7]),
        _tail_angle(batch, lane),
        float(state[TAIL_PHASE]),
        inputs,
        wake,
        Goal(info["goal_depth"], info["goal_heading"], info["goal_speed"]),
        label,
        outline(batch, lane),
    )


def _tail_angle(batch: FishBatch, lane: int) -> float:
    """Where the tail is (rad): where it is told to be, unless an effect has a say in it."""
    model = batch.options.model
    if not model.kernels.composition.effects:
        offset, amplitude = batch.inputs[:2, lane]
        return float(offset + amplitude * np.sin(batch.state[TAIL_PHASE, lane]))
    state, inputs, record = (
        np.ascontiguousarray(rows[:, lane : lane + 1])
        for rows in (batch.state, batch.inputs, batch.records)
    )
    time = batch.time[lane : lane + 1].copy()
    rates = np.zeros_like(inputs)
    _, outputs = model.kernels.terms(state, inputs, rates, record, time, model.tables)
    return float(outputs[TAIL_ANGLE, 0])


class Wakes:
    """Where the fish of a batch have been in their present episodes.

    Args:
        count: how many fish, the first of the batch.
        slots: how many positions are kept of each.
    """

    def __init__(self, count: int, slots: int) -> None:
        self._past = np.zeros((slots, count, 3))
        self._known = np.zeros(count, np.int64)
        self._at = 0

    def note(self, batch: FishBatch) -> None:
        """Keep where they are now; those that have just started have been nowhere before."""
        slots, count, _ = self._past.shape
        self._past[self._at] = batch.state[:3, :count].T
        self._known[:] = np.where(batch.time[:count] == 0.0, 0, self._known + 1)
        np.minimum(self._known, slots - 1, out=self._known)
        self._at = (self._at + 1) % slots

    def of(self, lane: int) -> FloatArray:
        """(n, 3) past positions of a fish, the oldest first, without the present one (m)."""
        if lane >= self._past.shape[1]:
            return np.zeros((0, 3))
        known = int(self._known[lane])
        rows = (self._at - 1 - known + np.arange(known)) % len(self._past)
        past: FloatArray = self._past[rows, lane]
        return past


class Viewer:
    """What ``render`` does for a batch.

    Args:
        options: of the environment.
        mode: ``"human"``, ``"rgb_array"``, ``"mosaic"``, or None.
        modes: those that the environment knows.
        size: width and height of a picture (pixels).
        count: how many fish, from the first, are shown.

    Raises:
        ConfigError: an unknown mode or a size that cannot be.
        MissingExtraError: something is to be drawn, and pygame is not installed.
    """

    def __init__(
        self,
        options: EnvOptions,
        mode: str | None,
        modes: list[str],
        size: tuple[int, int],
        count: int = 1,
    ) -> None:
        if mode not in (None, *modes):
            raise ConfigError(
                f"render_mode {shown(mode)}: choose None or one of {', '.join(modes)}"
            )
        if mode is not None:
            check_installed()
        self.mode = mode
        self.size = _checked_size(size)
        self.setting = setting_of(options)
        self.count = count
        slots = round(WAKE_S / options.config.control_period) + 1
        self._wakes = Wakes(count if mode else 0, slots)
        self._names = [f"fish {i}" for i in range(count)] if count > 1 else [options.task]
        self._views: list[View] = []
        self._mosaic: Mosaic | None = None
        self._window: Window | None = None
        self._unseen = False

    def __getstate__(self) -> dict[str, Any]:
        """Windows and cameras stay where they are; a copy opens its own."""
        return {**vars(self), "_views": [], "_mosaic": None, "_window": None, "_unseen": False}

    @property
    def is_open(self) -> bool:
        """Whether there is a window that the user has not closed."""
        return self._window is not None and self._window.is_open

    def scene(self, batch: FishBatch, lane: int = 0) -> Scene:
        """One fish as it is now.

        Raises:
            ConfigError: before the first reset.
        """
        if not batch.started:
            raise ConfigError("call reset() before asking for a picture")
        name = self._names[lane] if lane < len(self._names) else f"fish {lane}"
        return scene_of(batch, lane, self._wakes.of(lane), name)

    def after_step(self, batch: FishBatch) -> None:
        """Note where the fish are, and show them if there is a window."""
        if self.mode is None:
            return
        self._wakes.note(batch)
        if self.mode == "human":
            self.show(batch)

    def show(self, batch: FishBatch) -> None:
        """Show the fish in the window, which is opened for the first of them.

        Without a screen it warns once, and the fish swim on unseen.
        """
        scenes = self._scenes(batch)
        if self._unseen:
            return
        try:
            if self._window is None:
                self._window = window(self.setting, self.count, self.size)
            self._window.show(scenes)
        except ConfigError as error:
            self._unseen = True
            gym.logger.warn(f"{error}; the simulation continues without a window")

    def frames(self, batch: FishBatch) -> list[Frame]:
        """A picture of each fish."""
        scenes = self._scenes(batch)
        if not self._views:
            self._views = [view(self.setting, self.size) for _ in scenes]
        return [one.frame(scene) for one, scene in zip(self._views, scenes, strict=True)]

    def mosaic(self, batch: FishBatch) -> Frame:
        """All fish in one picture."""
        if self._mosaic is None:
            self._mosaic = mosaic(self.setting, self.count, self.size)
        return self._mosaic.frame(self._scenes(batch))

    def _scenes(self, batch: FishBatch) -> list[Scene]:
        return [self.scene(batch, lane) for lane in range(self.count)]

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()


class Watched:
    """What environments of one and of many fish say of their pictures."""

    _viewer: Viewer

    @property
    def window_open(self) -> bool:
        """Whether there is a window and nobody has closed it; steps go on without it."""
        return self._viewer.is_open

    @property
    def setting(self) -> Setting:
        """What surrounds the fish in pictures: its shape, the tank, the actuators' ranges."""
        return self._viewer.setting


def _checked_size(size: Any) -> tuple[int, int]:
    try:
        numbers = np.asarray(size)
    except ValueError:  # lists of different lengths
        numbers = np.zeros(0)
    whole = numbers.shape == (2,) and np.issubdtype(numbers.dtype, np.integer)
    if not whole or numbers.min() < SMALLEST or numbers.max() > LARGEST:
        raise ConfigError(
            f"render_size {shown(size)}: width and height in pixels, {SMALLEST} to {LARGEST} each"
        )
    return int(numbers[0]), int(numbers[1])
