"""Measured runs as the filter reads them: clocks, commands, channels, initial states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.identification.command_jumps import soon_after
from fish_env.identification.late_rows import in_earlier_rows, moved_further, rows_to_spare
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.state_blocks import PHASE_COLUMN
from fish_env.identification.variation import (
    BEAT,
    COUNT,
    CURRENT,
    SAG,
    SENSOR_ERRORS,
    device_ages,
)
from fish_env.sensing.devices import Device, devices_of, late_s, seen_cutoff

PHASE = PHASE_COLUMN
BEFORE_S = 1e3
FREQUENCY = 2  # column of the commands
HELD_S = 1.0
"""How long a frequency is held that falls all along: of one that falls by a tenth of a per cent a
second, the phase is then off by a thousandth of a radian."""
FINER = 4
"""How many times finer those are than the others."""
LONG_STEP_S = 0.02
"""Longest step where causes are only compared: what most of them change comes out the same within
a thousandth, what the quickest lags change within a tenth. Twice as long, a lag that the usual
steps follow diverges."""


@dataclass(frozen=True, eq=False)
class RunData:
    """One run, ready for the filter.

    Attributes:
        id: the run's id.
        condition: repeats share it.
        clock: (T,) sample times from the first (s).
        substeps: (T,) RK4 steps up to each sample.
        fresh: (T,) whether a jump of the commands came so shortly before that steps are fine.
        command_times: (m,) switch times on the same clock (s); the first may be long before it.
        command_values: (m, 5).
        measured: (T, C), NaN where missing.
        state0: (18,) initial base state.
        covariance0: (19, 19) of its error state.
        phase_known: whether the tail phase at the start is known.
        phase_found: whether the initial state has the likeliest one, if it is not.
        swimming: whether the tail was beating before the run began.
        as_measured: whether position and heading of the initial state are as the samples show them,
            with whatever distorts those; otherwise they are true.
        wrench: (T, 6) known force (N) and moment (N m) on the hull, body frame, from each sample to
            the next; None for none.
        own_beat: its tail's frequency at the start over that of all runs, as far as measured.
        own_sag: share of it lost each second (1/s), likewise.
        variation: (K,) what this run differs in from the others, see ``variation.VARIATIONS``.
        sensor_errors: (K,) errors of its sensors, see ``variation.SENSOR_ERRORS``.
        distortion: (T, C) what they do to its samples; None for nothing.
        recorded: (T, C) samples in the rows that their stamps ask for, where they are evenly spaced
            and rows may be moved by devices' delays; None where rows stay.
        devices: (C,) device of each channel, where rows may be moved.
        late: (devices,) how late each device is in all runs (s), beside what is a run's own.
        cutoff_hz: of the low-pass inside the inertial unit, in all runs; infinite for none.
        moved: (devices,) rows by which the samples of each device were moved to earlier ones.
        noise_scale: (C,) noise of its sensors over the usual one, or one number for all.
        usual_substeps: (T,) of published estimates, where ``substeps`` are fewer; else None.
    """

    id: str
    condition: str | None
    clock: FloatArray
    substeps: IntArray
    fresh: BoolArray
    command_times: FloatArray
    command_values: FloatArray
    measured: FloatArray
    state0: FloatArray
    covariance0: FloatArray
    phase_known: bool
    swimming: bool = False
    as_measured: bool = True
    wrench: FloatArray | None = None
    own_beat: float = 1.0
    own_sag: float = 0.0
    variation: FloatArray = field(default_factory=lambda: np.zeros(COUNT))
    sensor_errors: FloatArray = field(default_factory=lambda: np.zeros(len(SENSOR_ERRORS)))
    distortion: FloatArray | None = None
    recorded: FloatArray | None = None
    devices: IntArray | None = None
    late: FloatArray = field(default_factory=lambda: np.zeros(len(Device)))
    cutoff_hz: float = np.inf
    moved: IntArray = field(default_factory=lambda: np.zeros(len(Device), np.int64))
    noise_scale: FloatArray = field(default_factory=lambda: np.ones(1))
    usual_substeps: IntArray | None = None
    phase_found: bool = False

    @property
    def current(self) -> FloatArray:
        """(2,) speed at which the water carries the fish in this run, north and east (m/s)."""
        return self.sensor_errors[list(CURRENT)]

    @property
    def known_wrench(self) -> FloatArray:
        """(T, 6) known wrench, or no rows."""
        return self.wrench if self.wrench is not None else np.zeros((0, 6))

    @cached_property
    def corrected(self) -> FloatArray:
        """(T, C) samples without the errors of the sensors, as far as these are known."""
        if self.distortion is None:
            return self.measured
        return np.ascontiguousarray(self.measured - self.distortion)

    def with_numbers(self, variation: FloatArray, sensor_errors: FloatArray) -> RunData:
        """The same run with other numbers of its own; sensor errors do nothing to samples as yet.

        Samples are in the last rows before their devices took them: between two rows the motion is
        known back to the first one, and after the second a command may have changed it.
        """
        own = replace(self, variation=variation, sensor_errors=sensor_errors, distortion=None)
        return own._in_last_rows()

    @property
    def is_smoothed(self) -> bool:
        """Whether all runs share a low-pass that takes something off the motion."""
        return bool(np.isfinite(self.cutoff_hz))

    def with_devices(self, late: FloatArray, cutoff_hz: float) -> RunData:
        """The same run where other times and another filter make devices late in all runs.

        What the filter does to samples beside that follows from the motion, and is as before.

        Args:
            late: (devices,) how late each is (s), by its filter too.
            cutoff_hz: of the low-pass inside the inertial unit; infinite for none.
        """
        return replace(self, late=late, cutoff_hz=cutoff_hz)._in_last_rows()

    def with_cutoff(self, cutoff_hz: float) -> RunData:
        """The same samples in the same rows as if another low-pass had made them as late."""
        late = self.late.copy()
        late[Device.INERTIAL] += late_s(cutoff_hz) - late_s(self.cutoff_hz)
        return replace(self, late=late, cutoff_hz=seen_cutoff(cutoff_hz))

    def _in_last_rows(self) -> RunData:
        """The same run with its samples in the last rows before their devices took them."""
        if self.recorded is None:
            return self
        rows = np.floor((device_ages(self.variation) + self.late) / self.step_s).astype(np.int64)
        rows = np.clip(rows, 0, self.most_rows)
        if np.array_equal(rows, self.moved):
            return self
        own = None if self.distortion is None else self.moved_on(self.distortion, rows)
        return replace(self, measured=self._in_rows(rows), distortion=own, moved=rows)

    def moved_on(self, of_samples: FloatArray, rows: IntArray) -> FloatArray:
        """What belongs to samples (T, C), where these are moved to other rows.

        Args:
            of_samples: in the rows where the samples are now.
            rows: (devices,) rows by which the samples of each device are moved then.
        """
        if np.array_equal(rows, self.moved):
            return of_samples
        assert self.devices is not None
        return moved_further(of_samples, self.devices, rows - self.moved)

    def movable(self, channels: Sequence[str]) -> RunData:
        """The same run with rows that may be moved, where its samples are evenly spaced.

        A device that is late shows what was. Moved by whole rows its samples are as they were, and
        only part of a row is left to the equations of motion. The last rows count for nothing, so
        that the same samples count however far they are moved.

        Args:
            channels: names of the channels.
        """
        if self.most_rows < 1:
            return self
        run = replace(self, devices=np.array(devices_of(channels)))
        return run._recorded_as(self.measured)

    def as_recorded(self) -> RunData:
        """The same run with all samples in the rows that their stamps ask for, where they stay."""
        if self.recorded is None:
            return self
        none = np.zeros_like(self.moved)
        return replace(self, measured=self.recorded, recorded=None, devices=None, moved=none)

    def without_smeared_gyros(self, channels: Sequence[str]) -> RunData:
        """The same run without the samples of its gyro just after jumps, where rows may be moved.

        Where runs have delays of their own, nobody knows what a filter inside a gyro makes of one.

        Args:
            channels: names of the channels.
        """
        if self.recorded is None:
            return self
        recorded, gyro = self.recorded.copy(), np.isin(channels, ["p", "q", "r"])
        smeared = soon_after(self.commands, self.clock, IDENTIFICATION.smeared_gyro_s)
        recorded[np.ix_(smeared, gyro)] = np.nan
        return self._recorded_as(recorded)

    def _recorded_as(self, recorded: FloatArray) -> RunData:
        """The same run with other samples (T, C), moved as its own are."""
        run = replace(self, recorded=recorded)
        return replace(run, measured=run._in_rows(run.moved))

    def _in_rows(self, rows: IntArray) -> FloatArray:
        """(T, C) samples moved to earlier rows (devices,), but for those that judge nothing."""
        assert self.recorded is not None
        assert self.devices is not None
        seen = in_earlier_rows(self.recorded, self.devices, rows, self.most_rows)
        if not self.swimming:
            seen[self.clock < IDENTIFICATION.untold_start_s] = np.nan
        return seen

    @cached_property
    def step_s(self) -> float:
        """Usual time from one sample to the next (s)."""
        return float(np.median(np.diff(self.clock)))

    @property
    def most_rows(self) -> int:
        """Rows by which samples may be moved."""
        return rows_to_spare(self.clock)

    def ages(self, own: FloatArray) -> FloatArray:
        """How much older than its row a sample of each device is (devices, N), s.

        By the run's own numbers alone: what all runs have in common comes on top.

        Args:
            own: (K, N) the run's own numbers.
        """
        return device_ages(own) - self.step_s * self.moved[:, None]

    @property
    def own_ages(self) -> FloatArray:
        """(devices,) the same by the run's present numbers, and all that makes devices late."""
        return np.asarray(self.ages(self.variation[:, None])[:, 0] + self.late)

    @property
    def steps(self) -> int:
        """RK4 steps from its first sample to its last."""
        return int(self.substeps.sum())

    def phase_begun(self, delay: FloatArray) -> FloatArray:
        """Phase (N,) that a tail which starts from rest has at the first sample (rad).

        It begins to beat with the commands. Where their clock is ahead, it has begun before.

        Args:
            delay: (N,) age of the samples, on the commands' clock (s).
        """
        if self.swimming:
            return np.zeros(len(delay))
        times, commands = self.driven
        frequency = commands[np.searchsorted(times, 0.0, side="right") - 1, FREQUENCY]
        return np.asarray(2.0 * np.pi * frequency * np.maximum(-delay, 0.0))

    @cached_property
    def shortest_step(self) -> float:
        """The shortest of its RK4 steps (s)."""
        return float(np.min(np.diff(self.clock) / self.substeps[1:]))

    def in_long_steps(self, fastest: float = np.inf, long: float = LONG_STEP_S) -> RunData:
        """The same run, simulated no finer than a comparison needs.

        Args:
            fastest: time constant that the fish has anyhow (s).
            long: longest step (s).
        """
        long = min(long, fastest)
        longest = np.where(self.fresh, long / FINER, long)
        fewer = np.minimum(self.substeps, steps_between(self.clock, longest))
        if np.array_equal(fewer, self.substeps):
            return self
        usual = self.substeps if self.usual_substeps is None else self.usual_substeps
        return replace(self, substeps=fewer, usual_substeps=usual)

    def in_usual_steps(self) -> RunData:
        """The same run in the steps of published estimates."""
        if self.usual_substeps is None:
            return self
        return replace(self, substeps=self.usual_substeps, usual_substeps=None)

    @property
    def commands(self) -> tuple[FloatArray, FloatArray]:
        """Switch times (m,) and commands (m, 5) of the run itself."""
        first = int(self.command_times[0] <= -0.5 * BEFORE_S)
        return self.command_times[first:], self.command_values[first:]

    @cached_property
    def driven(self) -> tuple[FloatArray, FloatArray]:
        """Switch times (n,) and commands (n, 5) with the frequency that its tail beats at.

        A frequency that falls all along is held for :data:`HELD_S` at a time.
        """
        beat = self.own_beat * (1.0 + float(self.variation[BEAT]))
        sag = self.own_sag + float(self.variation[SAG])
        if beat == 1.0 and sag == 0.0:
            return self.command_times, self.command_values
        times = self.command_times
        if sag != 0.0:
            times = np.union1d(times, np.arange(0.0, self.clock[-1], HELD_S))
        row = np.searchsorted(self.command_times, times, side="right") - 1
        values = self.command_values[np.maximum(row, 0)]
        middle = 0.5 * (times + np.r_[times[1:], times[-1] + HELD_S])
        values[:, FREQUENCY] *= beat * np.maximum(1.0 - sag * np.maximum(middle, 0.0), 0.0)
        return times, values

    @property
    def beats(self) -> float:
        """How often the tail beats, as commanded."""
        times, values = self.commands
        spans = np.diff(np.clip([*times, self.duration], 0.0, self.duration))
        return float(spans @ values[:, FREQUENCY])

    def until(self, end_s: float) -> RunData:
        """The beginning of the run, at least two samples of it; movable rows stay movable."""
        count = max(2, int(np.searchsorted(self.clock, end_s, side="right")))
        if count >= len(self.clock):
            return self
        part = self.cut(0, count)
        return part if self.recorded is None else part._recorded_as(self.recorded[:count])

    def cut(self, first: int, last: int) -> RunData:
        """The same run with some of its samples, ``first`` to before ``last``."""
        own = slice(first, last)
        return replace(
            self,
            clock=np.ascontiguousarray(self.clock[own]),
            substeps=np.ascontiguousarray(self.substeps[own]),
            usual_substeps=None if self.usual_substeps is None else self.usual_substeps[own],
            fresh=self.fresh[own],
            measured=np.ascontiguousarray(self.measured[own]),
            recorded=None,
            wrench=None if self.wrench is None else np.ascontiguousarray(self.wrench[own]),
            distortion=None if self.distortion is None else self.distortion[own],
        )

    @property
    def duration(self) -> float:
        """Length (s)."""
        return float(self.clock[-1])


def steps_between(clock: FloatArray, longest: float | FloatArray) -> IntArray:
    """RK4 steps (T,) from one row to the next, no longer than asked.

    Args:
        clock: (T,) times of the rows (s).
        longest: step before each row (s), or one for all.
    """
    spans = np.diff(clock, prepend=0.0)
    return np.maximum(1, np.ceil(spans / longest - 1e-9)).astype(np.int64)
