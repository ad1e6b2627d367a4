"""Simulation errors over whole runs: fish, runs, what is free, what weights errors have.

One simulation a run, no filter in between, so what is slow shows as much as what is quick. Start,
tail phase and tail frequency of every run are free. They are eliminated before the common
parameters are solved for (separable least squares: Golub and Pereyra, 1973, SIAM J. Numer. Anal.
10, 413; with the slopes of Kaufman, 1975, BIT 15, 49).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from typing import Any

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.data.schema import Dataset
from fish_env.identification.beats import beats_of, by_run
from fish_env.identification.channels import from_above
from fish_env.identification.filtering import Pushes
from fish_env.identification.parameters import ALIKE, PLANAR_PATHS
from fish_env.identification.runs import RunData
from fish_env.identification.series import SeriesProblem
from fish_env.identification.whole_runs.evaluation import RunEvaluation
from fish_env.identification.whole_runs.forces import forces_of
from fish_env.identification.whole_runs.noise import SimulationNoise, first_noise, fitted_errors
from fish_env.identification.whole_runs.own_numbers import PACE, own_numbers
from fish_env.identification.whole_runs.shown import middling, shown_parameters
from fish_env.identification.whole_runs.simulation import simulation_errors
from fish_env.identification.whole_runs.starts import (
    MORE_STEPS,
    OwnFit,
    fit_own_numbers,
    likeliest,
)
from fish_env.inference.evaluation import GenericTerms
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point, Problem
from fish_env.inference.vehicle import EffectFreedom
from fish_env.model.effect import Effect
from fish_env.params.schema import FishParams

DT_S = 0.02
FREQUENCY_SCALE = "frequency_scale"
"""Effect that is always free: every run's tail beats a little faster or slower than it says."""
SCALE = EffectParameterId(FREQUENCY_SCALE, "scale")
EFFECT_STEP = 0.05
"""Share of the usual step for differences by effects: runs bend more than one-step errors do."""


class WholeRunProblem(Problem):
    """Measured runs of a fish, simulated from their start to their end.

    Args:
        dataset: measured runs.
        fish: parameters; default: the dataset's own fish.
        run_ids: runs to use; default: all.
        paths: free coefficients; default: all with a prior, of data in a horizontal plane those
            that such data show.
        effects: names of effects whose parameters are free beside ``frequency_scale``.
        user_effects: effects of the caller's own.
        dt: longest RK4 step (s).
    """

    known: dict[str, Effect]
    interchangeable = ALIKE
    coefficient_step = 5e-4
    """A secant of 0.05 puts the minimum elsewhere: runs bend strongly with the static moment."""

    def __init__(
        self,
        dataset: Dataset,
        fish: FishParams | None = None,
        run_ids: Sequence[str] | None = None,
        paths: Sequence[str] | None = None,
        effects: Iterable[str] = (),
        user_effects: Iterable[Effect] = (),
        dt: float = DT_S,
    ) -> None:
        if paths is None and from_above(dataset.channels):
            paths = PLANAR_PATHS
        self.effects = tuple(dict.fromkeys((FREQUENCY_SCALE, *effects)))
        series = SeriesProblem(dataset, fish, run_ids, paths, self.effects, tuple(user_effects), dt)
        # What swims alone needs no rows moved, and its last samples count too.
        self.series = series.with_runs([run.as_recorded() for run in series.runs])
        self.known, self.baseline = self.series.known, self.series.baseline
        ratios = {run: ratio for run, (ratio, _) in by_run(beats_of(dataset)).items()}
        own = self.neutral([FREQUENCY_SCALE])[SCALE]
        self.usual = float(np.mean(list(ratios.values()))) if ratios else own
        self.own = tuple(
            own_numbers(run, self.channels, ratios.get(run.id, self.usual)) for run in self.runs
        )
        self.starts: tuple[FloatArray, ...] | None = None
        self.pace: float | None = None
        self._shown: dict[EffectParameterId, bool] = {SCALE: True}
        self._white: dict[SimulationNoise, list[list[FloatArray]]] = {}

    @property
    def fish(self) -> FishParams:
        """Nominal parameters."""
        return self.series.fish

    @property
    def dataset(self) -> Dataset:
        """Measured runs."""
        return self.series.dataset

    @property
    def runs(self) -> tuple[RunData, ...]:
        """Runs, as the simulation reads them."""
        return self.series.runs

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that are compared."""
        return self.series.channels

    @property
    def longest_step(self) -> float:
        """Longest RK4 step (s)."""
        return self.series.longest_step

    @property
    def longest_run(self) -> float:
        """Length of the longest run (s)."""
        return self.series.longest_run

    @property
    def run_count(self) -> int:
        """Number of runs."""
        return len(self.runs)

    @property
    def run_ids(self) -> tuple[str, ...]:
        """Ids of the runs."""
        return self.series.run_ids

    def some(self, runs: Sequence[int]) -> WholeRunProblem:
        """The same problem on some of its runs."""
        other = self._on(self.series.some(runs))
        other.own = tuple(self.own[i] for i in runs)
        other.starts = None if self.starts is None else tuple(self.starts[i] for i in runs)
        return other

    def until(self, end_s: float) -> WholeRunProblem:
        """The same problem on the beginnings of its runs."""
        return self._on(self.series.until(end_s))

    def started(self, starts: Sequence[FloatArray] | None) -> WholeRunProblem:
        """The same problem with other own numbers (K,) of each run; None: unknown."""
        other = copy(self)
        other.starts = None if starts is None else tuple(starts)
        return other

    def at_pace(self, pace: float) -> WholeRunProblem:
        """The same problem with the tail frequency over that of the model held in all runs."""
        other = self.started(None)
        other.pace = pace
        return other

    def _on(self, series: SeriesProblem) -> WholeRunProblem:
        other = copy(self)
        other.series, other._white = series, {}
        return other

    def _sizes(self) -> list[int]:
        """Residuals of each run."""
        pairs = zip(self.runs, self.own, strict=True)
        return [run.measured.size + len(own.names) for run, own in pairs]

    def groups(self) -> tuple[IntArray, FloatArray]:
        """(D,) run of each residual, and (D,) its time in the run (s)."""
        times = []
        for run, own in zip(self.runs, self.own, strict=True):
            times += [np.repeat(run.clock, len(self.channels)), np.zeros(len(own.names))]
        return np.repeat(np.arange(self.run_count), self._sizes()), np.concatenate(times)

    def clusters(self) -> IntArray:
        """(D,) number of the condition of each residual: repeats are wrong alike."""
        names = [run.condition or f"run {run.id}" for run in self.runs]
        numbers = np.unique(names, return_inverse=True)[1]
        return np.asarray(np.repeat(numbers, self._sizes()), np.int64)

    @property
    def measured(self) -> BoolArray:
        """(D,) whether a residual belongs to a value that was measured."""
        parts = []
        for run, own in zip(self.runs, self.own, strict=True):
            parts += [np.isfinite(run.measured).ravel(), np.zeros(len(own.names), bool)]
        return np.concatenate(parts)

    def residual_channels(self) -> tuple[tuple[str, ...], IntArray]:
        """Names of the channels and ``start``, and (D,) which of them each residual is of."""
        count, parts = len(self.channels), []
        for run, own in zip(self.runs, self.own, strict=True):
            parts += [np.tile(np.arange(count), len(run.clock)), np.full(len(own.names), count)]
        return (*self.channels, "start"), np.concatenate(parts)

    def neutral(self, names: Iterable[str]) -> dict[EffectParameterId, float]:
        """Values of effects as the fish's file has them, neutral where it says nothing."""
        return self.series.neutral(names)

    def beginning(self, names: Iterable[str]) -> dict[EffectParameterId, float]:
        """Values of effects that estimates can begin from: the frequency is that of the swaying."""
        values = super().beginning(names)
        return {**values, SCALE: self.usual} if SCALE in values else values

    def scale_at(self, point: Point) -> float:
        """``frequency_scale`` of a point."""
        return float(point.effects.get(SCALE, self.neutral([FREQUENCY_SCALE])[SCALE]))

    def freedoms(self, names: Iterable[str]) -> tuple[EffectFreedom, ...]:
        """Free parameters of effects; those that the runs do not show stay as they are."""
        return tuple(
            EffectFreedom(f.id, f.lower, f.upper, EFFECT_STEP * f.step, f.least)
            for f in self.series.freedoms(names)
            if self._is_shown(f.id)
        )

    def _is_shown(self, id: EffectParameterId) -> bool:
        """Whether the runs show an effect parameter, tried at a middling size."""
        if id not in self._shown:
            parameters = self.known[id.effect].parameters
            values = {EffectParameterId(id.effect, p.name): middling(p) for p in parameters}
            shown = shown_parameters(self, values)
            self._shown |= {one: one in shown for one in values}
        return self._shown[id]

    def is_nonsmooth(self, names: Iterable[str]) -> bool:
        """Whether one of these effects makes the tail's rate jump."""
        return self.series.is_nonsmooth(names)

    def batch_key(self, names: Iterable[str]) -> object:
        """Stages of the quickest kernel for these effects."""
        return self.series.batch_key((*names, FREQUENCY_SCALE))

    def default_noise(self) -> SimulationNoise:
        """A centimetre and 0.05 rad, with fifteen independent samples a run."""
        return first_noise(self.channels)

    def starts_known(self, further: Iterable[str] = ()) -> bool:
        """Whether the own numbers of every run are near their estimates."""
        return self.starts is not None

    def settled(
        self, point: Point, noise: SimulationNoise, nearby: bool = False
    ) -> WholeRunProblem:
        """The same problem with the likeliest own numbers of every run (see the protocol)."""
        if self.starts is not None:
            return self
        return self.started(likeliest(self, point, noise))

    def errors(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        own: Sequence[FloatArray],
        runs: Sequence[int] | None = None,
        pushes: Pushes | None = None,
    ) -> list[FloatArray]:
        """Measured less simulated (N, T, C) of each run, SI, NaN where nothing was measured.

        Args:
            z: (n, N) coefficients in units of their prior.
            effects: effect parameter -> (N,).
            own: of each of these runs, (K, N) own numbers.
            runs: which runs; default: all.
            pushes: a prescribed wrench for each point.
        """
        chosen = range(self.run_count) if runs is None else runs
        series = self.series if runs is None else self.series.some(runs)
        kinds = [self.own[i] for i in chosen]
        return simulation_errors(series, z, effects, kinds, own, SCALE, pushes)

    def whitened(
        self, errors: FloatArray, own: FloatArray, noise: SimulationNoise, run: int
    ) -> FloatArray:
        """Residuals (N, D_r) of a run.

        Args:
            errors: (N, T, C) measured less simulated, SI.
            own: (K, N) own numbers.
            noise: noise model.
            run: which run.
        """
        if noise not in self._white:
            self._white = {noise: [noise.whitening(r, self.channels) for r in self.runs]}
        kind, filled = self.own[run], np.nan_to_num(errors)
        rows = np.stack(
            [filled[:, :, i] @ white.T for i, white in enumerate(self._white[noise][run])], axis=2
        )
        prior = (own - kind.centre[:, None]) * kind.precision[:, None]
        if self.pace is not None:
            prior[kind.names.index(PACE)] = 0.0
        return np.column_stack([rows.reshape(len(rows), -1), prior.T])

    def filtered(
        self, point: Point, noise: SimulationNoise, near: Sequence[RunEvaluation] = ()
    ) -> list[RunEvaluation]:
        """Simulate every run at one point, with its own numbers where they suit the point.

        Args:
            point: values of the parameters.
            noise: noise model.
            near: evaluation at a point close by, whose own numbers are begun from.
        """
        starts = [e.own for e in near] if near else self.settled(point, noise).starts
        assert starts is not None
        fits = fit_own_numbers(self, point, noise, starts, steps=MORE_STEPS)
        return [self._evaluated(i, found, noise) for i, found in enumerate(fits)]

    def _evaluated(self, run: int, found: OwnFit, noise: SimulationNoise) -> RunEvaluation:
        counted = noise.counted(self.runs[run])
        value = -0.5 * found.residuals @ found.residuals - counted @ np.log(noise.sd)
        errors = np.where(np.isfinite(self.runs[run].measured), found.errors, np.nan)
        return RunEvaluation(found.own, errors, found.residuals, found.basis, float(value))

    def innovations(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: SimulationNoise,
        filtered: Sequence[RunEvaluation],
        pushes: Pushes | None = None,
    ) -> FloatArray:
        """Whitened errors (N, D) of many points, less what the runs' own numbers can follow.

        Args:
            z: (n, N) coefficients in units of their prior.
            effects: effect parameter -> (N,).
            noise: noise model.
            filtered: evaluation whose own numbers and directions are held.
            pushes: a prescribed wrench for each point.
        """
        own = [np.repeat(e.own[:, None], z.shape[1], axis=1) for e in filtered]
        parts = []
        errors = self.errors(z, effects, own, pushes=pushes)
        for i, (e, mine, each) in enumerate(zip(filtered, own, errors, strict=True)):
            rows = self.whitened(each, mine, noise, i)
            parts.append(rows - (rows @ e.basis) @ e.basis.T)
        return np.concatenate(parts, axis=1)

    def changes(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: SimulationNoise,
        filtered: Sequence[RunEvaluation],
        pushes: Pushes | None = None,
    ) -> FloatArray:
        """What :meth:`innovations` change from the first point to each other (N - 1, D)."""
        rows = self.innovations(z, effects, noise, filtered, pushes)
        rows[1:] -= rows[0]
        return rows[1:]

    def fitted_noise(
        self,
        point: Point,
        noise: SimulationNoise,
        final: bool,
        filtered: Sequence[RunEvaluation],
        leverage: Callable[[], FloatArray],
    ) -> SimulationNoise:
        """Errors of each channel of largest likelihood, by the freedom that the fit left them."""
        channel = self.residual_channels()[1]
        followed = leverage() + np.concatenate([np.sum(e.basis**2, axis=1) for e in filtered])
        lost = np.asarray(np.bincount(channel, followed, len(self.channels) + 1), float)
        errors = [e.errors for e in filtered]
        return fitted_errors(noise, self.runs, errors, lost, self.series.sensor_sd, final)

    def noise_freedom(self, fit: Any) -> float:
        """Independent samples, less what the fit and the runs' own numbers follow."""
        counted = sum(float(fit.noise.counted(run).sum()) for run in self.runs)
        own = sum(float(np.sum(e.basis**2)) for e in fit.filtered)
        return max(counted - own - float(fit.leverage.sum()), 1.0)

    def generic_terms(self, fit: Any) -> GenericTerms:
        """Forces and moments that depend on the simulated motion, the beat or the commands."""
        own = [e.own for e in fit.filtered]
        return forces_of(fit, self.series, self.own, own, SCALE)
