"""Averages of steady motion as a problem: fish, conditions, what is free, what is noise."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import fdtrc

from fish_env.arrays import FloatArray, IntArray
from fish_env.effects.extended import build_model
from fish_env.effects.registry import catalogue
from fish_env.errors import DatasetError
from fish_env.identification.applied_wrench import EFFECT as APPLIED_WRENCH
from fish_env.identification.parameters import ALIKE, Baseline, changes_of, neutral_values
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.tables.means import MEANS, SENSED
from fish_env.identification.tables.orbit import (
    COORDINATES,
    FREQUENCY,
    PHASE,
    OrbitFinder,
    Orbits,
    Swimmer,
    coordinates,
    joined,
)
from fish_env.identification.tables.scatter import (
    Response,
    Scatter,
    estimate_scatter,
    push_variances,
    small_scatter,
)
from fish_env.identification.tables.table import Table
from fish_env.identification.tables.wrenches import HeldWrenches
from fish_env.inference.evaluation import LackOfFit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point, Problem
from fish_env.model.effect import Effect
from fish_env.params.schema import FishParams

DT_S = 0.01
WRENCH = np.r_[1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6]
"""N and N m. Small wrenches for finite differences."""
PLACE_AND_TIME = 1e-9


@dataclass(frozen=True, eq=False)
class Steady:
    """Evaluation of one condition at a point.

    Attributes:
        log_likelihood: of its averages, without the constant.
        residuals: (D_c,) what its averages miss, whitened.
        orbit: its steady motion.
    """

    log_likelihood: float
    residuals: FloatArray
    orbit: Orbits


class TableProblem(Problem):
    """A table of steady motion, the model that should explain it, and its freedom.

    A condition stands for a run.

    Args:
        table: measured averages.
        fish: nominal parameters and priors.
        paths: free coefficients; default: all with a prior.
        user_effects: effects of the caller's own.
        dt: longest physics step, s.
    """

    known: dict[str, Effect]
    interchangeable = ALIKE

    def __init__(
        self,
        table: Table,
        fish: FishParams,
        paths: Sequence[str] | None = None,
        user_effects: Iterable[Effect] = (),
        dt: float = DT_S,
    ) -> None:
        self.table, self.fish = table, fish
        own = tuple(user_effects)
        self.known = {**catalogue(), **{e.name: e for e in own}}
        self.model = build_model(fish, user_effects=(*own, APPLIED_WRENCH), whole_catalogue=True)
        self.baseline = Baseline(fish, paths)
        self.dt = dt = dt / self.model.substeps(dt)
        self._swimmer = Swimmer(self.model, dt)

    def on(self, conditions: IntArray) -> TableProblem:
        """The same problem with some of the conditions."""
        return self.with_table(self.table.some(conditions))

    @property
    def run_ids(self) -> tuple[str, ...]:
        """Names of the conditions."""
        return tuple(self.table.conditions)

    def some(self, runs: Sequence[int]) -> TableProblem:
        """The same problem with some of the conditions."""
        return self.on(np.array(runs, np.int64))

    def with_table(self, table: Table) -> TableProblem:
        """The same problem with other measurements."""
        other = copy(self)
        other.table = table
        return other

    def neutral(self, names: Iterable[str]) -> dict[EffectParameterId, float]:
        """Values of effects as the fish's file has them, neutral where it says nothing."""
        return neutral_values(self.model, self.known, names)

    @property
    def longest_step(self) -> float:
        """Longest physics step (s)."""
        return self.dt

    @property
    def longest_run(self) -> float:
        """None of a table's averages says when within a run: no length (s)."""
        return 0.0

    @property
    def run_count(self) -> int:
        """Number of conditions."""
        return len(self.table.conditions)

    @property
    def noise_is_of_runs(self) -> bool:
        """Yes: scatter is how far the average of a whole condition is off."""
        return True

    def groups(self) -> tuple[IntArray, FloatArray]:
        """(D,) condition of each measured average, and no time."""
        condition = self.table.lines[2]
        return condition, np.zeros(len(condition))

    def residual_channels(self) -> tuple[tuple[str, ...], IntArray]:
        """Names of the observations, and which of them each measured average is (D,)."""
        return self.table.observations, self.table.lines[1]

    def spread(self, count: int) -> list[int]:
        """All conditions: each asks for a beat, and few of them say little."""
        return list(range(self.run_count))

    def subset(self, count: int) -> TableProblem:
        """All conditions (see :meth:`spread`)."""
        return self

    def default_noise(self) -> Scatter:
        """Noise from repeats and declarations, without random pushes."""
        return small_scatter(self.table)

    def noise_freedom(self, fit: Any) -> float:
        """The measured averages, less what the fit follows of them."""
        return float(np.sum(1.0 - fit.leverage))

    def filtered(self, point: Point, noise: Scatter, near: Sequence[Steady] = ()) -> list[Steady]:
        """Steady motion under every condition at one point, and how well it meets the averages."""
        orbits = self.orbits(point, near)
        missed = self.missed(self.means(orbits), noise)[0]
        _, column, condition = self.table.lines
        each = -0.5 * missed**2 - np.log(noise.sd[condition, column])
        total = np.where(orbits.found, np.bincount(condition, each, self.run_count), -np.inf)
        return [
            Steady(value, missed[condition == i], orbits.take(np.array([i])))
            for i, value in enumerate(total.tolist())
        ]

    def orbits(self, point: Point, near: Sequence[Steady] = ()) -> Orbits:
        """Steady motion of a point under every condition, with derivatives of its own."""
        finder = self._finder(*_lane(point))
        return finder.find(joined([s.orbit for s in near]) if near else None, afresh=True)

    def innovations(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: Scatter,
        filtered: Sequence[Steady],
    ) -> FloatArray:
        """What the averages miss (N, D) at many points, in standard deviations of the noise.

        NaN where motion is not steady. Motion is looked for near that of the first point, that of
        the first near the evaluation's. Where the first has none, the others are not asked.
        """
        known = joined([s.orbit for s in filtered])
        first = self._finder(z[:, :1], {id: own[:1] for id, own in effects.items()})
        centre = first.find(known, afresh=True)
        means, count = [self.means(centre)], z.shape[1] - 1
        if count:
            others = self._finder(z[:, 1:], {id: own[1:] for id, own in effects.items()})
            found = others.find(centre.take(np.tile(np.arange(self.run_count), count)), alike=True)
            means.append(self.means(found))
        return self.missed(np.concatenate(means), noise)

    def means(self, orbits: Orbits) -> FloatArray:
        """Averages in the table's order, shape (points, C, K), NaN where motion is not steady."""
        rows = [MEANS.index(name) for name in self.table.observations]
        values = np.where(orbits.found, orbits.means[rows], np.nan)
        return np.asarray(values.T.reshape(-1, self.run_count, len(rows)))

    def whitened(self, values: FloatArray, noise: Scatter) -> FloatArray:
        """Averages (..., C, K) as whitened lines of the table, (..., D)."""
        _, column, condition = self.table.lines
        return np.asarray(values[..., condition, column] / noise.sd[condition, column])

    def missed(self, means: FloatArray, noise: Scatter) -> FloatArray:
        """Measured less simulated averages (..., C, K), whitened, (..., D)."""
        row, column, condition = self.table.lines
        measured = self.table.values[row, column] / noise.sd[condition, column]
        return np.asarray(measured - self.whitened(means, noise))

    def fitted_noise(
        self,
        point: Point,
        noise: Scatter,
        final: bool,
        filtered: Sequence[Steady],
        leverage: Callable[[], FloatArray],
    ) -> Scatter:
        """Noise that the residuals show, each counted by the freedom that the fit left it."""
        orbits = joined([s.orbit for s in filtered])
        _, column, condition = self.table.lines
        cell = condition, column
        squares, freedom = np.zeros(noise.sd.shape), np.zeros(noise.sd.shape)
        missed = self.missed(self.means(orbits), noise)[0] * noise.sd[cell]
        np.add.at(squares, cell, missed**2)
        np.add.at(freedom, cell, 1.0 - leverage())
        pushes = push_variances(self.response(point, orbits))
        return estimate_scatter(self.table, squares, freedom, pushes)

    def noise_of(self, fit: Any) -> Scatter:
        """Noise of a fit to other conditions under those of this table."""
        noise: Scatter = fit.noise
        known = self.response(fit.point, self.orbits(fit.point))
        return noise.on(push_variances(known))

    def response(self, point: Point, orbits: Orbits) -> Response:
        """What a beat about the steady motion of a point does with small disturbances."""
        rows = [COORDINATES + MEANS.index(name) for name in self.table.observations]
        sizes = np.column_stack([np.zeros(6), np.diag(WRENCH)])
        pushed = {
            EffectParameterId(APPLIED_WRENCH.name, p.name): size
            for p, size in zip(APPLIED_WRENCH.parameters, sizes, strict=True)
        }
        one = {id: np.full(7, value) for id, value in point.effects.items()}
        finder = self._finder(np.tile(point.z[:, None], (1, 7)), {**one, **pushed})
        after, means = finder.beat(np.tile(orbits.states, (1, 7)), np.arange(7 * self.run_count))
        seen = np.concatenate([coordinates(after), means]).reshape(-1, 7, self.run_count)
        by_wrench = np.moveaxis((seen[:, 1:] - seen[:, :1]) / WRENCH[None, :, None], 2, 0)
        frequency = self.table.commands[:, FREQUENCY]
        period = 1.0 / np.where(frequency > 0.0, frequency, 1.0)
        states, n = orbits.slopes, COORDINATES
        return Response(
            states[:, :n], by_wrench[:, :n], states[:, rows], by_wrench[:, rows], period
        )

    def generic_terms(self, fit: Any) -> HeldWrenches:
        """Forces and moments that depend on the commands."""
        orbits = joined([s.orbit for s in fit.filtered])
        changed = self.response(fit.point, orbits).held()

        def respond(wrench: FloatArray) -> FloatArray:
            return -self.whitened(np.einsum("ckm,mcn->nck", changed, wrench), fit.noise)

        return HeldWrenches(self.table.commands, respond)

    def lack_of_fit(self, fit: Any) -> LackOfFit | None:
        """Mean square of what conditions miss over that of repeats; None with few repeats."""
        table, lin = self.table, fit.linearised
        if table.repeats < IDENTIFICATION.fewest_repeats:
            return None
        _, column, condition = table.lines
        cell = condition * len(table.observations) + column
        counts = np.bincount(cell)
        mean = np.bincount(cell, lin.residuals) / np.maximum(counts, 1)
        between = float(np.sum(counts * mean**2))
        within = float(np.sum((lin.residuals - mean[cell]) ** 2))
        freedom = float((counts > 0).sum() - fit.leverage.sum())
        if freedom < 1.0:
            return None
        ratio = (between / freedom) / (within / table.repeats)
        return LackOfFit(ratio, float(fdtrc(freedom, table.repeats, ratio)))

    def untold(
        self, point: Point, noise: Scatter, settings: Mapping[str, Mapping[str, float]]
    ) -> set[str]:
        """Effects that these averages can tell nothing of.

        Of some the forces depend on where, on what heading, or when the fish swims: a table says
        none of these, and such a motion does not repeat with every beat. Others, such as delays,
        leave averages as they are.

        Args:
            point: values of the parameters.
            noise: noise model.
            settings: effect -> values at which it acts.
        """
        neutral = {**self.neutral(settings), **point.effects}
        effects = {id: np.full(1 + len(settings), value) for id, value in neutral.items()}
        for i, (name, own) in enumerate(settings.items(), start=1):
            for key, value in own.items():
                effects[EffectParameterId(name, key)][i] = value
        z = np.tile(point.z[:, None], (1, 1 + len(settings)))
        near = self.filtered(point, noise)
        changes = np.abs(self.changes(z, effects, noise, near)).max(axis=1)
        finder = self._finder(z, effects)
        states = np.tile(joined([s.orbit for s in near]).states, (1, z.shape[1]))
        everyone = np.arange(states.shape[1])
        here, _ = finder.beat(states, everyone)
        there, _ = finder.beat(states, everyone, elsewhere=True)
        apart = np.abs(coordinates(here) - coordinates(there)).max(axis=0)
        moved = apart.reshape(z.shape[1], self.run_count).max(axis=1)[1:]
        silent = (moved > PLACE_AND_TIME) | (changes < IDENTIFICATION.untold_change)
        return {name for name, none in zip(settings, silent, strict=True) if none}

    def not_steady(self) -> DatasetError:
        """What to tell the user when the fish of the table does not come to steady motion."""
        found = self.orbits(self.start).found
        lost = self.table.conditions[int(np.argmin(found))]
        return DatasetError(
            f"{self.table.name}: {self.fish.name} does not come to steady motion under the "
            f"commands of condition '{lost}'; check that fish, units and frame are those of the "
            "data, or leave the condition out"
        )

    def _finder(
        self, z: FloatArray, effects: Mapping[EffectParameterId, FloatArray]
    ) -> OrbitFinder:
        """Finder of steady motion of N points (n, N) under every condition, points in turn."""
        known = {**self.known, APPLIED_WRENCH.name: APPLIED_WRENCH}
        changes, seen = changes_of(self.model, known, self.baseline, z, effects, SENSED)
        each = np.repeat(np.arange(z.shape[1]), self.run_count)
        measurement = seen.take(each)
        records = np.ascontiguousarray(self.model.records(changes)[:, each])
        commands = np.tile(self.table.commands, (z.shape[1], 1))
        finder = OrbitFinder(self._swimmer, commands, records, measurement, np.ones(len(each)))
        if effects:
            finder.pace = _pace(finder)
        return finder


def _lane(point: Point) -> tuple[FloatArray, dict[EffectParameterId, FloatArray]]:
    """A point as the only one of a batch."""
    return point.z[:, None], {id: np.array([value]) for id, value in point.effects.items()}


def _pace(finder: OrbitFinder) -> FloatArray:
    """Beats swum in the time of a commanded one: effects may slow the tail.

    A tail that is lost gets the commanded time and is not steady.
    """
    everyone = np.arange(len(finder.commands))
    states = finder.from_rest(everyone, 1)
    after, _ = finder.beat(states, everyone)
    turns = (after[PHASE] - states[PHASE]) / (2.0 * np.pi)
    beating = (finder.commands[:, FREQUENCY] > 0.0) & (turns > IDENTIFICATION.slowest_steady_tail)
    return np.where(beating, np.round(turns, 12), 1.0)
