"""Measured data in memory: runs over time, and tables of steady motion.

All arrays are SI and radians, in the model's frames (see `fish_env.data.frames`), and are to be
treated as read-only. Two datasets are equal when everything but their notes is, missing samples
equal to missing samples.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from itertools import combinations
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from fish_env.arrays import FloatArray
from fish_env.data.vocabulary import CHANNELS, COMMANDS, OBSERVATIONS
from fish_env.errors import DatasetError

Start = Literal["rest", "unknown"]

FEWEST_SHARED, SHARED = 10, 0.2
"""Runs are the same if this many of their samples are, and this share of the shorter run's."""


def _same(left: Any, right: Any) -> bool:
    if isinstance(left, np.ndarray):
        return np.array_equal(left, right, equal_nan=True)
    if isinstance(left, Mapping):
        return left.keys() == right.keys() and all(_same(left[k], right[k]) for k in left)
    return bool(left == right)


class _ComparedByContent:
    """Equality field by field, which the arrays in the fields do not give by themselves."""

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        compared = [f.name for f in fields(self) if f.compare]  # type: ignore[arg-type]
        return all(_same(getattr(self, name), getattr(other, name)) for name in compared)


def _require(holds: bool, owner: str, reason: str) -> None:
    if not holds:
        raise DatasetError(f"{owner}: {reason}.")


def _float_array(values: ArrayLike) -> FloatArray:
    return np.ascontiguousarray(values, dtype=np.float64)


def _increasing(times_s: FloatArray) -> bool:
    return bool(np.all(np.isfinite(times_s)) and np.all(np.diff(times_s) > 0.0))


@dataclass(frozen=True, eq=False)
class CommandSteps(_ComparedByContent):
    """Commands held constant between switch times (zero-order hold).

    Equal consecutive rows are merged on construction, so `times_s` are true switch times.

    Attributes:
        times_s: Times from which each row holds, shape (m,), s, increasing.
        values: Commands, shape (m, 5), SI: tail_offset rad, tail_amplitude rad,
            tail_frequency Hz, block_displacement m, block_angle rad.

    Raises:
        DatasetError: The shapes do not match, times do not increase or a command is not finite.
    """

    times_s: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        times, values = _float_array(self.times_s), _float_array(self.values)
        _require(times.ndim == 1 and times.size > 0, "commands", "times_s must have shape (m,)")
        expected = (times.size, len(COMMANDS))
        _require(values.shape == expected, "commands", f"values must have shape {expected}")
        _require(_increasing(times), "commands", "times_s must be finite and increasing")
        _require(bool(np.isfinite(values).all()), "commands", "every command must be finite")
        switches = np.r_[True, np.any(values[1:] != values[:-1], axis=1)]
        object.__setattr__(self, "times_s", times[switches])
        object.__setattr__(self, "values", values[switches])

    def at(self, times_s: ArrayLike) -> FloatArray:
        """Returns the commands that hold at the given times, shape (n, 5).

        Before the first switch time the first row holds.
        """
        row = np.searchsorted(self.times_s, np.asarray(times_s), side="right") - 1
        return self.values[np.maximum(row, 0)]


@dataclass(frozen=True, eq=False)
class Run(_ComparedByContent):
    """One measured run.

    Attributes:
        id: Name of the run, unique in its dataset.
        time_s: Sample times as measured, shape (n,), s, increasing, not necessarily even.
        channels: Measured values by channel name, each of shape (n,), NaN where a sample is
            missing: x y z m, roll pitch yaw tail_angle rad, u v w m/s, p q r rad/s.
        commands: What was asked of the servos; every switch time is one of `time_s`, the first
            the first.
        start: "rest": level at the first measured position, with zero velocity; "unknown":
            the initial state is something to estimate.
        tail_phase: Tail phase at the first sample, rad, or None where it is not known.
        condition: Name that repeats of one experiment share, or None.

    Raises:
        DatasetError: Shapes, names or times do not fit together.
    """

    id: str
    time_s: FloatArray
    channels: Mapping[str, FloatArray]
    commands: CommandSteps
    start: Start
    tail_phase: float | None = None
    condition: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_s", _float_array(self.time_s))
        ordered = sorted(self.channels, key=_position_in(CHANNELS, f"run {self.id}"))
        channels = {name: _float_array(self.channels[name]) for name in ordered}
        object.__setattr__(self, "channels", channels)
        self._check()

    def _check(self) -> None:
        owner, time = f"run {self.id}", self.time_s
        _require(time.ndim == 1 and time.size >= 2, owner, "a run needs at least two samples")
        _require(_increasing(time), owner, "time_s must be finite and increasing")
        _require(bool(self.channels), owner, "a run needs at least one channel")
        for name, values in self.channels.items():
            _require(values.shape == time.shape, owner, f"{name} must have shape {time.shape}")
            _require(not np.isinf(values).any(), owner, f"{name} has an infinite value")
            _require(not np.isnan(values).all(), owner, f"{name} has no sample at all")
        switches = self.commands.times_s
        _require(bool(switches[0] == time[0]), owner, "commands must begin at the first sample")
        _require(
            bool(np.isin(switches, time).all()),
            owner,
            "commands switch between samples; build the run with Run.from_steps, "
            "which adds a row without samples there",
        )

    @classmethod
    def from_steps(
        cls,
        id: str,
        time_s: ArrayLike,
        channels: Mapping[str, ArrayLike],
        commands: CommandSteps,
        **about: Any,
    ) -> "Run":
        """Builds a run whose commands may switch between, or before, its samples.

        Where they switch between samples, a row with every channel missing is added.

        Args:
            id: Name of the run.
            time_s: Sample times, shape (n,), s.
            channels: Values by channel, each of shape (n,).
            commands: Commands at any times.
            **about: start, tail_phase and condition, as for the class.
        """
        sampled = _float_array(time_s)
        inside = commands.times_s[
            (commands.times_s > sampled[0]) & (commands.times_s < sampled[-1])
        ]
        times = np.union1d(sampled, inside)
        measured = np.isin(times, sampled)
        padded = {name: np.full(times.shape, np.nan) for name in channels}
        for name, values in channels.items():
            padded[name][measured] = _float_array(values)
        steps = np.r_[sampled[:1], inside]
        return cls(id, times, padded, CommandSteps(steps, commands.at(steps)), **about)


@dataclass(frozen=True, eq=False)
class Dataset(_ComparedByContent):
    """Measured runs of one fish.

    Attributes:
        name: Name of the dataset.
        fish: Name of a shipped parameter set, or the absolute path of a parameter file.
        runs: The runs.
        noise: One-sigma noise by channel, SI, for those channels where it is known.
        about: Free text from the file: description, source, licence and the like.
        notes: What reading left aside or converted, for the user to see.
        declared: Column and unit in the file of each channel and command that was read from one.
        frame: Frame that the file is declared in, "ned" or "enu".
    """

    name: str
    fish: str
    runs: tuple[Run, ...]
    noise: Mapping[str, float] = field(default_factory=dict)
    about: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = field(default=(), compare=False)
    declared: Mapping[str, tuple[str, str]] = field(default_factory=dict, compare=False)
    frame: str = field(default="ned", compare=False)

    def __post_init__(self) -> None:
        _require(bool(self.runs), self.name, "a dataset needs at least one run")
        _unique(self.name, self.ids)
        _require(
            all(run.channels.keys() == self.runs[0].channels.keys() for run in self.runs),
            self.name,
            "all runs must have the same channels",
        )
        _check_noise(self.name, self.noise, self.channels)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the measured channels."""
        return tuple(self.runs[0].channels)

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the runs."""
        return tuple(run.id for run in self.runs)

    @property
    def conditions(self) -> tuple[str | None, ...]:
        """Condition of each run."""
        return tuple(run.condition for run in self.runs)

    def run(self, id: str) -> Run:
        """Returns the run of that id.

        Raises:
            DatasetError: There is none.
        """
        _require(id in self.ids, self.name, f"no run '{id}'; there are: {', '.join(self.ids)}")
        return self.runs[self.ids.index(id)]


def identical_runs(runs: tuple[Run, ...]) -> tuple[tuple[str, str], ...]:
    """Returns pairs of ids of runs that hold the same samples, which repeats never do.

    Whatever their times: a run that was copied, cut or moved in time counts as the same.
    """
    every = [_moments(run) for run in runs]
    return tuple(
        (one.id, other.id)
        for (i, one), (j, other) in combinations(enumerate(runs), 2)
        if _overlap(every[i], every[j])
    )


def _moments(run: Run) -> frozenset[bytes]:
    """The distinct triples of samples that follow each other, of all channels at once.

    A single sample may well come again: at rest, or where there is one channel only.
    """
    values = np.column_stack(list(run.channels.values()))
    measured = np.isfinite(values)
    # One of each number, whichever sign of zero or NaN.
    values = np.where(measured, values, 0.0) + 0.0
    kept = np.ascontiguousarray(values[measured.any(axis=1)])
    return frozenset(kept[i : i + 3].tobytes() for i in range(max(1, len(kept) - 2)))


def _overlap(one: frozenset[bytes], other: frozenset[bytes]) -> bool:
    shared, fewest = len(one & other), min(len(one), len(other))
    return shared == fewest or (shared >= FEWEST_SHARED and shared > SHARED * fewest)


@dataclass(frozen=True, eq=False)
class SteadyDataset(_ComparedByContent):
    """A table of steady motion: commands held until the motion repeats, and what it then was.

    Attributes:
        name: Name of the dataset.
        fish: Name of a shipped parameter set, or the absolute path of a parameter file.
        ids: Name of each row, unique.
        conditions: Name that repeats of one experiment share, or None, for each row.
        commands: Commands, shape (n, 5), SI, in the order of `CommandSteps.values`.
        observations: By name, each of shape (n,), NaN where missing: surge_speed, sway_speed,
            heave_speed (body frame) and speed m/s, yaw_rate rad/s, turn_radius m, pitch rad.
        noise: One-sigma noise by observation, SI, for those where it is known.
        about: Free text from the file: description, source, licence and the like.
        notes: What reading left aside or converted, for the user to see.
    """

    name: str
    fish: str
    ids: tuple[str, ...]
    conditions: tuple[str | None, ...]
    commands: FloatArray
    observations: Mapping[str, FloatArray]
    noise: Mapping[str, float] = field(default_factory=dict)
    about: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        rows = len(self.ids)
        ordered = sorted(self.observations, key=_position_in(OBSERVATIONS, self.name))
        observations = {name: _float_array(self.observations[name]) for name in ordered}
        object.__setattr__(self, "observations", observations)
        object.__setattr__(self, "commands", _float_array(self.commands))
        _require(rows > 0, self.name, "a table needs at least one row")
        _require(bool(observations), self.name, "a table needs at least one observation")
        _unique(self.name, self.ids)
        _require(len(self.conditions) == rows, self.name, f"conditions must have {rows} entries")
        shape = (rows, len(COMMANDS))
        _require(self.commands.shape == shape, self.name, f"commands must have shape {shape}")
        _require(bool(np.isfinite(self.commands).all()), self.name, "commands must be finite")
        for name, values in observations.items():
            _require(values.shape == (rows,), self.name, f"{name} must have shape ({rows},)")
            _require(not np.isinf(values).any(), self.name, f"{name} has an infinite value")
            _require(not np.isnan(values).all(), self.name, f"{name} has no value at all")
        _check_noise(self.name, self.noise, tuple(observations))


def _position_in(known: Mapping[str, object], owner: str) -> Any:
    order = {name: position for position, name in enumerate(known)}

    def position(name: str) -> int:
        _require(name in order, owner, f"unknown name '{name}'; known are: {', '.join(order)}")
        return order[name]

    return position


def _unique(owner: str, ids: tuple[str, ...]) -> None:
    twice = sorted({id for id in ids if ids.count(id) > 1})
    _require(not twice, owner, f"ids must be unique, but these occur twice: {', '.join(twice)}")


def _check_noise(owner: str, noise: Mapping[str, float], channels: tuple[str, ...]) -> None:
    for name, sigma in noise.items():
        _require(name in channels, owner, f"noise is given for '{name}', which is not measured")
        _require(0.0 < sigma < np.inf, owner, f"noise of {name} must be positive and finite")
