"""The widest randomisation that the environment accepts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any

from fish_env.effects import catalogue
from fish_env.envs.options import env_options
from fish_env.errors import RoboticFishError
from fish_env.params import FishParams, load_fish

Ranges = dict[str, list[float]]
FISH = "zheng-2021-a"
HALVINGS = 60
ENDLESS = {
    "effects.servo_rate_limit.rate": 20.0,
    "effects.tail_flexibility.natural_frequency": 10.0,
}
"""Upper ends where the declared one is infinite; 1 for all others."""
SHORTEST_S = 0.01
"""Of a time constant: the physics step. Shorter ones are legal and divide the step."""
GENTLER: Ranges = {
    "effects.tail_flexibility.natural_frequency": [0.1, 1.0],
    "effects.tail_flexibility.damping_ratio": [0.05, 2.0],
    "effects.body_flexibility.stiffness": [0.01, 1.0],
    "effects.body_flexibility.natural_frequency": [0.5, 4.0],
    "effects.body_flexibility.damping_ratio": [0.05, 1.0],
    "effects.servo_delay.delay": [0.0, 0.15],
    "effects.current.north": [-0.5, 0.5],
    "effects.current.east": [-0.5, 0.5],
    "effects.current.down": [-0.05, 0.05],
    "effects.wave.amplitude": [0.0, 0.5],
    "effects.buoyancy_offset.mass": [-0.03, 0.03],
    "effects.tether.stiffness": [0.0, 2.0],
    "effects.water_ingress.rate": [-0.002, 0.002],
    "effects.hull_compression.rate": [-0.002, 0.002],
}
"""Ends that let a fish swim for some seconds, in steps that are not divided."""
DEEP: dict[str, Any] = {"task": "track", "config": {"tank": {"depth": 20.0}}}
"""A tank in which a fish that sinks takes its time."""
WATER: dict[str, Any] = {
    "task": "track",
    "cruise_speed": (0.0, 0.3),
    "observation_noise": {
        "depth": 0.05, "depth_rate": 0.05, "attitude": 0.2, "heading": 0.5, "velocity": 0.2,
        "rates": 1.0,
    },
    "observation_delay_s": 2.0,
    "action_delay_s": 2.0,
}  # fmt: skip
"""Everything beside the draws: the longest delays, loud sensors."""


@cache
def _fish() -> FishParams:
    return load_fish(FISH)


def accepted(ranges: Ranges) -> bool:
    """Whether the environment takes these draws."""
    try:
        env_options(fish=_fish(), randomization=ranges)
    except RoboticFishError:
        return False
    return True


def bounds() -> Ranges:
    """Each coefficient of the fish and each effect, as far as it may be drawn by itself."""
    fish = _fish()
    ranges = {
        path: [_end(path, value, end, i) for i, end in enumerate(_bounds(fish, path))]
        for path, value in fish.values().items()
    }
    return ranges | dict(_effects())


def swimmable(factor: float = 3.0) -> Ranges:
    """Coefficients of hull and tail that are wrong by a factor, and a trim that sinks or rises.

    Of a fish with the coefficients of :func:`bounds` hardly one swims: within three steps most of
    them tumble or burst, and what is slow or rare is not reached.
    """
    legal, fish = bounds(), _fish()
    ranges = {}
    for path, value in fish.values().items():
        if path.startswith(("tail.", "body.")) and value != 0.0:
            low, high = sorted((value / factor, value * factor))
            ranges[path] = [max(low, legal[path][0]), min(high, legal[path][1])]
    return ranges | {"mass.buoyancy": [1.97, 2.03]}


def with_effects() -> Ranges:
    """The same with every effect to its ends, but for those that divide the step or sink a fish.

    Half the step is left to a surface that the fish pierces, which is as quick at every size.
    """
    return swimmable() | dict(_effects()) | GENTLER


def _bounds(fish: Any, path: str) -> tuple[float, float]:
    known = fish.info(path)
    return known.lower, known.upper


def _end(path: str, value: float, end: float, index: int) -> float:
    """The end of a range that is nearest to a bound and still legal, by halving the way."""
    way = end - value
    for i in range(HALVINGS):
        # The bound itself first: value + way may round to beyond it.
        reached = end if i == 0 else value + way * 0.5**i
        pair = [value, value]
        pair[index] = reached
        if accepted({path: pair}):
            return reached
    return value


def _effects() -> Iterator[tuple[str, list[float]]]:
    for name, effect in catalogue().items():
        if not effect.acts_on_motion:
            continue
        for parameter in effect.parameters:
            path = f"effects.{name}.{parameter.name}"
            low = parameter.lower if math.isfinite(parameter.lower) else -1.0
            high = parameter.upper if math.isfinite(parameter.upper) else ENDLESS.get(path, 1.0)
            if parameter.name == "time_constant":
                low = max(low, SHORTEST_S)
            yield path, [low, high]
