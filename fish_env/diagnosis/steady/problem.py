"""What is to be explained, the model that should, and its freedom."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy

import numpy as np
import numpy.typing as npt

from fish_env.diagnosis.steady.means import SENSED
from fish_env.diagnosis.steady.orbit import FREQUENCY, PHASE, OrbitFinder, Orbits, Swimmer
from fish_env.diagnosis.steady.table import IntArray, Table
from fish_env.effects.extended import PREFIX, build_model
from fish_env.effects.registry import catalogue
from fish_env.identification.applied_wrench import EFFECT as APPLIED_WRENCH
from fish_env.identification.filtering import Measurement
from fish_env.identification.parameters import Baseline, effects_of, measurement_of
from fish_env.identification.problem import Point, neutral_values
from fish_env.params.schema import FishParams

FloatArray = npt.NDArray[np.float64]
DT_S = 0.01
SLOWEST = 0.1
"""Share of a beat; a tail that is slower, or lost, gets the commanded time and is not steady."""


class SteadyProblem:
    """A table of steady motion and a fish.

    Args:
        table: measured averages.
        fish: nominal parameters and priors.
        paths: free coefficients; default: all with a prior.
        dt: longest physics step, s.
    """

    def __init__(
        self,
        table: Table,
        fish: FishParams,
        paths: Sequence[str] | None = None,
        dt: float = DT_S,
    ) -> None:
        self.table, self.fish, self.dt = table, fish, dt
        self.known = dict(catalogue())
        self.model = build_model(fish, user_effects=(APPLIED_WRENCH,), whole_catalogue=True)
        self.baseline = Baseline(fish, paths)
        self.swimmer = Swimmer(self.model, dt)

    def on(self, conditions: IntArray) -> SteadyProblem:
        """The same problem with some of the conditions."""
        return self.with_table(self.table.some(conditions))

    def with_table(self, table: Table) -> SteadyProblem:
        """The same problem with other measurements."""
        other = copy(self)
        other.table = table
        return other

    def neutral(self, names: Iterable[str]) -> dict[str, float]:
        """Values of effects as the fish's file has them, neutral where it says nothing."""
        return neutral_values(self.model, self.known, names)

    @property
    def start(self) -> Point:
        """Nominal coefficients."""
        return Point(np.zeros(len(self.baseline)), {})

    def orbits(self, points: Sequence[Point], near: Orbits | None = None) -> Orbits:
        """Steady motion of every point under every condition, points one after another.

        Args:
            points: P of them.
            near: steady motion of one point nearly like them, C fish.
        """
        finder = self.finder(points)
        count = len(self.table.commands)
        start = near.take(np.tile(np.arange(count), len(points))) if near is not None else None
        return finder.find(start)

    def finder(self, points: Sequence[Point]) -> OrbitFinder:
        """Finder of the steady motion of every point under every condition."""
        count, lanes = len(self.table.commands), len(points)
        records, measurement = self._lanes(points)
        each = np.repeat(np.arange(lanes), count)
        commands = np.tile(self.table.commands, (lanes, 1))
        finder = OrbitFinder(
            self.swimmer,
            commands,
            np.ascontiguousarray(records[:, each]),
            Measurement(
                measurement.pace[each],
                measurement.delay[each],
                np.ascontiguousarray(measurement.gain[:, each]),
                np.ascontiguousarray(measurement.bias[:, each]),
            ),
            np.ones(len(each)),
        )
        if any(point.effects for point in points):
            finder.pace = _pace(finder)
        return finder

    def means(self, orbits: Orbits) -> FloatArray:
        """Averages in the table's order, shape (points, C, K), NaN where motion is not steady."""
        count = len(self.table.commands)
        values = np.column_stack([orbits.means[name] for name in self.table.observations])
        values[~orbits.found] = np.nan
        return values.reshape(-1, count, len(self.table.observations))

    def _lanes(self, points: Sequence[Point]) -> tuple[FloatArray, Measurement]:
        """Parameter records (parameters, P), and what sensors do, of each point."""
        z = np.column_stack([point.z for point in points])
        effects = _stacked(points, self)
        changes: dict[str, FloatArray] = dict(
            zip(self.baseline.paths, self.baseline.values(z), strict=True)
        )
        names = effects_of(effects)
        known = {**self.known, APPLIED_WRENCH.name: APPLIED_WRENCH}
        moving = {n for n in names if known[n].acts_on_motion}
        changes |= {p: v for p, v in effects.items() if p.split(".")[1] in moving}
        sensing = [known[n] for n in sorted(names - moving)]
        own = [e for e in self.model.measurement if e.name not in names]
        measurement = measurement_of(self.model, [*own, *sensing], effects, SENSED, len(points))
        return self.model.records(changes), measurement


def _stacked(points: Sequence[Point], problem: SteadyProblem) -> dict[str, FloatArray]:
    """Effect parameter -> values by point; neutral where a point does not have the effect."""
    paths = list(dict.fromkeys(path for point in points for path in point.effects))
    wrench = {f"{PREFIX}{APPLIED_WRENCH.name}.{p.name}": 0.0 for p in APPLIED_WRENCH.parameters}
    names = {path.split(".")[1] for path in paths} - {APPLIED_WRENCH.name}
    neutral: Mapping[str, float] = {**problem.neutral(names), **wrench}
    return {p: np.array([point.effects.get(p, neutral[p]) for point in points]) for p in paths}


def _pace(finder: OrbitFinder) -> FloatArray:
    """Beats swum in the time of a commanded one: effects may slow the tail."""
    everyone = np.arange(len(finder.commands))
    states = finder.from_rest(everyone, 1)
    after, _ = finder.beat(states, everyone)
    turns = (after[PHASE] - states[PHASE]) / (2.0 * np.pi)
    beating = (finder.commands[:, FREQUENCY] > 0.0) & (turns > SLOWEST)
    return np.where(beating, np.round(turns, 12), 1.0)
