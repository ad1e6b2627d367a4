"""What each cause would change in the averages, seen through a refit of the baseline.

A cause's signal is projected on what the free coefficients, held by their priors, cannot follow.
The rest decides how detectable it is, how alike two causes are, and how much misfit it explains.
The threshold holds for the largest statistic of all causes at once: it is read off a parametric
bootstrap, in which the noise, too, has to be estimated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.special import log_ndtr, ndtri

from fish_env.diagnosis.causes import (
    Cause,
    Probe,
    best_of_each,
    effect_values,
    of_visible,
    probes_of,
)
from fish_env.diagnosis.projection import Projected
from fish_env.diagnosis.steady.fitting import SteadyFit, lines
from fish_env.diagnosis.steady.orbit import coordinates
from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.diagnosis.tails import POWER, chi2_log_tail, noncentrality
from fish_env.effects.extended import PREFIX
from fish_env.identification.problem import Point
from fish_env.model.effect import Effect

FloatArray = npt.NDArray[np.float64]
DRAWS = 4000
LEVEL = 0.02
"""Share of tables without an effect in which some cause passes the threshold."""
LEAST_INFORMATION = 1e-3
"""A probe whose projected signal is smaller than this many noise standard deviations squared
cannot be told from rounding."""
PLACE_AND_TIME = 1e-9


@dataclass(frozen=True, eq=False)
class Signal(Projected):
    """A cause at one of its alternatives, in averages: its residuals are the lines and the priors.

    Attributes:
        one_sided: the only setting cannot be negative.
    """

    one_sided: bool

    @property
    def statistic(self) -> float:
        """Likelihood ratio of the linearised fit."""
        if self.one_sided and self.score[0] <= 0.0:
            return 0.0
        return self.likelihood_ratio

    @property
    def log_p(self) -> float:
        """Of this one test, noise known."""
        return float(log_p(self.statistic, self.freedom, self.one_sided))


def log_p(statistic: npt.ArrayLike, freedom: int, one_sided: bool) -> FloatArray:
    """Log p-value of a likelihood ratio."""
    values = np.asarray(statistic, float)
    if one_sided:
        return np.where(values > 0.0, log_ndtr(-np.sqrt(values)), 0.0)
    return chi2_log_tail(values, freedom)


@dataclass(frozen=True, eq=False)
class Screen:
    """All causes against one fit.

    Attributes:
        signals: every cause at every alternative that shows.
        threshold: log p-value that the smallest falls below by chance at the level.
    """

    signals: tuple[Signal, ...]
    threshold: float

    def best(self) -> list[Signal]:
        """The best alternative of each cause, most significant first."""
        return best_of_each(self.signals, lambda signal: signal.log_p)


class Projector:
    """Removes from changes of the lines what a refit would follow."""

    def __init__(self, fit: SteadyFit) -> None:
        self.basis, triangle = np.linalg.qr(fit.slopes)
        strong = np.abs(np.diag(triangle)) > 1e-9
        self.basis = self.basis[:, strong]
        self.residuals = fit.residuals
        self.freedom = len(fit.residuals) - int(strong.sum())

    def left(self, columns: FloatArray) -> FloatArray:
        """What a refit leaves of columns (N, m)."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))

    def signal(
        self, cause: Cause, probe: int, columns: FloatArray, one_sided: bool
    ) -> Signal | None:
        """Project a cause; None where nothing of it is left."""
        left = self.left(columns)
        projected = left.T @ left
        energy = float(np.einsum("ij,ij->", columns, columns))
        if np.any(np.diag(projected) < LEAST_INFORMATION):
            return None
        projected += 1e-9 * np.diag(np.diag(projected))
        score = left.T @ self.residuals
        return Signal(cause, probe, left, energy, projected, score, one_sided)


def causes_of(problem: SteadyProblem) -> tuple[Cause, ...]:
    """Every cause that averages of steady motion can show, at least in principle."""
    effects = [
        Cause(effect.name, probes_of(effect, problem.dt))
        for effect in problem.known.values()
        if effect.acts_on_motion or effect.measure or effect.sample_time
    ]
    coefficients = [Cause(f"parameter:{p}", path=p) for p in problem.baseline.paths]
    return (*effects, *coefficients)


def needs_place_or_time(fit: SteadyFit, names: Sequence[str]) -> set[str]:
    """Effects whose forces depend on where, on what heading, or when the fish swims.

    A table of averages says none of these, and such a motion does not repeat with every beat.
    """
    problem = fit.problem
    probes = [probes_of(problem.known[name], problem.dt)[-1] for name in names]
    points = [
        _with(fit.point, _together(problem, name, probe))
        for name, probe in zip(names, probes, strict=True)
    ]
    finder = problem.finder(points)
    count = len(problem.table.commands)
    states = np.tile(fit.orbits.states, (1, len(points)))
    everyone = np.arange(len(points) * count)
    here, _ = finder.beat(states, everyone)
    there, _ = finder.beat(states, everyone, elsewhere=True)
    change = np.abs(coordinates(here) - coordinates(there)).max(axis=0)
    change = change.reshape(len(points), count).max(axis=1)
    return {name for name, moved in zip(names, change, strict=True) if moved > PLACE_AND_TIME}


def _together(problem: SteadyProblem, name: str, probe: Sequence[Probe]) -> dict[str, float]:
    """All settings of an alternative at once."""
    neutral = problem.known[name].neutral
    values = dict(neutral)
    for setting in probe:
        values |= {key: value for key, value in setting.items() if value != neutral[key]}
    return {f"{PREFIX}{name}.{key}": value for key, value in values.items()}


def _with(point: Point, effects: dict[str, float]) -> Point:
    return Point(point.z, {**point.effects, **effects})


def screen(fit: SteadyFit, causes: Sequence[Cause], rng: np.random.Generator) -> Screen:
    """Test every cause against a fit; those already in it are left out."""
    projector = Projector(fit)
    taken = {*fit.effects, *fit.released}
    tested = [c for c in causes if c.name not in taken and c.path not in taken]
    signals = (
        *_effect_signals(fit, projector, [c for c in tested if c.is_effect]),
        *_coefficient_signals(fit, projector, [c for c in tested if not c.is_effect]),
    )
    return Screen(signals, null_threshold(signals, projector.freedom, rng, LEVEL))


def _effect_signals(fit: SteadyFit, projector: Projector, causes: Sequence[Cause]) -> list[Signal]:
    problem = fit.problem
    jobs = [
        (cause, index, probe)
        for cause in causes
        for index, alternative in enumerate(cause.probes)
        for probe in alternative
    ]
    if not jobs:
        return []
    points = [_with(fit.point, effect_values(problem, c.name, p)) for c, _, p in jobs]
    means = problem.means(problem.orbits(points, fit.orbits))
    change = lines(problem, means - fit.means, fit.scatter)
    columns = np.zeros((len(fit.residuals), len(jobs)))
    columns[: change.shape[1]] = change.T
    groups: dict[tuple[str, int], list[int]] = {}
    for i, (cause, index, _) in enumerate(jobs):
        groups.setdefault((cause.name, index), []).append(i)
    found = []
    for (name, index), chosen in groups.items():
        if np.isfinite(columns[:, chosen]).all():
            sided = len(chosen) == 1 and one_sided(problem.known[name])
            test = partial(projector.signal, one_sided=sided)
            case = jobs[chosen[0]][0], index, columns[:, chosen]
            found.append(test(*case) or of_visible(test, *case))
    return [signal for signal in found if signal is not None]


def one_sided(effect: Effect) -> bool:
    """Whether its switching parameter can leave the neutral value one way only."""
    only = effect.switching
    return len(only) == 1 and (only[0].lower >= only[0].neutral or only[0].upper <= only[0].neutral)


def _coefficient_signals(
    fit: SteadyFit, projector: Projector, causes: Sequence[Cause]
) -> list[Signal]:
    """Lifting the prior of one coefficient: a change of the line that holds it."""
    first = len(fit.residuals) - len(fit.problem.baseline)
    found = []
    for cause in causes:
        column = np.zeros((len(fit.residuals), 1))
        column[first + fit.problem.baseline.paths.index(cause.path or "")] = 1.0
        signal = projector.signal(cause, -1, column, False)
        if signal is not None and signal.projected[0, 0] > 0.05:
            found.append(signal)
    return found


def null_threshold(
    signals: Sequence[Signal], freedom: int, rng: np.random.Generator, level: float
) -> float:
    """Log p-value below which the smallest of all falls by chance with probability ``level``.

    Args:
        signals: tests that are made together.
        freedom: of the residuals, from which the size of the noise is estimated.
        rng: draws residuals as white noise.
        level: family-wise error rate.
    """
    if not signals:
        return -np.inf
    noise = rng.standard_normal((len(signals[0].left), DRAWS))
    size = rng.chisquare(freedom, DRAWS) / freedom
    smallest = np.zeros(DRAWS)
    for signal in signals:
        score = signal.left.T @ noise
        statistic = np.einsum("ij,ij->j", score, np.linalg.solve(signal.projected, score))
        if signal.one_sided:
            statistic = np.where(score[0] > 0.0, statistic, 0.0)
        smallest = np.minimum(smallest, log_p(statistic / size, signal.freedom, signal.one_sided))
    return float(np.quantile(smallest, level))


def smallest_detectable(signal: Signal, setting: int, threshold: float) -> float:
    """Multiple of one probed setting that would be found with power 0.8."""
    information = max(float(signal.projected[setting, setting]), 1e-12)
    if signal.one_sided:
        return float((ndtri(POWER) - ndtri(np.exp(threshold))) / np.sqrt(information))
    target = noncentrality(threshold, signal.freedom, POWER)
    return float(np.sqrt(target / information))


def confusability(a: Signal, b: Signal) -> float:
    """Largest cosine between what two causes leave after a refit (0 to 1)."""
    cosines = np.linalg.svd(np.linalg.qr(a.left)[0].T @ np.linalg.qr(b.left)[0], compute_uv=False)
    return float(cosines[0])
