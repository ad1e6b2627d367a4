"""Runs the compiled filter over all runs of a problem, on all cores."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.effects.extended import ExtendedModel
from fish_env.identification.channels import codes_of
from fish_env.identification.filter_kernels import filter_kernels, replay_kernels
from fish_env.identification.first_state import POSITIONS, told_at_start, undo_geometry
from fish_env.identification.jitter import channel_rates
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.noise_scoring import Replayed
from fish_env.identification.runs import RunData
from fish_env.identification.state_blocks import N_ERROR, N_MOVING
from fish_env.identification.variation import (
    START,
    varied_bias,
    varied_delay,
    varied_gain,
    varied_geometry,
    varied_records,
)
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.work import Work
from fish_env.model.history import history_rows
from fish_env.model.state import BASE_STATES
from fish_env.rigidbody.kinematics import turned
from fish_env.sensing.devices import Device
from fish_env.sensing.geometry import lens_of
from fish_env.threads import default_threads

TAIL_PHASE = 13  # row of the state


@dataclass(frozen=True, eq=False)
class Filtered:
    """Result of the filter on one run.

    Attributes:
        gains: (T, 19, C) Kalman gains.
        whitening: (T, C, C) inverse Cholesky factors of the innovations' covariances.
        innovations: (T, C) whitened.
        shares: (T,) share of its correction that each sample was allowed.
        turns: (T, F) change of the tail's states with its phase; F may be 0.
        states: (T, states) filtered states.
        wrench: (T, 6) filtered disturbance, body frame (N, N m).
        log_likelihood: without its constant.
        slopes: what another noise model's likelihood is computed from, if it was asked for.
    """

    gains: FloatArray
    whitening: FloatArray
    innovations: FloatArray
    shares: FloatArray
    turns: FloatArray
    states: FloatArray
    wrench: FloatArray
    log_likelihood: float
    slopes: Slopes | None = None

    @property
    def residuals(self) -> FloatArray:
        """(T C,) whitened innovations, sample after sample."""
        return self.innovations.ravel()


@dataclass(frozen=True, eq=False)
class Slopes:
    """A run linearised along its filtered states.

    Attributes:
        motion: (T, 12, 19) over the interval before each sample.
        channels: (T, C, 19).
        raw: (T, C) innovations in the channels' units.
    """

    motion: FloatArray
    channels: FloatArray
    raw: FloatArray


@dataclass(frozen=True, eq=False)
class Measurement:
    """How channels show the true state: recorded time, geometry, affine distortion, per lane.

    Attributes:
        pace: (N,) true seconds per recorded second of the measurements' clock.
        skew: (N,) seconds of the commands' clock per second of the measurements' clock.
        delay: (N,) age of the samples, in seconds of the commands' clock.
        gain: (C, N).
        bias: (C, N).
        ages: (devices, N) how much older than its row a sample of each device is (s).
        geometry: fields of :mod:`fish_env.sensing.geometry`, each (N,); none for none.
        cutoff: (N,) of the low-pass inside the inertial unit (Hz); None for none.
    """

    pace: FloatArray
    skew: FloatArray
    delay: FloatArray
    gain: FloatArray
    bias: FloatArray
    geometry: Mapping[str, FloatArray] = field(default_factory=dict)
    ages: FloatArray | None = None
    cutoff: FloatArray | None = None

    @cached_property
    def device_ages(self) -> FloatArray:
        """(devices, N) as kernels read them."""
        none = np.zeros((len(Device), len(self.pace)))
        return none if self.ages is None else np.ascontiguousarray(self.ages + none)

    @cached_property
    def lens(self) -> FloatArray:
        """(LENS_ROWS, N) geometry as kernels read it."""
        return np.ascontiguousarray(lens_of(self.geometry, len(self.pace)))

    def take(self, lanes: IntArray) -> Measurement:
        """That of some of the lanes."""
        return Measurement(
            self.pace[lanes],
            self.skew[lanes],
            self.delay[lanes],
            np.ascontiguousarray(self.gain[:, lanes]),
            np.ascontiguousarray(self.bias[:, lanes]),
            {name: values[lanes] for name, values in self.geometry.items()},
            None if self.ages is None else np.ascontiguousarray(self.ages[:, lanes]),
            None if self.cutoff is None else self.cutoff[lanes],
        )

    def of_run(self, run: RunData, own: FloatArray, channels: Sequence[str]) -> Measurement:
        """The same for a run with numbers of its own (K, N or 1)."""
        bias = np.ascontiguousarray(varied_bias(self.bias, own, channels))
        delay, ages = varied_delay(self.delay, own), run.ages(own)
        ages = ages if self.ages is None else self.ages + ages
        gain = varied_gain(self.gain, run.sensor_errors, channels)
        geometry = varied_geometry(self.geometry, run.sensor_errors, len(self.pace))
        return replace(self, delay=delay, gain=gain, bias=bias, geometry=geometry, ages=ages)


Job = tuple[RunData, "Filtered", int, FloatArray, FloatArray, Measurement, FloatArray, int, int]


class RunFilter:
    """The filter of one model on some runs.

    Args:
        model: fish and effects; built with ``user_effects=(APPLIED_WRENCH,)`` last.
        runs: prepared runs.
        channels: their channels.
        work: counts what is simulated.
    """

    def __init__(
        self,
        model: ExtendedModel,
        runs: Sequence[RunData],
        channels: Sequence[str],
        work: Work | None = None,
    ) -> None:
        self.model, self.work = model, work or Work()
        self.runs = tuple(runs)
        self.channels = tuple(channels)
        self.codes = codes_of(channels)
        self.kernels = filter_kernels(model)
        self.wave_row = model.row_of(str(EffectParameterId("wave", "phase")))

    @cached_property
    def rates(self) -> list[FloatArray]:
        """Of each run, rates of change (T, C) of its measured channels (SI per s)."""
        return [channel_rates(run.clock, run.measured, self.channels) for run in self.runs]

    @cached_property
    def steps(self) -> int:
        """Simulation steps of all runs."""
        return sum(run.steps for run in self.runs)

    def _history_rows(self, records: FloatArray, data: RunData) -> int:
        """Room for tail commands that come late."""
        # A command may switch in each step, and is told then too.
        return history_rows(self.kernels.longest_delay(records), 0.5 * data.shortest_step)

    def _starts(
        self, data: RunData, measurement: Measurement, more: FloatArray | None = None
    ) -> FloatArray:
        """Initial states (states, N): what the first samples say once their distortion is undone.

        Positions and heading, and the tail's phase with the run's own numbers and more of them
        (K, N); the rest starts too widely spread for it to matter.
        """
        count = measurement.gain.shape[1]
        states = np.zeros((len(self.kernels.state_names), count))
        states[: len(BASE_STATES)] = data.state0[:, None]
        if data.as_measured:
            states[TAIL_PHASE] += data.variation[START] + data.phase_begun(measurement.delay)
            if more is not None:
                states[TAIL_PHASE] += more[START]
        for i, name in enumerate(self.channels if data.as_measured else ()):
            gain, bias = measurement.gain[i], measurement.bias[i]
            if name in POSITIONS:
                states[POSITIONS[name]] = (states[POSITIONS[name]] - bias) / gain
            elif name == "yaw":
                states[3:7] = turned(states[3:7], -bias)
        if data.as_measured and measurement.geometry:
            told = [name for name in told_at_start(data.swimming) if name in self.channels]
            undo_geometry(states, measurement.geometry, told)
        return states

    def _of_run(
        self,
        data: RunData,
        records: FloatArray,
        sensors: Measurement,
        more: FloatArray | None = None,
    ) -> tuple[FloatArray, Measurement]:
        """Records and sensors of all lanes as a run's own numbers, and more of them, make them."""
        own = data.variation[:, None] if more is None else data.variation[:, None] + more
        if not own.any() and not data.sensor_errors.any() and not data.moved.any():
            return records, sensors
        varied = np.ascontiguousarray(varied_records(records, own, self.wave_row))
        return varied, sensors.of_run(data, own, self.channels)

    def run(
        self,
        records: FloatArray,
        sensors: Measurement,
        noise: NoiseModel,
        keep_slopes: bool = False,
    ) -> list[Filtered]:
        """Filter every run with one parameter set.

        Args:
            records: (parameters, 1).
            sensors: for one lane.
            noise: noise model.
            keep_slopes: keep what :meth:`replay` needs.
        """
        entry = self.kernels.entry("ekf_run")
        self.work.add((1 + N_ERROR) * self.steps)  # with its slopes

        def one(job: tuple[RunData, FloatArray]) -> Filtered:
            data, rates = job
            record, measurement = self._of_run(data, records, sensors)
            samples, channels = data.measured.shape
            k = np.zeros((samples, N_ERROR, channels))
            w = np.zeros((samples, channels, channels))
            e, share = np.zeros((samples, channels)), np.zeros(samples)
            turns = np.zeros((samples, len(self.kernels.module.TAIL_ROWS)))
            x = np.zeros((samples, len(self.kernels.state_names)))
            d = np.zeros((samples, 6))
            rows = samples if keep_slopes else 0
            shapes = ((N_MOVING, N_ERROR), (channels, N_ERROR), (channels,))
            slopes = Slopes(*(np.zeros((rows, *shape)) for shape in shapes))
            state0 = self._starts(data, measurement)[:, 0].copy()
            value = entry(
                state0, data.swimming, record, measurement.pace[0], measurement.skew[0],
                measurement.delay[0], measurement.gain[:, 0], measurement.bias[:, 0],
                measurement.device_ages[:, 0], measurement.lens, data.clock,
                data.substeps, *data.driven,
                data.corrected, self.codes, sensor_variance(noise, data), noise.jitter_sd * rates,
                data.covariance0, noise.wrench_variance, noise.correlation_s, noise.phase_sd**2,
                noise.phase_reach, self._history_rows(record, data), data.known_wrench,
                self.model.tables, k, w, e, share, turns, x, d,
                slopes.motion, slopes.channels, slopes.raw,
            )  # fmt: skip
            kept = slopes if keep_slopes else None
            return Filtered(k, w, e, share, turns, x, d, float(value), kept)

        return list(_threads().map(one, zip(self.runs, self.rates, strict=True)))

    def replay(
        self, filtered: Sequence[Filtered], made_with: NoiseModel, noise: NoiseModel
    ) -> Replayed:
        """Likelihood of all runs under another noise model, linearised.

        Args:
            filtered: results that kept their slopes.
            made_with: noise model they were made with.
            noise: the other noise model.
        """
        entry = replay_kernels().entry("replay_run")
        ends = np.cumsum([len(run.clock) for run in self.runs])
        innovations = np.zeros((ends[-1], len(self.channels)))
        whitening = np.zeros((ends[-1], len(self.channels), len(self.channels)))

        def one(job: tuple[RunData, FloatArray, Filtered, int]) -> float:
            data, rates, result, end = job
            assert result.slopes is not None
            slopes, own = result.slopes, slice(end - len(data.clock), end)
            value = entry(
                data.clock, data.corrected, slopes.motion, slopes.channels, slopes.raw,
                result.gains, result.shares, result.wrench, made_with.correlation_s,
                sensor_variance(noise, data), noise.jitter_sd * rates, data.covariance0,
                noise.wrench_variance, noise.correlation_s, noise.phase_sd**2,
                innovations[own], whitening[own],
            )  # fmt: skip
            return float(value)

        jobs = zip(self.runs, self.rates, filtered, ends.tolist(), strict=True)
        return Replayed(sum(_threads().map(one, jobs)), innovations, whitening)

    def innovations(
        self,
        records: FloatArray | Sequence[FloatArray],
        measurement: Measurement,
        noise: NoiseModel,
        filtered: Sequence[Filtered],
        pushes: Pushes | None = None,
        variation: FloatArray | None = None,
        starts: Sequence[FloatArray] | None = None,
    ) -> FloatArray:
        """Whitened innovations of many parameter sets with given gains (N, residuals).

        Run after run, sample after sample.

        Args:
            records: (parameters, N), or one such array for each run.
            measurement: what the sensors do, for N lanes.
            noise: noise model.
            filtered: gains of each run.
            pushes: a prescribed wrench for each lane.
            variation: (K, N) added to every run's own numbers.
            starts: of each run, (18, N) base states to begin from; default: those of the run.
        """
        entry, lanes = self.kernels.entry("filter_lanes"), self.kernels.module.BLOCK
        own = [records] * len(self.runs) if isinstance(records, np.ndarray) else records
        count = own[0].shape[1]
        self.work.add(count * self.steps)
        ends = np.cumsum([data.measured.size for data in self.runs]).tolist()
        out = np.empty((count, ends[-1]))
        column = np.zeros(count, np.int64) if pushes is None else pushes.column
        size = np.zeros(count) if pushes is None else pushes.size
        none = [np.zeros((0, 0))] * len(self.runs)
        bases = none if pushes is None else pushes.bases
        jobs = []
        places = [0, *ends[:-1]]
        runs = zip(self.runs, filtered, places, bases, own, strict=True)
        for i, (data, gains, place, basis, lane) in enumerate(runs):
            record, sensors = self._of_run(data, lane, measurement, variation)
            state0 = self._starts(data, sensors, variation)
            if starts is not None:
                state0[: len(BASE_STATES)] = starts[i]
            step = lanes * max(1, -(-count // (4 * lanes)))
            for first in range(0, count, step):
                last = min(count, first + step)
                jobs.append((data, gains, place, basis, record, sensors, state0, first, last))

        def one(job: Job) -> None:
            data, gains, place, basis, record, sensors, state0, first, last = job
            entry(
                state0, data.swimming, record, sensors.pace, sensors.skew, sensors.delay,
                sensors.gain, sensors.bias, sensors.device_ages, sensors.lens, data.clock,
                data.substeps, *data.driven, data.corrected, self.codes,
                gains.gains, gains.whitening, gains.turns,
                noise.correlation_s, self._history_rows(record, data), data.known_wrench, basis,
                column, size, self.model.tables, out, place, first, last,
            )  # fmt: skip

        list(_threads().map(one, jobs))
        return out


def sensor_variance(noise: NoiseModel, run: RunData) -> FloatArray:
    """Variance of a run's white sensor noise (C,), SI."""
    return np.asarray((noise.sensor_sd * run.noise_scale) ** 2)


@dataclass(frozen=True, eq=False)
class Pushes:
    """A prescribed wrench for each lane: function of time times a direction.

    Attributes:
        bases: per run (T, J) functions of time.
        column: (N,) 6 * function + direction (body force x y z, moment x y z).
        size: (N,) N or N m.
    """

    bases: Sequence[FloatArray]
    column: IntArray
    size: FloatArray


@cache
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(default_threads(), thread_name_prefix="filter")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_threads.cache_clear)
