"""Why repeats differ: sensor noise, and pushes of the water that slow fish feel more.

A random push of no memory moves the averages of a recording by an amount that the linearised beat
gives: x' = A x + B w, y = C x + D w, averaged over the recording. So three kinds of numbers say how
far every average may be off: one sensor noise for each observation, one strength of the forces and
one of the moments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_discrete_lyapunov
from scipy.optimize import minimize

from fish_env.diagnosis.steady.orbit import (
    COORDINATES,
    FREQUENCY,
    NUDGES,
    Orbits,
    coordinates,
    with_coordinates,
)
from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.diagnosis.steady.table import Table
from fish_env.effects.extended import PREFIX
from fish_env.identification.applied_wrench import EFFECT as APPLIED_WRENCH
from fish_env.identification.problem import Point

FloatArray = npt.NDArray[np.float64]
RECORDING_S = 10.0
"""Assumed length of the recordings behind the averages; the strength of the pushes scales with
it, so only its size against the fish's memory matters."""
WRENCH = np.r_[1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6]
"""N and N m. Small wrenches for finite differences."""
SMALLEST = 1e-3
"""Share of an observation's spread below which its noise is not believed."""


@dataclass(frozen=True, eq=False)
class Response:
    """What a beat under each condition does with small disturbances.

    Attributes:
        a: (C, 8, 8) coordinates after a beat, by coordinates before.
        b: (C, 8, m) coordinates after, by what was changed: a wrench held during the beat.
        c: (C, K, 8) averages, by coordinates before.
        d: (C, K, m) averages, by what was changed.
        period: (C,) s.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray
    period: FloatArray

    def held(self) -> FloatArray:
        """Change of the averages when the change stays for ever, shape (C, K, m)."""
        moved = np.linalg.solve(np.eye(COORDINATES) - self.a, self.b)
        return np.asarray(self.c @ moved + self.d)


def response(problem: SteadyProblem, point: Point, orbits: Orbits) -> Response:
    """Linearise a beat about the steady motion of a point."""
    paths = [f"{PREFIX}{APPLIED_WRENCH.name}.{p.name}" for p in APPLIED_WRENCH.parameters]
    pushed = [
        Point(point.z, {**point.effects, path: size})
        for path, size in zip(paths, WRENCH, strict=True)
    ]
    return linearised(problem, point, orbits, pushed, WRENCH)


def linear_changes(
    problem: SteadyProblem, point: Point, orbits: Orbits, others: Sequence[Point]
) -> FloatArray:
    """Change of the averages from a point to others close to it, shape (others, C, K)."""
    if not others:
        return np.zeros((0, *problem.means(orbits)[0].shape))
    known = linearised(problem, point, orbits, others, np.ones(len(others)))
    return np.moveaxis(known.held(), 2, 0)


def linearised(
    problem: SteadyProblem,
    point: Point,
    orbits: Orbits,
    others: Sequence[Point],
    sizes: FloatArray,
) -> Response:
    """What a beat does with small changes of its start, and with others' numbers instead."""
    count, names = len(problem.table.commands), problem.table.observations
    points = [point] * (COORDINATES + 1) + list(others)
    finder = problem.finder(points)
    base = coordinates(orbits.states)
    starts = np.repeat(base[:, None], len(points), axis=1)
    starts[:, 1 : COORDINATES + 1] += np.diag(NUDGES)[:, :, None]
    states = with_coordinates(
        np.tile(orbits.states, (1, len(points))), starts.reshape(COORDINATES, -1)
    )
    after, means = finder.beat(states, np.arange(len(points) * count))
    reached = coordinates(after).reshape(COORDINATES, len(points), count)
    averages = np.stack([means[name] for name in names]).reshape(len(names), len(points), count)
    steps = np.r_[NUDGES, sizes][:, None]
    state_slopes = np.moveaxis((reached[:, 1:] - reached[:, :1]) / steps, 2, 0)
    mean_slopes = np.moveaxis((averages[:, 1:] - averages[:, :1]) / steps, 2, 0)
    frequency = problem.table.commands[:, FREQUENCY]
    period = 1.0 / np.where(frequency > 0.0, frequency, 1.0)
    n = COORDINATES
    return Response(
        state_slopes[:, :, :n], state_slopes[:, :, n:], mean_slopes[:, :, :n],
        mean_slopes[:, :, n:], period,
    )  # fmt: skip


def push_variances(known: Response) -> FloatArray:
    """Variance of averages for forces and for moments of unit strength, shape (2, C, K).

    Strength: N^2 s and (N m)^2 s, the spectral density of the pushes at low frequency.
    """
    out = np.empty((2, len(known.a), known.c.shape[1]))
    for i, period in enumerate(known.period):
        beats = max(1, round(RECORDING_S / float(period)))
        for kind in range(2):
            strength = np.zeros(6)
            strength[3 * kind : 3 * kind + 3] = 1.0 / period
            out[kind, i] = _variance_of_mean(
                known.a[i], known.b[i], known.c[i], known.d[i], strength, beats
            )
    return out


def _variance_of_mean(
    a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, q: FloatArray, beats: int
) -> FloatArray:
    state = solve_discrete_lyapunov(a, (b * q) @ b.T)
    own = np.einsum("ki,ij,kj->k", c, state, c) + (d**2) @ q
    lagged = a @ state @ c.T + (b * q) @ d.T
    total = beats * own
    for lag in range(1, beats):
        total += 2.0 * (beats - lag) * np.einsum("ki,ik->k", c, lagged)
        lagged = a @ lagged
    return np.asarray(np.maximum(total / beats**2, 0.0))


@dataclass(frozen=True, eq=False)
class Scatter:
    """How far a single average is off by chance.

    Attributes:
        sensor_sd: by observation, shape (K,).
        force: strength of random forces, N^2 s.
        moment: strength of random moments, (N m)^2 s.
        sd: one sigma of each average, shape (C, K).
        assumed: neither repeats nor declared noise say how large it is.
    """

    sensor_sd: FloatArray
    force: float
    moment: float
    sd: FloatArray
    assumed: bool

    def on(self, pushes: FloatArray) -> Scatter:
        """The same noise under other conditions, whose unit variances (2, C, K) are given."""
        return scatter_of(self.sensor_sd, self.force, self.moment, pushes, self.assumed)


def scatter_of(
    sensor_sd: FloatArray, force: float, moment: float, pushes: FloatArray, assumed: bool
) -> Scatter:
    """Combine sensors and pushes."""
    variance = sensor_sd**2 + force * pushes[0] + moment * pushes[1]
    return Scatter(sensor_sd, force, moment, np.sqrt(variance), assumed)


def first_guess(table: Table) -> FloatArray:
    """Noise before any fit: declared, from repeats, or a tenth of the spread; shape (K,)."""
    spread = np.maximum(np.nanstd(table.values, axis=0), 1e-9)
    pooled = repeat_sd(table)
    guess = np.where(np.isfinite(pooled), pooled, 0.1 * spread)
    guess = np.where(np.isfinite(table.declared), np.fmax(table.declared, guess), guess)
    return np.asarray(np.maximum(guess, SMALLEST * spread))


def repeat_sd(table: Table) -> FloatArray:
    """Pooled standard deviation within conditions, shape (K,), NaN without repeats."""
    squares = np.zeros(len(table.observations))
    freedom = np.zeros(len(table.observations))
    for deviations, weights in within(table):
        squares += np.nansum(deviations**2, axis=0)
        freedom += weights
    return np.where(freedom > 0, np.sqrt(squares / np.maximum(freedom, 1.0)), np.nan)


def within(table: Table) -> list[tuple[FloatArray, FloatArray]]:
    """Deviations (rows, K) from their condition's mean, and freedom (K,), of each condition."""
    found = []
    for i in range(len(table.conditions)):
        rows = table.values[table.condition_of == i]
        counts = np.isfinite(rows).sum(axis=0)
        if np.any(counts > 1):
            usable = np.where(counts > 1, rows, np.nan)
            middle = np.nansum(usable, axis=0) / np.maximum(counts, 1)
            found.append((usable - middle, np.maximum(counts - 1.0, 0.0)))
    return found


def estimate_scatter(
    table: Table, squares: FloatArray, freedom: FloatArray, pushes: FloatArray
) -> Scatter:
    """Likeliest noise of residuals.

    Args:
        table: measured averages.
        squares: sum of squared residuals of each condition and observation, shape (C, K).
        freedom: how many free numbers each is a sum of, shape (C, K).
        pushes: variance of averages for unit strengths, shape (2, C, K).
    """
    fixed = np.isfinite(table.declared)
    spread = np.maximum(np.nanstd(table.values, axis=0), 1e-9)
    guess = first_guess(table)
    weight = np.maximum(table.counts, 1e-9)
    typical = [float(np.sum(weight * p) / np.sum(weight * guess**2)) for p in pushes]
    start = np.r_[np.log(guess[~fixed]), -np.log(np.maximum(typical, 1e-30)) - 2.0]
    floor = np.log(SMALLEST * spread)

    def parts(x: FloatArray) -> tuple[FloatArray, float, float]:
        sensor = table.declared.copy()
        sensor[~fixed] = np.exp(np.maximum(x[:-2], floor[~fixed]))
        return sensor, float(np.exp(x[-2])), float(np.exp(x[-1]))

    def cost(x: FloatArray) -> float:
        sensor, force, moment = parts(x)
        variance = sensor**2 + force * pushes[0] + moment * pushes[1]
        fit = float(np.sum(freedom * np.log(variance) + squares / variance))
        # Very weak, so that a strength or noise that the data do not need stays finite.
        return fit + 0.05 * float(np.sum((x - start) ** 2))

    found = minimize(cost, start, method="L-BFGS-B", bounds=[(s - 14.0, s + 8.0) for s in start])
    assumed = table.repeats == 0 and not fixed.all()
    return scatter_of(*parts(found.x), pushes, assumed)
