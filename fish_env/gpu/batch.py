"""A batch of fish on the device: the engine behind the environment of tensors."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.arrays import BoolArray, FloatArray
from fish_env.envs import start
from fish_env.envs.batch import BatchShape, FishBatch
from fish_env.envs.config_checks import elapsed_steps
from fish_env.envs.layout import GOAL, OBSERVATION, OUTPUTS, SENSORS, Failure, Setup
from fish_env.envs.options import EnvOptions
from fish_env.envs.randomization import Randomization
from fish_env.errors import ConfigError
from fish_env.gpu import loops
from fish_env.gpu.arrays import fetch, put, wait, zeros
from fish_env.gpu.compiled import (
    blocks_for,
    check_device,
    environment_kernels,
    real_type,
    threads_for,
)
from fish_env.gpu.ranges import pack_ranges
from fish_env.gpu.starting import CORRELATION
from fish_env.model.history import history_rows
from fish_env.params.packing import PATHS, RECORD_FIELDS

MODES = {
    "disabled": loops.DISABLED,
    "next_step": loops.NEXT_STEP,
    "same_step": loops.SAME_STEP,
}
ROUNDING = 1e-3
"""Share of a control step by which sums of float32 periods may be short of the time of success."""


def pack_random(options: EnvOptions) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """Drawn parameters as arrays: their rows in the record (n,), and ``drawn`` (5 + n, n)."""
    random = options.random
    if random is None:
        return np.zeros(0, np.int64), np.zeros((CORRELATION, 0))
    fields = {path: RECORD_FIELDS.index(field) for field, path in PATHS.items()}
    rows = [fields[path] if path in fields else options.model.row_of(path) for path in random.paths]
    table = [random.uniform, random.first, random.second, random.lower, random.upper]
    return np.array(rows, np.int64), np.concatenate([np.stack(table).astype(float), random.factor])


def longest_delay(options: EnvOptions) -> float:
    """The longest delay of the tail's command that a fish of these options can have (s)."""
    kernels, random = options.model.kernels, options.random
    record = options.model.record.copy()
    if random is not None:
        for path, upper in zip(random.paths, random.upper, strict=True):
            row = options.model.row_of(path)
            if row is not None:
                record[row] = _largest(random, path, upper)
    return kernels.longest_delay(record)


def _largest(random: Randomization, path: str, upper: float) -> float:
    """The largest value that is drawn of a parameter."""
    largest = random.draw(np.ones((len(random.paths), 1)))[path][0]
    index = random.paths.index(path)
    # A normal number that depends on others can be larger than where all are at their ends.
    alone = 0.0 if random.uniform[index] else np.abs(random.factor[index]).sum() * 2.5
    reach = random.first[index] + alone * random.second[index]
    return float(min(upper, max(largest, reach)))


class DeviceBatch:
    """N fish on the device, each in an episode of its own; all arrays stay there.

    Attributes:
        options: what the environment is.
        count: number of fish.
        obs: (N, observations) float32, of the last step or reset.
        actions: (N, 5) float32, which the next step takes; write to it.
        reward: (N,) float32 of the last step.
        terminated: (N,) bool: which fish failed in it.
        truncated: (N,) bool: which episodes reached their longest time in it.
        outputs: (len(OUTPUTS), N) what ``info`` reports.
        final_obs: (N, observations) float32, of a fish's last episode that ended, and
        final_outputs: (len(OUTPUTS), N) of it.
        drawn: path -> (N,) randomised parameters of each fish in its present episode.
    """

    def __init__(
        self,
        options: EnvOptions,
        count: int,
        *,
        precision: str = "float32",
        autoreset: str = "same_step",
        max_episode_steps: int = 400,
    ) -> None:
        """Allocate the arrays; a step needs a reset first.

        Args:
            options: what the environment is.
            count: number of fish.
            precision: ``"float32"`` or ``"float64"``.
            autoreset: ``"same_step"``, ``"next_step"`` or ``"disabled"``, as Gymnasium has them.
            max_episode_steps: control steps until truncation.

        Raises:
            ConfigError: no device, or an unknown name.
        """
        check_device()
        if autoreset not in MODES:
            raise ConfigError(f"autoreset '{autoreset}': one of {', '.join(MODES)}")
        self.options, self.count = options, count
        self.max_episode_steps = max_episode_steps
        self.real = real = real_type(precision)
        self._kernels = environment_kernels(options, precision, MODES[autoreset])
        self._rows = rows = self._kernels.module
        self._shape = shape = BatchShape.of(options)
        self._data = zeros((shape.data_rows, count), real)
        self._queue = zeros((shape.queue_slots, 5, count), real)
        self._ring = zeros((shape.ring_slots, shape.ring_rows, count), real)
        self._history = zeros(
            (history_rows(longest_delay(options), options.config.dt), count), real
        )
        self._draws = zeros((start.draw_count(options), count), real)
        self._whole = zeros((3, count), np.int64)
        self._counters = zeros(3, np.int64)
        self._seed = zeros(2, np.uint64)
        self._bad = zeros(1, np.int64)
        self._put_settings()
        self.actions = zeros((count, 5), np.float32)
        self.obs, self.final_obs = (zeros((count, len(OBSERVATION)), np.float32) for _ in range(2))
        self.reward = zeros(count, np.float32)
        self.terminated, self.truncated = (zeros(count, np.bool_) for _ in range(2))
        self.outputs = self._data[rows.ROW_OUTPUT : rows.ROW_OUTPUT + len(OUTPUTS)]
        self.final_outputs = zeros((len(OUTPUTS), count), real)
        paths = () if options.random is None else options.random.paths
        self.drawn = {
            path: self._data[rows.ROW_PAR + row]
            for path, row in zip(paths, pack_random(options)[0].tolist(), strict=True)
        }
        self._started = False

    def _put_settings(self) -> None:
        """Copy to the device what does not change."""
        options, real = self.options, self.real
        noise_sd = options.noise_sd
        self._noise = zeros((0 if noise_sd is None else len(SENSORS), self.count), real)
        self._noise_sd = put(np.zeros(0) if noise_sd is None else noise_sd, real)
        setup = options.config.setup(options.task)
        if real is np.float32:
            setup[Setup.SUCCESS_TIME] -= ROUNDING * options.config.control_period
        grid = self._shape.grid
        self._grid = tuple(
            put(array, np.int64 if array.dtype.kind == "i" else real) for array in grid
        )
        rows, drawn = pack_random(options)
        self._setup = put(setup, real)
        self._ranges = put(pack_ranges(options.config), real)
        self._nominal = put(options.model.record[:, 0], real)
        self._drawn_rows, self._drawn = put(rows, np.int64), put(drawn, real)
        self._slew = put(options.config.slew, real)
        self._tables = put(options.model.tables, real)

    @property
    def state(self) -> Any:
        """(states, N) states of all fish, rows as ``options.model.kernels.state_names``."""
        return self._data[: self._rows.N_STATES]

    @property
    def records(self) -> Any:
        """(parameters, N) parameter records."""
        return self._data[self._rows.ROW_PAR : self._rows.ROW_TIME]

    @property
    def goal(self) -> Any:
        """(len(GOAL), N) goals."""
        return self._data[self._rows.ROW_GOAL : self._rows.ROW_GOAL + len(GOAL)]

    @property
    def time(self) -> Any:
        """(N,) time since the start of the episodes (s)."""
        return self._data[self._rows.ROW_TIME]

    def set_elapsed(self, steps: npt.ArrayLike) -> None:
        """Count control steps as taken already, so that present episodes are truncated earlier.

        Args:
            steps: (N,) control steps, from 0 to max_episode_steps - 1.

        Raises:
            ConfigError: other numbers.
        """
        counted = fetch(self._whole)
        counted[loops.STEPS] = elapsed_steps(steps, self.count, self.max_episode_steps)
        self._whole.copy_to_device(counted)

    def data(self) -> npt.NDArray[Any]:
        """A copy on the host of all numbers that last through an episode, rows as in a batch."""
        return fetch(self._data)

    def reset(
        self,
        seed: int | None = None,
        mask: BoolArray | None = None,
        draws: FloatArray | None = None,
        stream: Any = 0,
    ) -> None:
        """Start new episodes.

        Args:
            seed: of all random numbers from now on; None goes on.
            mask: (N,) which fish; default: all.
            draws: (numbers, N) uniform numbers in [0, 1) to start from, in place of random ones.
            stream: of CUDA.

        Raises:
            ConfigError: a seed for some of the fish, a mask or draws of another shape, or a start
                that has failed already.
        """
        mask = np.ones(self.count, bool) if mask is None else np.asarray(mask)
        if mask.shape != (self.count,) or mask.dtype != bool:
            raise ConfigError(f"mask must be a boolean array of shape ({self.count},)")
        if not self._started and not mask.all():
            raise ConfigError("the first reset must be of all fish")
        if seed is not None:
            self._put_seed(seed, mask)
        if draws is not None:
            if np.shape(draws) != self._draws.shape:
                raise ConfigError(f"draws must have shape {self._draws.shape}")
            self._draws.copy_to_device(np.ascontiguousarray(draws, self.real))
        chosen = put(mask, np.bool_)
        wait()  # what was copied, was copied on another stream
        self._launch(
            self._kernels.reset, stream, chosen, draws is not None, self._data,
            *self._start_arrays(), self._counters, self._whole,
        )  # fmt: skip
        wait()
        self._started = True
        self._check_start(mask)

    def _put_seed(self, seed: int, mask: BoolArray) -> None:
        if not mask.all():
            raise ConfigError("a seed belongs to a reset of all fish; leave it out")
        if not 0 <= seed < 2**64:
            raise ConfigError(f"seed {seed}: 0 to 2**64 - 1")
        self._seed.copy_to_device(np.array([seed & 0xFFFFFFFF, seed >> 32], np.uint64))
        self._whole.copy_to_device(np.zeros((3, self.count), np.int64))
        self._counters.copy_to_device(np.zeros(3, np.int64))

    def _start_arrays(self) -> tuple[Any, ...]:
        return (
            self._draws, self._ranges, self._nominal, self._drawn_rows, self._drawn, self._slew,
            self._queue, self._ring, self._history, self._noise, self._noise_sd, self.obs,
            self._setup, self._seed,
        )  # fmt: skip

    def _check_start(self, mask: BoolArray) -> None:
        failures = fetch(self.outputs)[OUTPUTS.index("failure"), mask]
        if failures.any():
            raise ConfigError(
                f"this start has failed already ({Failure(int(failures.max())).name.lower()}): "
                "change `start` and `goal` in the settings"
            )

    def load(self, batch: FishBatch) -> None:
        """Go on from the state of a batch on the CPU, made with the same options.

        Raises:
            ConfigError: nothing was reset there, or other options.
        """
        saved = batch.save_state()
        arrays = saved["arrays"]
        if not saved["started"] or arrays["_data"].shape != self._data.shape:
            raise ConfigError("load takes a batch with the same options and count, after a reset")
        for own, name in ((self._data, "_data"), (self._queue, "_queue"), (self._ring, "_ring")):
            own.copy_to_device(np.ascontiguousarray(arrays[name], self.real))
        history = np.zeros(self._history.shape)
        if saved["history"].shape == history.shape:
            history[:] = saved["history"]
        self._history.copy_to_device(history.astype(self.real))
        self.obs.copy_to_device(arrays["obs"])
        self._whole.copy_to_device(np.zeros((3, self.count), np.int64))
        self._counters.copy_to_device(np.array([*saved["places"], 0], np.int64))
        self._started = True

    def step(self, stream: Any = 0) -> None:
        """One control step of all fish, with what stands in ``actions``; nothing is waited for.

        Raises:
            ConfigError: nothing was reset yet.
        """
        if not self._started:
            raise ConfigError("call reset() before step()")
        self._launch(
            self._kernels.step, stream, self._data, self.actions, self._queue, *self._grid,
            self._ring, self._noise, self._noise_sd, self.obs, self._setup, self._history,
            self._tables, self._seed, self._counters, self._bad,
        )  # fmt: skip
        self._launch(
            self._kernels.finish, stream, self._data, *self._start_arrays(), self._counters,
            self._whole, self.max_episode_steps, self.reward, self.terminated, self.truncated,
            self.final_obs, self.final_outputs,
        )  # fmt: skip
        self._kernels.count_step[1, 1, stream](
            self._counters, self._queue.shape[0], self._ring.shape[0]
        )

    def check_actions(self) -> None:
        """Wait for the device, and make sure that no action so far was NaN.

        Raises:
            ConfigError: some were; they counted as 0.
        """
        bad = int(fetch(self._bad)[0])
        if bad:
            raise ConfigError(f"{bad} action values were NaN; the policy has diverged")

    def _launch(self, kernel: Any, stream: Any, *arguments: Any) -> None:
        kernel[blocks_for(self.count), threads_for(self.count), stream](*arguments)
