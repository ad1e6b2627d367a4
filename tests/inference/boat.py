"""A planar boat with rudder and propeller: surge, sway and yaw, simulated in lanes by RK4.

Source: Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, chapter 6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

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

    surge_drag: FloatArray | float
    sway_drag: FloatArray | float
    yaw_drag: FloatArray | float
    thrust: FloatArray | float
    rudder_lift: FloatArray | float
    rudder_offset: FloatArray | float
    walk_lever: FloatArray | float
    north: FloatArray | float
    east: FloatArray | float


def record_of(values: Values) -> Record:
    """Coefficients and effect parameters, (N,) or numbers, as the simulation reads them."""
    return Record(*(values[id] for id in PARAMETERS))


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


def rates(
    state: FloatArray, rudder: FloatArray, propeller: FloatArray, p: Record, push: FloatArray
) -> FloatArray:
    """Derivative of the state (R, 6, N): north, east, heading, surge, sway, yaw rate.

    Args:
        state: velocities are relative to the water, in body axes (x ahead, y to starboard).
        rudder: (R, 1) commanded angle (rad).
        propeller: (R, 1) revolutions per second.
        p: coefficients and effect parameters.
        push: (R, 3, N) force and moment of other origin.
    """
    _, _, heading, u, v, r = state.transpose(1, 0, 2)
    cos, sin = np.cos(heading), np.sin(heading)
    thrust = p.thrust * propeller * np.abs(propeller)
    angle = np.sin(rudder + p.rudder_offset)
    side = -p.rudder_lift * u * (u * angle + v + STERN * r)
    surge = thrust - p.surge_drag * np.abs(u) * u + SWAY * v * r + push[:, 0]
    sway = side - p.sway_drag * v - SURGE * u * r + push[:, 1]
    walk = p.walk_lever * thrust
    yaw = STERN * side - p.yaw_drag * r + (SURGE - SWAY) * u * v + walk + push[:, 2]
    north = cos * u - sin * v + p.north
    east = sin * u + cos * v + p.east
    return np.stack([north, east, r, surge / SURGE, sway / SWAY, yaw / YAW], axis=1)


def step(
    state: FloatArray, rudder: FloatArray, propeller: FloatArray, p: Record, push: FloatArray,
    dt: float,
) -> FloatArray:  # fmt: skip
    """One RK4 step (s) with commands and push held."""
    given = (rudder, propeller, p, push)
    a = rates(state, *given)
    b = rates(state + 0.5 * dt * a, *given)
    c = rates(state + 0.5 * dt * b, *given)
    d = rates(state + dt * c, *given)
    return state + dt / 6.0 * (a + 2.0 * b + 2.0 * c + d)


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
    p = record_of({**NEUTRAL, **drawn, **coefficients, **effects})
    state = np.zeros((runs, 6, 1))
    state[:, 2, 0] = rng.uniform(-np.pi, np.pi, runs)
    state[:, 3, 0] = 0.0 if drifting else 1.2
    kicks = np.array([0.02, 0.02, 0.01]) * np.sqrt(0.25)
    states = [state]
    for k in range(1, len(clock)):
        now = (rudder[:, [k - 1]], propeller[:, [k - 1]])
        state = step(state, *now, p, foreign(state), 0.25)
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
