"""A batch of fish in their episodes: the engine behind single and vector environment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray, IntArray
from fish_env.envs import start
from fish_env.envs.layout import (
    GOAL,
    GUIDE,
    MAX_BEAT_S,
    OBSERVATION,
    OUTPUTS,
    SENSORS,
    WAYPOINTS,
    Failure,
)
from fish_env.envs.options import EnvOptions
from fish_env.errors import ConfigError
from fish_env.model.compose import cache_folder
from fish_env.model.grid import Grid
from fish_env.model.history import forget, history_rows
from fish_env.model.runtime import Kernels, kernels, run_in_threads
from fish_env.model.state import BASE_STATES, INTEGRAL_ROW
from fish_env.threads import default_threads

STEP_TEMPLATE = Path(__file__).with_name("step_template.py")
NOISE_BLOCK = 64
"""Noise is drawn for this many steps at a time."""
STEPPED = (
    "_data", "_actions", "_queue", "_ring", "_noise", "_noise_blocks", "_noise_used", "obs",
)  # fmt: skip
"""Arrays of a batch that steps change."""


def generator(state: Mapping[str, Any]) -> np.random.Generator:
    """A random generator that goes on from the state of another one's ``bit_generator``."""
    bits: Any = np.random.PCG64()
    bits.state = dict(state)
    return np.random.Generator(bits)


def real_actions(actions: npt.ArrayLike, shape: tuple[int, ...]) -> npt.NDArray[Any]:
    """Returns actions as an array of real numbers.

    Args:
        actions: what the caller gave. NumPy would read texts as numbers and drop the imaginary
            part of complex ones, so their type is looked at.
        shape: the shape they must have.

    Raises:
        ConfigError: another shape, or no real numbers.
    """
    try:
        given = np.asarray(actions)
    except (ValueError, TypeError, RuntimeError) as error:
        raise ConfigError(f"actions must be numbers in shape {shape}: {error}") from None
    if given.dtype.kind not in "fiub":
        raise ConfigError(
            f"actions of type {given.dtype} are not real numbers; give shape {shape}, float32"
        )
    if given.shape != shape:
        raise ConfigError(f"actions have shape {shape}, not {given.shape}")
    return given


def step_kernels(options: EnvOptions) -> Kernels:
    """The physics of these options with the environment step behind it."""
    composition = options.model.kernels.composition
    return kernels(replace(composition, templates=(*composition.templates, STEP_TEMPLATE)))


def physics_of(options: EnvOptions) -> str:
    """What a step of these options computes with: a hash of all kernel sources and of numba."""
    return cache_folder(step_kernels(options).composition).name


@dataclass(frozen=True)
class BatchShape:
    """Sizes of the arrays that a batch steps in, whatever device they are on.

    Attributes:
        data_rows: numbers of a fish that last through an episode.
        queue_slots: control steps whose targets are kept.
        grid: physics steps of a control step.
        ring_slots: physics steps whose samples are kept.
        ring_rows: numbers of a sample.
        trace_row: first state row of a sample.
    """

    data_rows: int
    queue_slots: int
    grid: Grid
    ring_slots: int
    ring_rows: int
    trace_row: int

    @classmethod
    def of(cls, options: EnvOptions) -> BatchShape:
        """The sizes that these options need."""
        config, lag = options.config, options.observation_lag
        beat = int(np.ceil(MAX_BEAT_S / config.dt)) + 2
        return cls(
            step_kernels(options).module.DATA_ROWS
            + (len(WAYPOINTS) if options.task == "path" else 0),
            options.action_lag // config.substeps + 2,
            _control_step(options),
            max(beat + lag, config.substeps) + 1,
            len(options.model.kernels.state_names) if lag else 3,
            0 if lag else INTEGRAL_ROW,
        )


def _control_step(options: EnvOptions) -> Grid:
    """One control step on the grid of physics steps; actions that come late split it in two."""
    substeps, dt = options.config.substeps, options.config.dt
    whole, part = divmod(options.action_lag, substeps)
    slots = [-whole] if part == 0 else [-whole - 1, -whole]
    steps = [substeps] if part == 0 else [part, substeps - part]
    starts = [0.0] if part == 0 else [0.0, part * dt]
    ones = np.ones(len(steps), np.int64)
    return Grid(np.array(slots), np.array(starts), np.array(steps), np.full(len(steps), dt), ones)


class FishBatch:
    """N fish, each in an episode of its own, advanced together.

    Attributes:
        options: what the environment is.
        obs: (N, observations) float32, of the last step or reset.
        reward: (N,) reward of the last step (a view).
        outputs: (len(OUTPUTS), N) what ``info`` reports (a view).
        drawn: path -> (N,) randomised parameters of each fish in its present episode.
    """

    def __init__(self, options: EnvOptions, count: int, threads: int | None = None) -> None:
        self.options = options
        self.count = count
        self.threads = threads or default_threads()
        config, shape = options.config, BatchShape.of(options)
        self._data = np.zeros((shape.data_rows, count))
        self._actions = np.zeros((count, 5), np.float32)
        self._substeps = config.substeps
        self._queue = np.zeros((shape.queue_slots, 5, count))
        self._queue_at = 0
        self._grid = shape.grid
        self._trace_row = shape.trace_row
        self._ring = np.zeros((shape.ring_slots, shape.ring_rows, count))
        self._ring_at = 0
        self._history = np.zeros((0, count))
        self._setup = config.setup(options.task)
        self._slew = config.slew
        self._noise = np.zeros((0 if options.noise_sd is None else len(SENSORS), count))
        self._noise_blocks = np.zeros((count, NOISE_BLOCK, len(self._noise)))
        self._noise_used = np.zeros(count, np.int64)
        self._noise_rngs: list[np.random.Generator | None] = [None] * count
        self.obs = np.zeros((count, len(OBSERVATION)), np.float32)
        paths = () if options.random is None else options.random.paths
        self.drawn = {path: np.zeros(count) for path in paths}
        self._started = False
        self._bind()

    def _bind(self) -> None:
        """Compiled code and views of the data, which are not part of a pickle."""
        self._base = self.options.model.kernels
        self._kernels = step_kernels(self.options)
        self._rows = rows = self._kernels.module
        self.reward = self._data[rows.ROW_REWARD]
        self.outputs = self._data[rows.ROW_OUTPUT : rows.ROW_OUTPUT + len(OUTPUTS)]
        self._work = self._kernels.scratch()
        self._step = self._kernels.entry("step_one" if self.count == 1 else "step_lanes")

    def __getstate__(self) -> dict[str, Any]:
        bound = ("_base", "_kernels", "_rows", "reward", "outputs", "_step", "_work")
        return {name: value for name, value in vars(self).items() if name not in bound}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._bind()

    def save_state(self) -> dict[str, Any]:
        """All that steps change, as arrays and plain values; :meth:`load_state` takes it."""
        rngs = [None if rng is None else rng.bit_generator.state for rng in self._noise_rngs]
        return {
            "arrays": {name: getattr(self, name) for name in STEPPED},
            "history": self._history,
            "drawn": self.drawn,
            "places": [self._queue_at, self._ring_at],
            "noise": rngs,
            "started": self._started,
        }

    def load_state(self, state: Mapping[str, Any]) -> None:
        """Goes on from a state of fish with the same options, to the same bits.

        Raises:
            KeyError, ValueError: the state is not that of such fish.
        """
        for name in STEPPED:
            getattr(self, name)[:] = state["arrays"][name]  # there are views of these
        self._history = np.array(state["history"], float)
        for path, values in self.drawn.items():
            values[:] = state["drawn"][path]
        self._queue_at, self._ring_at = map(int, state["places"])
        self._noise_rngs = [None if saved is None else generator(saved) for saved in state["noise"]]
        self._started = state["started"]
        if not self._places_exist():
            raise ValueError("places in queues, noise or paths that do not exist")

    def _places_exist(self) -> bool:
        """Whether all numbers by which compiled code reads, which does not ask, are in range."""
        rows, data = self._rows, self._data
        places = ((self._queue_at, self._queue), (self._ring_at, self._ring))
        points = data[rows.ROW_GOAL + GOAL.index("path_points")]
        leg = data[rows.ROW_GUIDE + GUIDE.index("leg")]
        most = 1 + (len(data) - rows.ROW_POINTS) // 3
        on_path = (points >= 0) & (points <= most) & (leg >= 0) & (leg <= np.maximum(points - 2, 0))
        inside = all(at in range(len(held)) for at, held in places)
        return bool(inside and on_path.all() and (self._noise_used >= 0).all())

    @property
    def started(self) -> bool:
        """Whether there has been a reset."""
        return self._started

    @property
    def results(self) -> list[float]:
        """Reward of fish 0, then its outputs: what a single environment reads after a step."""
        last = self._rows.ROW_OUTPUT + len(OUTPUTS)
        numbers: list[float] = self._data[self._rows.ROW_REWARD : last, 0].tolist()
        return numbers

    @property
    def state(self) -> FloatArray:
        """(states, N) states of all fish (a view), rows as ``model.kernels.state_names``."""
        return self._data[: self._rows.N_STATES]

    @property
    def inputs(self) -> FloatArray:
        """(5, N) actuator positions (a view)."""
        return self._data[self._rows.ROW_INPUTS : self._rows.ROW_SLEW]

    @property
    def goal(self) -> FloatArray:
        """(len(GOAL), N) goals of the present episodes (a view), see ``layout.GOAL``."""
        return self._data[self._rows.ROW_GOAL : self._rows.ROW_GOAL + len(GOAL)]

    @property
    def records(self) -> FloatArray:
        """(parameters, N) parameter records (a view)."""
        return self._data[self._rows.ROW_PAR : self._rows.ROW_TIME]

    @property
    def time(self) -> FloatArray:
        """(N,) time since the start of each episode (s, a view)."""
        time: FloatArray = self._data[self._rows.ROW_TIME]
        return time

    def reset(
        self,
        lanes: IntArray,
        rngs: list[np.random.Generator],
        given: Mapping[str, Any] | None = None,
    ) -> None:
        """Start new episodes for some fish.

        Args:
            lanes: (k,) which fish.
            rngs: their generators; each fish draws from its own alone.
            given: reset options that hold for all of them.

        Raises:
            ConfigError, ParameterError, EffectError: options that cannot be; says which.
        """
        given = start.check_reset_options(given)
        options, rows, data = self.options, self._rows, self._data
        draws = np.stack([rng.random(start.draw_count(options)) for rng in rngs], axis=1)
        goal = start.goals(options, draws, given)
        state = np.zeros((len(self._base.state_names), len(lanes)))
        state[: len(BASE_STATES)] = start.poses(options, draws, goal, given)
        changes = start.parameters(options, draws, given)
        start.put_flow(options, goal, changes, given)
        record = start.records(options, changes, len(lanes))
        low, high = options.config.low, options.config.high
        inputs = np.repeat(np.clip(0.0, low, high)[:, None], len(lanes), axis=1)
        self._base.initialise(state, inputs, record, np.zeros(len(lanes)))
        reach = history_rows(self._base.longest_delay(record), options.config.dt)
        self._history = forget(self._history, lanes, reach)
        action = (inputs - (high + low)[:, None] / 2) / ((high - low)[:, None] / 2)
        data[: rows.N_STATES, lanes] = state
        data[rows.ROW_INPUTS : rows.ROW_SLEW, lanes] = inputs
        data[rows.ROW_SLEW : rows.ROW_PAR, lanes] = self._slew[:, None]
        data[rows.ROW_PAR : rows.ROW_TIME, lanes] = record
        data[rows.ROW_TIME, lanes] = 0.0
        data[rows.ROW_GOAL : rows.ROW_GOAL + len(GOAL), lanes] = goal[: len(GOAL)]
        data[rows.ROW_POINTS :, lanes] = goal[len(GOAL) :][: len(data) - rows.ROW_POINTS]
        data[rows.ROW_FAILED, lanes] = np.inf
        data[rows.ROW_ACTION : rows.ROW_WITHIN, lanes] = action
        data[rows.ROW_WITHIN, lanes] = 0.0
        data[rows.ROW_REWARD, lanes] = 0.0
        self._queue[:, :, lanes] = inputs
        self._fill_ring(lanes, state)
        self._start_noise(lanes, rngs)
        for path, values in self.drawn.items():
            values[lanes] = changes[path]
        self._kernels.entry("observe_batch")(
            data, lanes, self._ring, self._ring_at - 1 + len(self._ring),
            options.observation_lag, self._trace_row, self._noise, self.obs, self._setup,
        )  # fmt: skip
        self._check_start(lanes)
        self._started = True

    def step(self, actions: npt.ArrayLike) -> None:
        """One control step of all fish; results are in ``obs``, ``reward``, ``outputs``.

        Args:
            actions: (N, 5) in [-1, 1]; values beyond are clipped.

        Raises:
            ConfigError: an action is not a number, or nothing was reset yet.
        """
        if not self._started:
            raise ConfigError("call reset() before step()")
        self._actions[:] = actions
        if len(self._noise):
            self._draw_noise()
        if self.count == 1:
            bad = self._advance(0, 1)
        else:
            bad = run_in_threads(self._advance, self.count, self._kernels.lanes, self.threads)
        self._ring_at = (self._ring_at + self._substeps) % len(self._ring)
        self._queue_at = (self._queue_at + 1) % len(self._queue)
        if bad:
            raise ConfigError(f"{bad} action values are NaN; the policy has diverged")

    def _advance(self, first: int, last: int) -> int:
        return int(
            self._step(
                self._data, self._actions, self._queue, self._queue_at, *self._grid, self._ring,
                self._ring_at, self._noise, self.obs, self._setup, self._substeps,
                self.options.observation_lag, self._trace_row, self._history,
                self.options.model.tables, first, last,
                self._work if self.count == 1 else self._kernels.scratch(),
            )
        )  # fmt: skip

    def _fill_ring(self, lanes: IntArray, state: FloatArray) -> None:
        """As if the fish had kept its first heading and speed since long before the start."""
        slots = len(self._ring)
        age = (self._ring_at - 1 - np.arange(slots)) % slots * self.options.config.dt
        qw, qx, qy, qz = state[3:7]
        across = np.stack([1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qw * qz)])
        rates = np.concatenate([across / np.hypot(*across), state[7:8]])
        past = -age[:, None, None] * rates
        if self._trace_row == 0:
            self._ring[:, :, lanes] = state
            integrals = slice(INTEGRAL_ROW, INTEGRAL_ROW + 3)
            self._ring[:, integrals, lanes] = past
        else:
            self._ring[:, :, lanes] = past

    def _check_start(self, lanes: IntArray) -> None:
        failures = self.outputs[OUTPUTS.index("failure"), lanes]
        if failures.any():
            failure = Failure(int(failures.max())).name.lower()
            raise ConfigError(
                f"this start has failed already ({failure}): the fish must be in the tank, "
                f"{self.options.config.top} to {self.options.config.bottom} m deep, and upright"
            )

    def _start_noise(self, lanes: IntArray, rngs: list[np.random.Generator]) -> None:
        if self.options.noise_sd is None:
            return
        for lane, rng in zip(lanes, rngs, strict=True):
            self._noise_rngs[lane] = np.random.Generator(np.random.PCG64(rng.integers(2**63)))
            self._noise_used[lane] = NOISE_BLOCK
        self._draw_noise(lanes)

    def _draw_noise(self, lanes: IntArray | None = None) -> None:
        chosen = np.arange(self.count) if lanes is None else lanes
        for lane in chosen[self._noise_used[chosen] >= NOISE_BLOCK]:
            rng = self._noise_rngs[lane]
            assert rng is not None
            normals = rng.standard_normal(self._noise_blocks.shape[1:])
            self._noise_blocks[lane] = normals * self.options.noise_sd
            self._noise_used[lane] = 0
        self._noise[:, chosen] = self._noise_blocks[chosen, self._noise_used[chosen]].T
        self._noise_used[chosen] += 1
