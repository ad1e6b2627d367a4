"""An identification problem: fish, runs, what is free, what is noise."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fish_env.data.schema import Dataset
from fish_env.effects import catalogue
from fish_env.effects.extended import PREFIX, ExtendedModel, build_model
from fish_env.errors import EffectError
from fish_env.identification.applied_wrench import EFFECT as APPLIED_WRENCH
from fish_env.identification.filtering import (
    Filtered,
    Measurement,
    NoiseModel,
    Pushes,
    RunFilter,
)
from fish_env.identification.noise import white_noise_sd
from fish_env.identification.parameters import (
    Baseline,
    EffectFreedom,
    effects_of,
    freedoms,
    measurement_of,
)
from fish_env.identification.runs import RunData, prepare_run, usable_channels
from fish_env.model.effect import STAGES, Effect
from fish_env.params.io import load_fish
from fish_env.params.schema import FishParams

FloatArray = npt.NDArray[np.float64]
KERNELS = (
    frozenset[str](),
    frozenset({"inputs", "tail"}),
    frozenset({"barycentre", "water", "tail_inflow", "tail_force", "body_drag", "wrench"}),
    frozenset(STAGES),
)
"""Stages that are compiled together. An effect costs a little where it is neutral too, so one of
what drives the tail, or of what pushes the fish, is computed without the other kinds: the same
bits, in two thirds of the time."""


@dataclass(frozen=True, eq=False)
class Point:
    """Values of all free parameters.

    Attributes:
        z: (n,) baseline coefficients in units of their prior.
        effects: ``effects.<name>.<parameter>`` -> value, of the effects in play.
    """

    z: FloatArray
    effects: Mapping[str, float]


def neutral_values(
    model: ExtendedModel, known: Mapping[str, Effect], names: Iterable[str]
) -> dict[str, float]:
    """Parameters of effects as the fish's file has them, neutral where it says nothing."""
    values: dict[str, float] = {}
    for name in names:
        own = model.effects.get(name, known[name].neutral)
        values |= {f"{PREFIX}{name}.{p}": v for p, v in own.items()}
    return values


def finite_values(known: Mapping[str, Effect], values: Mapping[str, float]) -> dict[str, float]:
    """Values of effects, with the mildest plausible one where they are infinite.

    No derivative leads away from an infinite rate limit.
    """
    mildest = {
        f"{PREFIX}{name}.{p.name}": p.plausible[1]
        for name in effects_of(values)
        for p in known[name].parameters
    }
    return {path: v if np.isfinite(v) else mildest[path] for path, v in values.items()}


class Problem:
    """Measured runs of a fish, the model that should explain them, and its freedom.

    Args:
        dataset: measured runs.
        fish: parameters; default: the dataset's own fish.
        run_ids: runs to use; default: all.
        paths: free baseline coefficients; default: all with a prior.
        effects: names of effects whose parameters are free.
        user_effects: effects of the caller's own, among ``effects`` or not.
        dt: longest RK4 step (s), but for a moment after each switch of the commands and for
            effects that make the tail's rate jump, which get finer ones.
    """

    def __init__(
        self,
        dataset: Dataset,
        fish: FishParams | None = None,
        run_ids: Sequence[str] | None = None,
        paths: Sequence[str] | None = None,
        effects: Iterable[str] = (),
        user_effects: Iterable[Effect] = (),
        dt: float = 0.01,
    ) -> None:
        self.dataset = dataset
        self.dt = dt
        self.fish = fish or load_fish(dataset.fish)
        self.known = {**catalogue(), **{e.name: e for e in user_effects}}
        own = tuple(effect for effect in self.known.values() if effect.name not in catalogue())
        self.model: ExtendedModel = build_model(
            self.fish, user_effects=(*own, APPLIED_WRENCH), whole_catalogue=True
        )
        self.channels = usable_channels(dataset.channels)
        self.sensor_sd = np.array(
            [dataset.noise.get(n) or white_noise_sd(dataset, n) for n in self.channels]
        )
        chosen = dataset.ids if run_ids is None else tuple(run_ids)
        self.runs = tuple(
            prepare_run(dataset.run(i), self.channels, self.sensor_sd, dt) for i in chosen
        )
        self.baseline = Baseline(self.fish, paths)
        self.effects = tuple(effects)
        self.plain_steps = False
        self._filters: dict[frozenset[str], RunFilter] = {}
        unknown = [name for name in self.effects if name not in self.known]
        if unknown:
            raise EffectError(f"unknown effects {unknown}; known: {', '.join(self.known)}")

    @property
    def lean_filter(self) -> RunFilter:
        """Compiled filter on these runs without effects on the motion."""
        return self._filter_of(KERNELS[0])

    def filter_for(self, effects: Iterable[str]) -> RunFilter:
        """The quickest filter that computes with these effect parameters."""
        return self._filter_of(self.stages_for(effects))

    def stages_for(self, effects: Iterable[str]) -> frozenset[str]:
        """Stages in the quickest kernel that computes with these effect parameters."""
        names = {*effects_of(effects), *self.model.effects}
        hooks = {stage for name in names for stage in self.known[name].hooks}
        return next(stages for stages in KERNELS if hooks <= stages)

    def _filter_of(self, stages: frozenset[str]) -> RunFilter:
        if stages not in self._filters:
            declared = tuple(e for e in self.model.declared if set(e.hooks) <= stages)
            if APPLIED_WRENCH not in declared:
                declared = (*declared, APPLIED_WRENCH)
            model = replace(self.model, declared=declared)
            self._filters[stages] = RunFilter(model, self.runs, self.channels)
        return self._filters[stages]

    def subset(self, count: int) -> Problem:
        """The same problem on at most ``count`` runs, spread over all of them."""
        if len(self.runs) <= count:
            return self
        return self.with_runs([self.runs[i] for i in self.spread(count)])

    def until(self, end_s: float) -> Problem:
        """The same problem on the beginnings of its runs."""
        return self.with_runs([run.until(end_s) for run in self.runs])

    def spread(self, count: int) -> list[int]:
        """Which runs stand for all: at most ``count`` of them, spread over the list."""
        last = len(self.runs) - 1
        return sorted(set(np.linspace(0, last, min(count, last + 1)).round().astype(int).tolist()))

    def with_runs(self, runs: Sequence[RunData]) -> Problem:
        """The same problem on other runs."""
        other = copy(self)
        other.runs = tuple(runs)
        other._filters = {}
        return other

    @property
    def samples(self) -> int:
        """Number of measured values."""
        return int(sum(np.isfinite(run.measured).sum() for run in self.runs))

    @property
    def start(self) -> Point:
        """Nominal coefficients, effects where their estimates begin."""
        return Point(np.zeros(len(self.baseline)), self.beginning(self.effects))

    def beginning(self, names: Iterable[str]) -> dict[str, float]:
        """Values of effects that estimates can begin from."""
        return finite_values(self.known, self.neutral(names))

    def neutral(self, names: Iterable[str]) -> dict[str, float]:
        """Values of effects as the fish's file has them, neutral where it says nothing."""
        return neutral_values(self.model, self.known, names)

    @property
    def longest_step(self) -> float:
        """Longest RK4 step (s) between samples."""
        return max(float(np.max(np.diff(run.clock) / run.substeps[1:])) for run in self.runs)

    def freedoms(self, names: Iterable[str]) -> tuple[EffectFreedom, ...]:
        """Free parameters of effects."""
        step = min(self.dt, self.longest_step)
        return tuple(f for name in names for f in freedoms(self.known[name], step))

    def innovations(
        self,
        z: FloatArray,
        effects: Mapping[str, FloatArray],
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
        count = z.shape[1]
        records, measurement = self._lanes(z, effects, count)
        return self.filter_for(effects).innovations(records, measurement, noise, filtered, pushes)

    def changes(
        self,
        z: FloatArray,
        effects: Mapping[str, FloatArray],
        noise: NoiseModel,
        filtered: Sequence[Filtered],
        pushes: Pushes | None = None,
    ) -> FloatArray:
        """What :meth:`innovations` change from the first point to each other (N - 1, residuals)."""
        rows = self.innovations(z, effects, noise, filtered, pushes)
        rows[1:] -= rows[0]  # in place: fresh memory costs as much as the arithmetic
        return rows[1:]

    def filtered(
        self, point: Point, noise: NoiseModel, keep_slopes: bool = False
    ) -> list[Filtered]:
        """Extended Kalman filter of every run at one point."""
        record, measurement = self.lane(point)
        corners = self.has_corners(point.effects)
        return self.filter_for(point.effects).run(record, measurement, noise, keep_slopes, corners)

    def with_plain_steps(self) -> Problem:
        """The same problem without finer steps for effects that make the tail's rate jump."""
        other = copy(self)
        other.plain_steps = True
        return other

    def with_long_steps(self) -> Problem:
        """The same problem in steps that will do to compare causes, with the same freedoms."""
        return self.with_runs([run.in_long_steps() for run in self.runs])

    def with_finer_steps(self) -> Problem:
        """The same problem in finer steps, to tell what those of motion with corners get wrong."""
        return self.with_runs([run.in_finer_steps() for run in self.runs])

    def has_corners(self, effects: Iterable[str]) -> bool:
        """Whether one of these effect parameters makes the tail's rate jump."""
        names = (*effects_of(effects), *self.model.effects)
        return not self.plain_steps and self.any_jumps(names)

    def any_jumps(self, names: Iterable[str]) -> bool:
        """Whether one of these effects makes the tail's rate jump, whatever the steps."""
        return any(self.known[name].step_error > 0.0 for name in names)

    def lane(self, point: Point) -> tuple[FloatArray, Measurement]:
        """Parameter record (parameters, 1) of a point, and what its sensors do."""
        effects = {path: np.array([value]) for path, value in point.effects.items()}
        return self._lanes(point.z[:, None], effects, 1)

    def _lanes(
        self, z: FloatArray, effects: Mapping[str, FloatArray], count: int
    ) -> tuple[FloatArray, Measurement]:
        """Parameter records (parameters, N) and what the sensors do, for N points."""
        changes: dict[str, FloatArray] = dict(
            zip(self.baseline.paths, self.baseline.values(z), strict=True)
        )
        names = effects_of(effects)
        moving = {n for n in names if self.known[n].acts_on_motion}
        changes |= {
            path: values for path, values in effects.items() if effects_of([path]) <= moving
        }
        sensing = [self.known[n] for n in sorted(names - moving)]
        own = [e for e in self.model.measurement if e.name not in names]
        measurement = measurement_of(self.model, [*own, *sensing], effects, self.channels, count)
        model = self.filter_for(effects).model
        return np.ascontiguousarray(model.records(changes)), measurement
