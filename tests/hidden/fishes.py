"""Fish that differ from the parameter file as its own priors allow."""

from __future__ import annotations

import math

import numpy as np

from fish_env.errors import ParameterError
from fish_env.params import FishParams, load_fish

FARTHEST_SD = 2.0
LARGEST_TRIM = math.radians(10.0)


def draw_fish(name: str, rng: np.random.Generator) -> FishParams:
    """A fish within two prior standard deviations, trimmed to within ten degrees of level."""
    nominal = load_fish(name)
    while True:
        fish = nominal.replace(drawn_values(nominal, rng))
        if max(abs(angle) for angle in trim(fish)) < LARGEST_TRIM:
            return fish


def drawn_values(nominal: FishParams, rng: np.random.Generator) -> dict[str, float]:
    """New values by path; the buoyancy keeps to the mass, which the scales see alike."""
    values = {}
    for path, value in nominal.values().items():
        sd = nominal.prior_sd(path)
        if sd > 0.0:
            values[path] = value + sd * truncated(rng)
    values["mass.buoyancy"] += values["mass.total"] - nominal.get("mass.total")
    return values


def truncated(rng: np.random.Generator) -> float:
    """A standard normal number within two standard deviations."""
    while True:
        number = float(rng.standard_normal())
        if abs(number) < FARTHEST_SD:
            return number


def trim(fish: FishParams) -> tuple[float, float]:
    """Pitch and roll at which the fish hangs with the block at rest, rad."""
    value = fish.get
    block = value("mass.weight_block")
    place = [
        value("weight_block.bracket_origin[0]")
        + value("weight_block.d1")
        - value("weight_block.s_w0")
        + value("weight_block.d3"),
        value("weight_block.bracket_origin[1]"),
        value("weight_block.bracket_origin[2]") + value("weight_block.d2"),
    ]
    x, y, z = (value(f"mass.static_moment_rest[{i}]") + block * place[i] for i in range(3))
    return math.atan2(-x, z), math.atan2(y, z)


def move_coefficients(
    fish: FishParams, name: str, count: int, rng: np.random.Generator
) -> tuple[FishParams, dict[str, float]]:
    """The fish with some coefficients three to six prior sd off, and their values by path."""
    nominal = load_fish(name)
    while True:
        paths = rng.choice(MOVABLE, size=count, replace=False).tolist()
        moved = {path: moved_value(nominal, path, rng) for path in paths}
        try:
            return fish.replace(moved), moved
        except ParameterError:  # no rigid body has such moments of inertia
            continue


def moved_value(nominal: FishParams, path: str, rng: np.random.Generator) -> float:
    """A value far from the nominal one that keeps its sign."""
    value = nominal.get(path)
    away = float(rng.uniform(3.0, 6.0)) * nominal.prior_sd(path) * float(rng.choice([-1.0, 1.0]))
    moved = value + away
    return moved if moved * value > 0.0 else value - away


MOVABLE = (
    "tail.drag.c2",
    "tail.lift.c1",
    "body.plane_xz.drag.c0",
    "body.plane_xz.lift.c1",
    "body.plane_xz.impact_moment",
    "body.plane_xy.drag.c0",
    "body.plane_xy.lift.c1",
    "body.plane_xy.impact_moment",
    "body.rotational_damping[0]",
    "body.rotational_damping[1]",
    "body.rotational_damping[2]",
    "inertia.rest[1]",
    "inertia.rest[2]",
)
"""Coefficients that exciting runs show, and that a designer may have got wrong."""
