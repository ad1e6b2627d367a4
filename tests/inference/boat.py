"""A planar boat with rudder and propeller: surge, sway and yaw, simulated in lanes by RK4.

Source: Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, chapter 6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numba
import numpy as np

from fish_env.arrays import FloatArray
from fish_env.inference.effects import DeclaredEffect, EffectParameter
from fish_env.inference.hypotheses import Coefficient, EffectParameterId, ParameterId

Values = Mapping[ParameterId, FloatArray | float]
SURGE, SWAY, YAW, STERN = 32.0, 50.0, 8.0, -0.7
"""Mass with added mass (kg), moment of inertia (kg m^2), place of the rudder (m)."""
COEFFICIENTS = {
    "surge_drag": (12.0, 0.15, "kg/m"),
    "sway_drag": (120.0, 0.15, "N s/m"),
    "yaw_drag": (12.0, 0.15, "N m s"),
    "thrust": (0.5, 0.1, "N s^2"),
    "rudder_lift": (30.0, 0.15, "N s^2/m^2"),
}
"""Nominal value, relative prior standard deviation, unit."""
EFFECTS = (
    DeclaredEffect(
        "rudder_bias",
        (EffectParameter("offset", "rad", 0.0, -0.6, 0.6, (-0.1, 0.1), "true less commanded"),),
        confusable_with=("propeller_walk",),
    ),
    DeclaredEffect(
        "propeller_walk",
        (EffectParameter("lever", "m", 0.0, -0.5, 0.5, (-0.1, 0.1), "yaw moment over thrust"),),
        confusable_with=("rudder_bias",),
    ),
    DeclaredEffect(
        "current",
        (
            EffectParameter("north", "m/s", 0.0, -2.0, 2.0, (-0.5, 0.5), "of the water"),
            EffectParameter("east", "m/s", 0.0, -2.0, 2.0, (-0.5, 0.5), "of the water"),
        ),
    ),
)
SURGE_DRAG, SWAY_DRAG, YAW_DRAG, THRUST, RUDDER_LIFT = map(Coefficient, COEFFICIENTS)
RUDDER_BIAS = EffectParameterId("rudder_bias", "offset")
PROPELLER_WALK = EffectParameterId("propeller_walk", "lever")
NORTH, EAST = (EffectParameterId("current", name) for name in ("north", "east"))
PARAMETERS = (
    SURGE_DRAG, SWAY_DRAG, YAW_DRAG, THRUST, RUDDER_LIFT, RUDDER_BIAS, PROPELLER_WALK, NORTH, EAST,
)  # fmt: skip
NEUTRAL = {EffectParameterId(e.name, n): v for e in EFFECTS for n, v in e.neutral.items()}
CHANNELS = (0, 1, 2, 3, 5)
"""North and east (m), heading (rad), speed through the water (m/s), yaw rate (rad/s)."""
SENSOR_SD = np.array([0.15, 0.15, 0.01, 0.02, 0.01])
Foreign = Callable[[FloatArray], FloatArray]
"""States (R, 6, N) -> forces in surge and sway (N) and moment in yaw (N m), (R, 3, N)."""


class Record(NamedTuple):
    """What the simulation computes with, in the order of :data:`PARAMETERS`."""

    surge_drag: float
    sway_drag: float
    yaw_drag: float
    thrust: float
    rudder_lift: float
    rudder_offset: float
    walk_lever: float
    north: float
    east: float


def table_of(values: Values) -> FloatArray:
    """Coefficients and effect parameters, (N,) or numbers, in the order of a record: (9, N)."""
    rows = np.broadcast_arrays(*(values[id] for id in PARAMETERS))
    return np.array([np.atleast_1d(row) for row in rows], dtype=float)


@dataclass(frozen=True, eq=False)
class Runs:
    """Measured runs of equal length.

    Attributes:
        clock: (T,) s.
        rudder: (R, T) angle (rad), held until the next sample.
        propeller: (R, T) revolutions per second, held too.
        measured: (R, T, 5) channels.
    """

    clock: FloatArray
    rudder: FloatArray
    propeller: FloatArray
    measured: FloatArray

    def some(self, which: list[int]) -> Runs:
        """Some of the runs."""
        own = (self.rudder[which], self.propeller[which], self.measured[which])
        return Runs(self.clock, *own)


@numba.njit(cache=True)
def rates(x, rudder, propeller, p, push, out):
    """Derivative of the state of one boat: north, east, heading, surge, sway, yaw rate.

    Args:
        x: (6,). Velocities are relative to the water, in body axes (x ahead, y to starboard).
        rudder: commanded angle (rad).
        propeller: revolutions per second.
        p: record of coefficients and effect parameters.
        push: (3,) force and moment of other origin.
        out: (6,), written.
    """
    heading, u, v, r = x[2], x[3], x[4], x[5]
    cos, sin = np.cos(heading), np.sin(heading)
    thrust = p.thrust * propeller * abs(propeller)
    angle = np.sin(rudder + p.rudder_offset)
    side = -p.rudder_lift * u * (u * angle + v + STERN * r)
    out[0] = cos * u - sin * v + p.north
    out[1] = sin * u + cos * v + p.east
    out[2] = r
    out[3] = (thrust - p.surge_drag * abs(u) * u + SWAY * v * r + push[0]) / SURGE
    out[4] = (side - p.sway_drag * v - SURGE * u * r + push[1]) / SWAY
    walk = p.walk_lever * thrust
    out[5] = (STERN * side - p.yaw_drag * r + (SURGE - SWAY) * u * v + walk + push[2]) / YAW


@numba.njit(cache=True)
def step(state, rudder, propeller, table, push, dt):
    """One RK4 step (s) of all boats with commands and push held, (R, 6, N).

    Args:
        state: (R, 6, N).
        rudder: (R,) rad.
        propeller: (R,) revolutions per second.
        table: (9, N), or (9, 1) for the same boat in all lanes.
        push: (R, 3, N), or (R, 3, 1).
        dt: s.
    """
    after = np.empty_like(state)
    a, b, c, d, x = np.empty(6), np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    for run in range(len(state)):
        for lane in range(state.shape[2]):
            own = table[:, lane % table.shape[1]]
            p = Record(own[0], own[1], own[2], own[3], own[4], own[5], own[6], own[7], own[8])
            given = (rudder[run], propeller[run], p, push[run, :, lane % push.shape[2]])
            begin = state[run, :, lane]
            rates(begin, *given, a)
            for slope, part, following in ((a, 0.5, b), (b, 0.5, c), (c, 1.0, d)):
                for i in range(6):
                    x[i] = begin[i] + part * dt * slope[i]
                rates(x, *given, following)
            for i in range(6):
                total = a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]
                after[run, i, lane] = begin[i] + dt / 6.0 * total
    return after


def nothing(state: FloatArray) -> FloatArray:
    """No force of other origin."""
    return np.zeros((len(state), 3, state.shape[2]))


def sail(
    rng: np.random.Generator, runs: int, effects: Mapping[EffectParameterId, float] = {},
    foreign: Foreign = nothing, straight: bool = False, drifting: bool = False,
    coefficients: Mapping[Coefficient, float] = {}, duration: float = 30.0,
) -> Runs:  # fmt: skip
    """Measure a boat whose coefficients scatter as their priors say.

    Args:
        rng: draws coefficients, commands and noise.
        runs: number of runs.
        effects: what acts.
        foreign: force that no effect describes.
        straight: whether rudder and propeller stay where they are.
        drifting: whether the propeller stands still.
        coefficients: those of the boat, instead of drawn ones.
        duration: of each run (s).
    """
    clock = np.arange(0.0, duration, 0.25)
    rudder = np.zeros((runs, len(clock))) if straight else _held(rng, runs, clock, 0.35)
    propeller = np.full((runs, len(clock)), 5.5)
    propeller += 0.0 if straight else _held(rng, runs, clock, 2.0)
    propeller *= 0.0 if drifting else 1.0
    drawn = {
        Coefficient(path): mean * (1.0 + sd * rng.standard_normal())
        for path, (mean, sd, _) in COEFFICIENTS.items()
    }
    table = table_of({**NEUTRAL, **drawn, **coefficients, **effects})
    state = np.zeros((runs, 6, 1))
    state[:, 2, 0] = rng.uniform(-np.pi, np.pi, runs)
    state[:, 3, 0] = 0.0 if drifting else 1.2
    kicks = np.array([0.02, 0.02, 0.01]) * np.sqrt(0.25)
    states = [state]
    for k in range(1, len(clock)):
        now = (rudder[:, k - 1], propeller[:, k - 1])
        state = step(state, *now, table, foreign(state), 0.25)
        state[:, 3:, 0] += kicks * rng.standard_normal((runs, 3))
        states.append(state)
    seen = np.array(states)[:, :, CHANNELS, 0].transpose(1, 0, 2)
    noise = SENSOR_SD * rng.standard_normal(seen.shape)
    return Runs(clock, rudder, propeller, seen + noise)


def _held(rng: np.random.Generator, runs: int, clock: FloatArray, size: float) -> FloatArray:
    """Random levels up to a size, each held for 4 s."""
    levels = rng.uniform(-size, size, (runs, int(clock[-1] // 4.0) + 1))
    return np.take(levels, (clock // 4.0).astype(int), axis=1)


def split(runs: Runs, fitted: int) -> tuple[Runs, Runs]:
    """The first runs, and those kept for judging."""
    count = len(runs.measured)
    return runs.some(list(range(fitted))), runs.some(list(range(fitted, count)))


__all__ = ["CHANNELS", "COEFFICIENTS", "EFFECTS", "Runs", "nothing", "replace", "sail", "split"]
