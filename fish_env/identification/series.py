"""One-step innovations of runs over time: fish, runs, what is free, what is noise."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.data.schema import Dataset
from fish_env.effects import catalogue
from fish_env.effects.extended import ExtendedModel, build_model
from fish_env.errors import EffectError
from fish_env.identification.applied_wrench import EFFECT as APPLIED_WRENCH
from fish_env.identification.channels import usable_channels
from fish_env.identification.filtering import Filtered, Measurement, Pushes, RunFilter
from fish_env.identification.generic_forces import BoundForces, generic_forces
from fish_env.identification.kernel_kinds import LEAN, quickest, with_stages
from fish_env.identification.noise import (
    disturbance_range,
    fitted_noise,
    runs_for_noise,
    small_disturbance,
    white_noise_sd,
    widest_disturbance,
)
from fish_env.identification.noise_model import RELAXED_PHASE_SD, UNEVEN_PHASE_SD, NoiseModel
from fish_env.identification.open_loop import in_units_of_noise, windows
from fish_env.identification.parameters import ALIKE, baseline_of, changes_of, neutral_values
from fish_env.identification.phases import settle_phases
from fish_env.identification.run_noise import noise_scales
from fish_env.identification.run_numbers import as_devices_record, renumbered
from fish_env.identification.run_reading import prepare_run
from fish_env.identification.sensor_errors import slopes_of_runs
from fish_env.identification.sensors import largest_jitter_of, largest_noise
from fish_env.identification.shared_filter import by_other_filters
from fish_env.identification.steps import Stepped
from fish_env.identification.tail_drive import LATE, LATE_SENSORS, TailDrive
from fish_env.identification.variation import COMMON, EVERY, USUAL, VARIATIONS
from fish_env.identification.variation_slopes import swum_slopes
from fish_env.identification.wave_phases import AMPLITUDE, settle_wave_phases
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.hypotheses import EffectParameterId, effect_names, effects_of
from fish_env.inference.probes import phase_grid
from fish_env.inference.problem import Point
from fish_env.inference.vehicle import EffectFreedom, freedoms
from fish_env.inference.work import Work
from fish_env.model.effect import Effect
from fish_env.params.io import load_fish
from fish_env.params.schema import FishParams


class SeriesProblem(Stepped):
    """Measured runs of a fish, the model that should explain them, and its freedom.

    Args:
        dataset: measured runs.
        fish: parameters; default: the dataset's own fish.
        run_ids: runs to use; default: all.
        paths: free coefficients; default: all with a prior.
        effects: names of effects that are free.
        user_effects: effects of the caller's own, among ``effects`` or not.
        dt: longest RK4 step (s), but for a moment after each switch of the commands and for
            effects that make the tail's rate jump, or are faster in the fish's file.
        most_passes: how often all runs are simulated before no further search begins.
    """

    known: dict[str, Effect]
    drive: TailDrive
    hidden_by_drive = LATE
    late_sensors = LATE_SENSORS
    out_of_step = effect_names("frequency_scale", "battery_sag", "clock_scale", "clock_skew")
    interchangeable = ALIKE
    variations, common_effects = EVERY, COMMON

    def __init__(
        self,
        dataset: Dataset,
        fish: FishParams | None = None,
        run_ids: Sequence[str] | None = None,
        paths: Sequence[str] | None = None,
        effects: Iterable[str] = (),
        user_effects: Iterable[Effect] = (),
        dt: float = 0.01,
        most_passes: float = np.inf,
    ) -> None:
        self.dataset, self.fish = dataset, fish or load_fish(dataset.fish)
        self.known = {**catalogue(), **{e.name: e for e in user_effects}}
        own = (*(e for e in self.known.values() if e.name not in catalogue()), APPLIED_WRENCH)
        self.model: ExtendedModel = build_model(self.fish, user_effects=own, whole_catalogue=True)
        self.dt = dt = dt / self.model.substeps(dt)
        self.channels = usable_channels(dataset.channels)
        given = dataset.noise.get
        self.sensor_sd = np.array([given(n) or white_noise_sd(dataset, n) for n in self.channels])
        scales = noise_scales(dataset, self.channels)
        self.runs = tuple(
            prepare_run(dataset.run(i), self.channels, self.sensor_sd, dt, scales[i])
            for i in (dataset.ids if run_ids is None else run_ids)
        )
        self.baseline = baseline_of(dataset, self.fish, paths)
        self.effects = tuple(effects)
        self.drive = TailDrive()
        self.work = Work(sum(run.steps for run in self.runs), most_passes)
        self._filters: dict[frozenset[str], RunFilter] = {}
        if unknown := [name for name in self.effects if name not in self.known]:
            raise EffectError(f"unknown effects {unknown}; known: {', '.join(self.known)}")

    @property
    def lean_filter(self) -> RunFilter:
        """Compiled filter on these runs without effects on the motion."""
        return self._filter_of(LEAN)

    def filter_for(self, effects: Iterable[EffectParameterId]) -> RunFilter:
        """The quickest filter that computes with these effect parameters."""
        return self._filter_of(self.batch_key(effects_of(effects)))

    def _filter_of(self, stages: frozenset[str]) -> RunFilter:
        if stages not in self._filters:
            model = with_stages(self.model, stages)
            self._filters[stages] = RunFilter(model, self.runs, self.channels, self.work)
        return self._filters[stages]

    def until(self, end_s: float) -> SeriesProblem:
        """The same problem on the beginnings of its runs."""
        return self.with_runs([run.until(end_s) for run in self.runs])

    def neutral(self, names: Iterable[str]) -> dict[EffectParameterId, float]:
        """Values of effects as the fish's file has them, neutral where it says nothing."""
        return neutral_values(self.model, self.known, names)

    @property
    def longest_run(self) -> float:
        """Length of the longest run (s)."""
        return max(run.duration for run in self.runs)

    @property
    def run_count(self) -> int:
        """Number of runs."""
        return len(self.runs)

    def groups(self) -> tuple[IntArray, FloatArray]:
        """(D,) run of each innovation, and (D,) its time in the run (s)."""
        run_of = np.repeat(np.arange(len(self.runs)), [run.measured.size for run in self.runs])
        return run_of, np.concatenate([np.repeat(r.clock, len(self.channels)) for r in self.runs])

    def residual_channels(self) -> tuple[tuple[str, ...], IntArray]:
        """Names of the channels, and (D,) which of them each innovation is of."""
        rows = sum(len(run.clock) for run in self.runs)
        return self.channels, np.tile(np.arange(len(self.channels)), rows)

    @property
    def measured(self) -> BoolArray:
        """(D,) whether an innovation belongs to a value that was measured."""
        return np.concatenate([np.isfinite(run.measured).ravel() for run in self.runs])

    def without_feedback(
        self, filtered: Sequence[Filtered], noise: NoiseModel
    ) -> tuple[SeriesProblem, Sequence[Filtered], IntArray]:
        """Windows from filtered states over which the fish swims alone (see the protocol)."""
        cut = [windows(run, f, self.channels) for run, f in zip(self.runs, filtered, strict=True)]
        problem = self.with_runs([window for own in cut for window in own])
        still = in_units_of_noise(problem.runs, noise.sensor_sd)
        return problem, still, np.repeat(np.arange(len(cut)), [len(own) for own in cut])

    @property
    def run_ids(self) -> tuple[str, ...]:
        """Ids."""
        return tuple(run.id for run in self.runs)

    def some(self, runs: Sequence[int]) -> SeriesProblem:
        """The same problem on some of its runs."""
        return self.with_runs([self.runs[i] for i in runs])

    def default_noise(self) -> NoiseModel:
        """Sensor noise from differences of the data, and a disturbance of a few millinewton."""
        return self.differing_noise() if self.drive.uneven else small_disturbance(self.sensor_sd)

    def differing_noise(self) -> NoiseModel:
        """The noise model to begin from where each run has a drive, and errors, of its own."""
        noise = small_disturbance(self.sensor_sd)
        return replace(noise, phase_sd=UNEVEN_PHASE_SD, spread=USUAL)

    def fitted_noise(
        self,
        point: Point,
        noise: NoiseModel,
        final: bool,
        filtered: Sequence[Filtered] = (),
        leverage: Callable[[], FloatArray] | None = None,
    ) -> NoiseModel:
        """Noise model of largest likelihood at a point, from all runs where they differ."""
        largest = self.largest_sensor_sd if final else None
        few = self.spread(self.run_count if noise.spread.any() else runs_for_noise(self.runs))
        return fitted_noise(self, few, point, noise, largest, filtered)

    def disturbance_at_limit(self, noise: NoiseModel) -> tuple[str, ...]:
        """How the disturbance leaves what is plausible: a misfit with another name."""
        return disturbance_range(self.fish).left_by(noise)

    def passing_noise(self, noise: NoiseModel) -> NoiseModel | None:
        """The noise model with a disturbance that passes, where it is one that stays."""
        return disturbance_range(self.fish).passing(noise)

    def swamped(self, noise: NoiseModel) -> bool:
        """Whether a disturbance is as strong as any that a noise model may have."""
        return bool(widest_disturbance(self.fish).left_by(noise))

    @property
    def samples_follow(self) -> bool:
        """Whether all runs share a low-pass inside the inertial unit."""
        return any(run.is_smoothed for run in self.runs)

    def settled(self, point: Point, noise: NoiseModel, nearby: bool = False) -> SeriesProblem:
        """The same problem with the likeliest phases of tails that have none, and of a wave."""
        own = settle_phases(as_devices_record(self, point, noise), point, noise, nearby)
        return settle_wave_phases(own, point, noise)

    @cached_property
    def largest_sensor_sd(self) -> FloatArray:
        """(C,) largest white noise that a channel may have, whatever the model misses (SI)."""
        return largest_noise(self.dataset, self.channels, self.sensor_sd)

    @cached_property
    def largest_jitter_s(self) -> float:
        """Largest jitter of the sample times that the channels allow (s)."""
        return largest_jitter_of(self.dataset)

    def starts_known(self, further: Iterable[str] = ()) -> bool:
        """Whether no run's tail begins in an unknown phase, and no wave is to begin in one."""
        known = all(r.phase_known or (r.phase_found and self.drive.uneven) for r in self.runs)
        return known and AMPLITUDE.effect not in further

    def relaxed_noise(self, noise: NoiseModel) -> NoiseModel:
        """The noise model with a random-walk tail phase."""
        return replace(noise, phase_sd=RELAXED_PHASE_SD)

    def follows_drive(self, noise: NoiseModel) -> bool:
        """Whether the tail's phase is a random walk."""
        return noise.phase_sd >= RELAXED_PHASE_SD

    def starting_grid(self, name: str) -> tuple[Mapping[str, float], ...]:
        """Sizes of an effect that drifts in phase, close enough to put it in step again."""
        if not all(run.phase_known for run in self.runs):
            return self.drive.beside(self.known[name])
        return phase_grid(self.known[name], max(run.beats for run in self.runs))

    def with_drive(self, drive: TailDrive) -> SeriesProblem:
        """The same problem, told how the tail beats."""
        return self._but(drive=drive)

    def batch_key(self, names: Iterable[str]) -> frozenset[str]:
        """Stages of the quickest kernel that computes with these effects."""
        every = {*names, *self.model.effects}
        return quickest({stage for name in every for stage in self.known[name].needs})

    @property
    def variation(self) -> FloatArray:
        """(R, K) what each run differs in."""
        return np.array([np.r_[run.variation, run.sensor_errors] for run in self.runs])

    def with_variation(
        self, values: FloatArray, point: Point, noise: NoiseModel, near: Sequence[Filtered] = ()
    ) -> SeriesProblem:
        """The same problem with other numbers (R, K) of the runs (see the protocol)."""
        return self.with_runs(renumbered(self, values, point, noise, near))

    def as_commanded(self) -> SeriesProblem:
        """The same problem with tails that beat as commanded, in every run."""
        return self.with_runs([replace(run, own_beat=1.0, own_sag=0.0) for run in self.runs])

    def variation_slopes(
        self, point: Point, noise: NoiseModel, filtered: Sequence[Filtered], steps: FloatArray
    ) -> FloatArray:
        """(D, K) change of each innovation with its own run's numbers.

        By differences (K,) where the fish has to swim again, else through the filter's slopes.
        """
        swum = swum_slopes(self, point, noise, filtered, steps[: len(VARIATIONS)])
        if any(one.slopes is None for one in filtered):
            filtered = self.filtered(point, noise, keep_slopes=True)
        seen = slopes_of_runs(self.runs, filtered, self.channels, noise.correlation_s)
        return np.hstack([swum, -seen])  # the data hold the errors, and not the model

    def generic_terms(self, fit: Any) -> BoundForces:
        """Forces and moments that depend on motion, attitude, depth, time, beat or commands."""
        return BoundForces(fit, generic_forces(self.runs, fit.filtered, self.channels))

    def freedoms(self, names: Iterable[str]) -> tuple[EffectFreedom, ...]:
        """Free parameters of effects."""
        step = min(self.dt, self.longest_step)
        return tuple(f for name in names for f in freedoms(self.known[name], step))

    def innovations(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: NoiseModel,
        filtered: Sequence[Filtered],
        pushes: Pushes | None = None,
    ) -> FloatArray:
        """Whitened innovations of many points, shape (N, residuals), runs one after another.

        Args:
            z: (n, N) baseline coefficients.
            effects: effect parameter -> (N,).
            noise: noise model.
            filtered: gains to use.
            pushes: a prescribed wrench for each point.
        """
        lanes = self.lanes(z, effects)
        rows = self.filter_for(effects).innovations(*lanes, noise, filtered, pushes)
        cutoffs = lanes[1].cutoff
        if cutoffs is not None and self._filters_differ(cutoffs, filtered):
            seen = self.runs, filtered, self.channels
            rows -= by_other_filters(*seen, noise.correlation_s, cutoffs)
        return rows

    def _filters_differ(self, cutoffs_hz: FloatArray, filtered: Sequence[Filtered]) -> bool:
        """Whether some points (N,) have another low-pass than the samples were put right for.

        Where nothing corrects the simulation, samples stay as they are. All runs share the filter.
        """
        follow = self.samples_follow and all(one.slopes is not None for one in filtered)
        return follow and bool((cutoffs_hz != self.runs[0].cutoff_hz).any())

    def changes(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: NoiseModel,
        filtered: Sequence[Filtered],
        pushes: Pushes | None = None,
    ) -> FloatArray:
        """What :meth:`innovations` change from the first point to each other (N - 1, residuals)."""
        rows = self.innovations(z, effects, noise, filtered, pushes)
        rows[1:] -= rows[0]
        return rows[1:]

    def filtered(
        self,
        point: Point,
        noise: NoiseModel,
        near: Sequence[Filtered] = (),
        keep_slopes: bool = False,
    ) -> list[Filtered]:
        """Extended Kalman filter of every run at one point (see the protocol).

        It begins where its run does, and not ``near`` another one. Where runs differ, and where
        samples follow the motion, it keeps in any case what :meth:`RunFilter.replay` needs.
        """
        keep = keep_slopes or self.samples_follow or bool(noise.spread.any())
        return self.filter_for(point.effects).run(*self.lane(point), noise, keep)

    def lasting(self, filtered: Sequence[Filtered]) -> list[Filtered]:
        """The filtered runs without the slopes of their filters, a third of what a fit holds.

        Where samples follow the motion these are needed wherever parameters are compared.
        """
        if self.samples_follow:
            return list(filtered)
        return [replace(run, slopes=None) for run in filtered]

    def lane(self, point: Point) -> tuple[FloatArray, Measurement]:
        """Parameter record (parameters, 1) of a point, and what its sensors do."""
        return self.lanes(point.z[:, None], {k: np.array([v]) for k, v in point.effects.items()})

    def lanes(
        self, z: FloatArray, effects: Mapping[EffectParameterId, FloatArray]
    ) -> tuple[FloatArray, Measurement]:
        """Parameter records (parameters, N) and what the sensors do, for N points."""
        own = self.model, self.known, self.baseline
        changes, measurement = changes_of(*own, z, effects, self.channels)
        model = self.filter_for(effects).model
        return np.ascontiguousarray(model.records(changes)), measurement


def series_of(fit: Fit) -> SeriesProblem:
    """The problem of a fit to runs over time.

    Raises:
        TypeError: the fit is one to other data.
    """
    if not isinstance(fit.problem, SeriesProblem):
        raise TypeError(f"expected a fit to runs over time, not to {type(fit.problem).__name__}")
    return fit.problem
