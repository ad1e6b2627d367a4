"""A problem whose residuals a function states, and fits, signals and effects of no vehicle."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.effects import DeclaredEffect, EffectParameter
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.estimate.free import Free, Linearised
from fish_env.inference.hypotheses import Coefficient, EffectName, EffectParameterId, effects_of
from fish_env.inference.probes import Cause, Probe, probes_of
from fish_env.inference.problem import Point, Problem
from fish_env.inference.projection import Signal
from fish_env.inference.vehicle import Coefficients, Effect

Residuals = Callable[[FloatArray, Mapping[EffectParameterId, float]], FloatArray]
"""Coefficients (n,) and values of effects -> residuals (runs, samples), not finite if diverged."""
SIZE = "size"


@dataclass(frozen=True)
class White:
    """Noise of one size in all residuals."""

    sd: float = 1.0
    relaxed: bool = False

    def is_close(self, other: White, share: float) -> bool:
        return abs(other.sd - self.sd) < share * self.sd


@dataclass(frozen=True)
class Evaluated:
    """One run evaluated."""

    log_likelihood: float
    residuals: FloatArray


@dataclass
class Log:
    """Effects in play where the noise was fitted, and, with how many runs, where slopes were."""

    noise_fitted: list[frozenset[str]] = field(default_factory=list)
    simulated: list[tuple[frozenset[str], int]] = field(default_factory=list)


class Stated(Problem):
    """Residuals as a function states them, in units of white noise.

    ``limit`` is the noise at the end of what is plausible. ``learns`` says whether the noise is
    fitted; it is held otherwise. ``diverging`` tells by the effects and the noise.
    """

    def __init__(
        self,
        residuals: Residuals,
        known: Iterable[Effect] = (),
        paths: Sequence[str] = ("c",),
        learns: bool = False,
        limit: float = np.inf,
        diverging: Callable[
            [Mapping[EffectParameterId, float], White], bool
        ] = lambda effects, noise: False,
        step: float = 0.01,
    ) -> None:
        self.residuals = residuals
        self.known = {effect.name: effect for effect in known}
        self.baseline = coefficients(paths)
        self.learns, self.limit, self.diverging, self.step = learns, limit, diverging, step
        self.log = Log()
        runs, self.samples = self._all(np.zeros(len(paths)), {}).shape
        self.which = list(range(runs))

    def _all(self, z: FloatArray, effects: Mapping[EffectParameterId, float]) -> FloatArray:
        return np.asarray(self.residuals(z, {**self.neutral(self.known), **effects}), float)

    @property
    def longest_step(self) -> float:
        return self.step

    @property
    def longest_run(self) -> float:
        return float(self.samples)

    @property
    def run_count(self) -> int:
        return len(self.which)

    @property
    def run_ids(self) -> tuple[str, ...]:
        return tuple(f"r{i}" for i in self.which)

    def groups(self) -> tuple[IntArray, FloatArray]:
        times = np.arange(float(self.samples))
        return np.repeat(np.arange(self.run_count), len(times)), np.tile(times, self.run_count)

    def some(self, runs: Sequence[int]) -> Stated:
        other = copy(self)
        other.which = [self.which[i] for i in runs]
        return other

    def default_noise(self) -> White:
        return White()

    def fitted_noise(
        self, point: Point, noise: White, final: bool, filtered: Any, leverage: Any
    ) -> White:
        self.log.noise_fitted.append(frozenset(effects_of(point.effects)))
        left = np.concatenate([run.residuals for run in filtered])
        return White(noise.sd * float(np.sqrt(np.mean(left**2)))) if self.learns else noise

    def disturbance_at_limit(self, noise: White) -> tuple[str, ...]:
        return ("a disturbance at its limit",) if noise.sd >= self.limit else ()

    def filtered(self, point: Point, noise: White, near: Any = ()) -> Sequence[Evaluated]:
        rows = self._rows(point.z, point.effects, noise)
        constant = rows.shape[1] * np.log(noise.sd)
        return [Evaluated(float(-0.5 * row @ row - constant), row) for row in rows]

    def innovations(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: White,
        filtered: Any,
    ) -> FloatArray:
        self.log.simulated.append((frozenset(effects_of(effects)), self.run_count))
        lanes = [{id: float(values[i]) for id, values in effects.items()}
                 for i in range(z.shape[1])]  # fmt: skip
        pairs = zip(z.T, lanes, strict=True)
        return np.array([self._rows(one, own, noise).ravel() for one, own in pairs])

    def _rows(
        self, z: FloatArray, effects: Mapping[EffectParameterId, float], noise: White
    ) -> FloatArray:
        rows = self._all(z, effects)[self.which] / noise.sd
        return np.full_like(rows, np.nan) if self.diverging(effects, noise) else rows


class Directions:
    """Generic forces, each along its direction in the residuals (forces, D)."""

    def __init__(self, along: FloatArray) -> None:
        self.along, self.columns = along, np.arange(len(along))

    def words(self, column: int) -> tuple[str, str]:
        return f"direction {column}", "along"

    def swings(self, column: int) -> bool:
        return False

    def unit(self, column: int) -> float:
        return 1.0

    def changes(self, columns: IntArray) -> FloatArray:
        return self.along[columns].T


class Numbered(Stated):
    """A stated problem whose runs have numbers of their own, ``own`` (runs, K), from zero on.

    A subclass sets them before it begins, and says what they leave.
    """

    own: FloatArray

    def __init__(self, known: Iterable[Effect] = ()) -> None:
        super().__init__(self.left, known)

    @abstractmethod
    def left(self, z: FloatArray, effects: Mapping[EffectParameterId, float]) -> FloatArray:
        """What the runs leave, as :data:`Residuals`."""

    @property
    def variation(self) -> FloatArray:
        return self.own[self.which]

    def with_variation(
        self, values: FloatArray, point: Point, noise: Any, near: Any = ()
    ) -> Numbered:
        moved = copy(self)
        moved.own = self.own.copy()
        moved.own[self.which] = values
        moved.residuals = moved.left
        return moved


def coefficients(paths: Sequence[str]) -> Coefficients:
    """Coefficients whose prior is standard normal, and that may be anything."""
    count = len(paths)
    ends = np.full(count, np.inf)
    return Coefficients(paths, np.zeros(count), np.eye(count), (-ends, ends))


def effect(
    name: str, reach: float = 1.0, lower: float = -np.inf, **declared: Any
) -> DeclaredEffect:
    """An effect with one size, off at zero, that may plausibly reach so far either way."""
    size = EffectParameter(SIZE, "-", 0.0, lower, plausible=(max(lower, -reach), reach))
    return DeclaredEffect(name, (size,), **declared)


def size_of(name: str) -> EffectParameterId:
    """The size of such an effect."""
    return EffectParameterId(name, SIZE)


def apart(targets: Mapping[str, Sequence[float]]) -> Residuals:
    """Effects each of which moves a sample of its own in each run, and what they should be there.

    A coefficient that should be zero moves the sample after them. In a run where the target of an
    effect is not a number, it diverges with that effect.
    """
    wanted = np.array(list(targets.values()), float).T

    def residuals(z: FloatArray, effects: Mapping[EffectParameterId, float]) -> FloatArray:
        sizes = np.array([effects[size_of(name)] for name in targets])
        left = np.where((sizes == 0.0) & np.isnan(wanted), 0.0, sizes - wanted)
        return np.column_stack([left, np.full(len(left), z.sum())])

    return residuals


def fit_of(
    problem: Problem,
    effects: Sequence[str] = (),
    released: Sequence[Coefficient] = (),
    point: Point | None = None,
    noise: Any = None,
    linearised: Linearised | None = None,
    **found: Any,
) -> Fit:
    """A fit that was not made: nothing of it counts but what is given."""
    point = point or problem.start
    free = Free(problem, effects, released)
    none = np.zeros(0)
    count = len(free.ids)
    empty = Linearised(none, np.zeros((0, count)), none.astype(np.int64), none)
    values = {
        "ids": free.ids, "estimates": np.zeros(count), "covariance": np.eye(count),
        "log_likelihood": 0.0, "objective": 0.0, "at_bounds": (), "active": np.zeros((0, count)),
        "condition": 1.0, "filtered": (), "linearised": linearised or empty,
    }  # fmt: skip
    return Fit(
        problem, tuple(effects), tuple(released), point, noise or White(), **{**values, **found}
    )


def signal_of(cause: Cause, statistic: float, inflation: float = 1.0) -> Signal:
    """The test of one setting of a cause, with its statistic."""
    score = np.array([np.sqrt(statistic * inflation)])
    probe = 0 if cause.is_effect else -1
    return Signal(cause, probe, np.zeros((1, 1)), 1.0, np.eye(1), score, inflation)


def cause_of(declared: Effect, probes: tuple[tuple[Probe, ...], ...] | None = None) -> Cause:
    """An effect as a cause."""
    return Cause(EffectName(declared.name), probes_of(declared) if probes is None else probes)
