"""Why repeats differ: sensor noise, and pushes of the water that slow fish feel more.

A random push of no memory moves the averages of a recording by an amount that the linearised beat
gives: x' = A x + B w, y = C x + D w, averaged over the recording. So three kinds of numbers say how
far every average may be off: one sensor noise for each observation, one strength of the forces and
one of the moments.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_lyapunov
from scipy.optimize import minimize

from fish_env.arrays import FloatArray
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.tables.orbit import COORDINATES
from fish_env.identification.tables.table import Table

RECORDING_S = 10.0
"""Assumed length of the recordings behind the averages; the strength of the pushes scales with
it, so only its size against the fish's memory matters."""


@dataclass(frozen=True, eq=False)
class Response:
    """What a beat under each condition does with small disturbances.

    Attributes:
        a: (C, 8, 8) coordinates after a beat, by coordinates before.
        b: (C, 8, 6) coordinates after, by a wrench held during the beat.
        c: (C, K, 8) averages, by coordinates before.
        d: (C, K, 6) averages, by the wrench.
        period: (C,) s.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray
    period: FloatArray

    def held(self) -> FloatArray:
        """Change of the averages by a wrench that stays for ever, shape (C, K, 6)."""
        moved = np.linalg.solve(np.eye(COORDINATES) - self.a, self.b)
        return np.asarray(self.c @ moved + self.d)


def push_variances(known: Response) -> FloatArray:
    """Variance of averages for forces and for moments of unit strength, shape (2, C, K).

    Strength: N^2 s and (N m)^2 s, the spectral density of the pushes at low frequency. NaN where
    motion is not steady.
    """
    out = np.full((2, len(known.a), known.c.shape[1]), np.nan)
    steady = np.isfinite(known.a).all(axis=(1, 2)) & np.isfinite(known.b).all(axis=(1, 2))
    for i in np.flatnonzero(steady).tolist():
        period = known.period[i]
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

    def is_close(self, other: Scatter, share: float) -> bool:
        """Whether every average's noise differs by less than a share from another's."""
        return bool(np.all(np.abs(other.sd - self.sd) < share * self.sd))

    def on(self, pushes: FloatArray) -> Scatter:
        """The same noise under other conditions, whose unit variances (2, C, K) are given."""
        return scatter_of(self.sensor_sd, self.force, self.moment, pushes, self.assumed)


def scatter_of(
    sensor_sd: FloatArray, force: float, moment: float, pushes: FloatArray, assumed: bool
) -> Scatter:
    """Combine sensors and pushes."""
    variance = sensor_sd**2 + force * pushes[0] + moment * pushes[1]
    return Scatter(sensor_sd, force, moment, np.sqrt(variance), assumed)


def small_scatter(table: Table) -> Scatter:
    """Noise before any fit: that of the sensors, and no pushes."""
    sensor_sd = first_guess(table)
    assumed = table.repeats == 0 and not np.isfinite(table.declared).all()
    sd = np.tile(sensor_sd, (len(table.conditions), 1))
    return Scatter(sensor_sd, 0.0, 0.0, sd, assumed)


def first_guess(table: Table) -> FloatArray:
    """Noise before any fit: declared, from repeats, or a tenth of the spread; shape (K,)."""
    spread = np.maximum(np.nanstd(table.values, axis=0), 1e-9)
    pooled = repeat_sd(table)
    guess = np.where(np.isfinite(pooled), pooled, 0.1 * spread)
    guess = np.where(np.isfinite(table.declared), np.fmax(table.declared, guess), guess)
    return np.asarray(np.maximum(guess, IDENTIFICATION.least_scatter * spread))


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
    floor = np.log(IDENTIFICATION.least_scatter * spread)

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
