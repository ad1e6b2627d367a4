"""The boat's runs as a problem: one-step innovations of an extended Kalman filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point, Problem
from fish_env.inference.vehicle import Coefficients
from tests.inference.boat import (
    CHANNELS,
    COEFFICIENTS,
    EFFECTS,
    NEUTRAL,
    SENSOR_SD,
    Runs,
    step,
    table_of,
)

SEEN = list(CHANNELS)
SMALL = 1e-4
"""Step of the differences that linearise the motion."""
SWAY_SD = 0.3
"""Of the sway at the start, which no channel shows (m/s)."""
LEAST, MOST = 1e-4, 0.2
"""Disturbances that are plausible."""
FACTORS = (2.0, 1.3, 1.1)


@dataclass(frozen=True)
class BoatNoise:
    """White accelerations.

    Attributes:
        linear: of surge and sway (m/s per square root of a second).
        yaw: rad/s per square root of a second.
    """

    linear: float
    yaw: float

    def is_close(self, other: BoatNoise, share: float) -> bool:
        """Whether another one differs by less than a share of this one."""
        pairs = ((self.linear, other.linear), (self.yaw, other.yaw))
        return all(abs(b - a) < share * a for a, b in pairs)


@dataclass(frozen=True, eq=False)
class Filtered:
    """One run filtered: residuals (D,), states (T, 6), gains (T, 6, 5), whitening (T, 5, 5)."""

    log_likelihood: float
    residuals: FloatArray
    states: FloatArray
    gains: FloatArray
    whitening: FloatArray


class BoatProblem(Problem):
    """Runs of a boat; its coefficients and its disturbance are free."""

    known = {effect.name: effect for effect in EFFECTS}  # noqa: RUF012

    def __init__(self, runs: Runs) -> None:
        self.runs = runs
        columns = zip(*COEFFICIENTS.values(), strict=True)
        mean, share, units = (np.array(column) for column in columns)
        bounds = np.full(len(mean), 1e-3), np.full(len(mean), np.inf)
        variances = np.diag((mean * share) ** 2)
        self.baseline = Coefficients(COEFFICIENTS, mean, variances, bounds, units.tolist())

    @property
    def longest_step(self) -> float:
        """s."""
        return float(self.runs.clock[1])

    @property
    def longest_run(self) -> float:
        """s."""
        return float(self.runs.clock[-1])

    @property
    def run_count(self) -> int:
        """Number of runs."""
        return len(self.runs.measured)

    def groups(self) -> tuple[IntArray, FloatArray]:
        """Run of each residual, and its time (s); the first sample starts the filter."""
        time = np.repeat(self.runs.clock[1:], len(SEEN))
        return np.repeat(np.arange(self.run_count), len(time)), np.tile(time, self.run_count)

    def some(self, runs: Sequence[int]) -> BoatProblem:
        """The same problem on some of its runs."""
        other = copy(self)
        other.runs = self.runs.some(list(runs))
        return other

    def default_noise(self) -> BoatNoise:
        """A small disturbance."""
        return BoatNoise(0.01, 0.01)

    def disturbance_at_limit(self, noise: BoatNoise) -> tuple[str, ...]:
        """A disturbance as large as is plausible."""
        return ("a disturbance at its limit",) if max(noise.linear, noise.yaw) >= MOST else ()

    def fitted_noise(
        self, point: Point, noise: BoatNoise, final: bool, filtered: Any, leverage: Any
    ) -> BoatNoise:
        """The likeliest of a grid around the present one, each finer than the last."""
        few = self.subset(3)
        for factor in FACTORS:
            for _ in range(8):
                sizes = [
                    np.clip([n * factor**-1, n, n * factor], LEAST, MOST)
                    for n in (noise.linear, noise.yaw)
                ]
                tried = [BoatNoise(float(a), float(b)) for a, b in product(*sizes)]
                each = few._filter(point, tried)
                values = [sum(f.log_likelihood for f in own) for own in each]
                best = tried[int(np.argmax(values))]
                if best == noise:
                    break
                noise = best
        return noise

    def filtered(
        self, point: Point, noise: BoatNoise, near: Sequence[Filtered] = ()
    ) -> Sequence[Filtered]:
        """Extended Kalman filter of every run."""
        return self._filter(point, [noise])[0]

    def _filter(self, point: Point, noises: Sequence[BoatNoise]) -> list[list[Filtered]]:
        """All runs under each of some noise models at once, as if they were more runs."""
        count, runs = self.run_count, self.runs
        many = runs.some(list(range(count)) * len(noises))
        table = self._table(point.z[:, None], {k: np.array([v]) for k, v in point.effects.items()})
        dt = self.longest_step
        kicks = [[0.0, 0.0, 0.0, n.linear, n.linear, n.yaw] for n in noises for _ in range(count)]
        added = dt * np.einsum("ri,ij->rij", np.square(kicks), np.eye(6))
        state, covariance = self._start(many)
        nudged = np.concatenate([np.zeros((6, 1)), SMALL * np.eye(6)], axis=1)
        push = np.zeros((len(kicks), 3, 1))
        states, gains, whitening, errors = [state], [], [], []
        for k in range(1, len(runs.clock)):
            given = (many.rudder[:, k - 1], many.propeller[:, k - 1])
            moved = step(state[:, :, None] + nudged, *given, table, push, dt)
            slope = (moved[:, :, 1:] - moved[:, :, [0]]) / SMALL
            covariance = slope @ covariance @ slope.transpose(0, 2, 1) + added
            shown = covariance[:, :, SEEN]
            root = np.linalg.cholesky(shown[:, SEEN] + np.diag(SENSOR_SD**2))
            whiten = np.linalg.inv(root)
            gain = shown @ whiten.transpose(0, 2, 1) @ whiten
            error = many.measured[:, k] - moved[:, SEEN, 0]
            state = moved[:, :, 0] + np.einsum("rij,rj->ri", gain, error)
            covariance = covariance - gain @ shown.transpose(0, 2, 1)
            states.append(state)
            gains.append(gain)
            whitening.append(whiten)
            errors.append(np.einsum("rij,rj->ri", whiten, error))
        per_run = [np.array(a).swapaxes(0, 1) for a in (errors, states, gains, whitening)]
        found = [_run(*own) for own in zip(*per_run, strict=True)]
        return [found[i : i + count] for i in range(0, len(found), count)]

    def innovations(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: BoatNoise,
        filtered: Sequence[Filtered],
        push: FloatArray | None = None,
    ) -> FloatArray:
        """Whitened residuals (N, D) with the gains of a filter, under a push (T, R, 3, N)."""
        runs, table, dt = self.runs, self._table(z, effects), self.longest_step
        gains = np.array([f.gains for f in filtered])
        whitening = np.array([f.whitening for f in filtered])
        state = np.repeat(self._start(runs)[0][:, :, None], z.shape[1], axis=2)
        none = np.zeros((self.run_count, 3, 1))
        residuals = np.empty((z.shape[1], self.run_count, len(runs.clock) - 1, len(SEEN)))
        for k in range(1, len(runs.clock)):
            given = (runs.rudder[:, k - 1], runs.propeller[:, k - 1])
            moved = step(state, *given, table, none if push is None else push[k - 1], dt)
            error = runs.measured[:, k, :, None] - moved[:, SEEN]
            residuals[:, :, k - 1] = (whitening[:, k - 1] @ error).transpose(2, 0, 1)
            state = moved + gains[:, k - 1] @ error
        return residuals.reshape(len(residuals), -1)

    def _table(self, z: FloatArray, effects: Mapping[EffectParameterId, FloatArray]) -> FloatArray:
        coefficients = zip(self.baseline.ids, self.baseline.values(z), strict=True)
        return table_of({**NEUTRAL, **dict(coefficients), **effects})

    def _start(self, runs: Runs) -> tuple[FloatArray, FloatArray]:
        """State (R, 6) as first measured, and its covariance (R, 6, 6)."""
        state = np.zeros((len(runs.measured), 6))
        state[:, SEEN] = runs.measured[:, 0]
        variance = np.full(6, SWAY_SD**2)
        variance[SEEN] = SENSOR_SD**2
        return state, np.repeat(np.diag(variance)[None], len(state), axis=0)

    def generic_terms(self, fit: Any) -> BoatForces:
        """Forces and moments that depend on motion, heading, time or commands."""
        return BoatForces(self, fit)


def _run(
    errors: FloatArray, states: FloatArray, gains: FloatArray, whitening: FloatArray
) -> Filtered:
    determinant = np.log(np.einsum("tii->ti", whitening)).sum()
    residuals = errors.ravel()
    likelihood = float(determinant - 0.5 * residuals @ residuals)
    return Filtered(likelihood, residuals, states, gains, whitening)


class BoatForces:
    """One simple function of the motion at a time, as surge force, sway force or yaw moment."""

    DIRECTIONS = ("surge", "sway", "yaw")
    PROBES = (0.1, 0.1, 0.05)
    """Root mean square of a probe (N, N m)."""

    def __init__(self, problem: BoatProblem, fit: Any) -> None:
        self.problem, self.fit = problem, fit
        runs = problem.runs
        states = np.array([f.states for f in fit.filtered]).transpose(2, 0, 1)
        heading, u, v, r = states[2:]
        functions = {
            "constant": np.ones_like(u), "time": np.broadcast_to(runs.clock, u.shape),
            "u": u, "v": v, "r": r, "u|u|": u * np.abs(u), "v|v|": v * np.abs(v),
            "r|r|": r * np.abs(r), "cos(heading)": np.cos(heading), "sin(heading)": np.sin(heading),
            "rudder": runs.rudder, "propeller": runs.propeller,
        }  # fmt: skip
        self.functions = {
            name: values / np.sqrt(np.mean(values**2))
            for name, values in functions.items()
            if values.any()
        }
        self.columns = np.arange(3 * len(self.functions))

    def words(self, column: int) -> tuple[str, str]:
        """Function and direction."""
        return list(self.functions)[column // 3], self.DIRECTIONS[column % 3]

    def swings(self, column: int) -> bool:
        """No term does: a propeller's thrust is that of its commands."""
        return False

    def unit(self, column: int) -> float:
        """Root mean square of the probe."""
        return self.PROBES[column % 3]

    def changes(self, columns: IntArray) -> FloatArray:
        """What probes change in the residuals, (D, N)."""
        fit, lanes = self.fit, len(columns) + 1
        clock, runs = len(self.problem.runs.clock), self.problem.run_count
        push = np.zeros((clock, runs, 3, lanes))
        values = list(self.functions.values())
        for lane, column in enumerate(columns.tolist(), start=1):
            push[:, :, column % 3, lane] = self.unit(column) * values[column // 3].T
        z = np.repeat(fit.point.z[:, None], lanes, axis=1)
        effects = {id: np.full(lanes, value) for id, value in fit.point.effects.items()}
        rows = self.problem.innovations(z, effects, fit.noise, fit.filtered, push)
        return np.asarray((rows[1:] - rows[0]).T)
