"""What is hidden in a realistic case, piece by piece, and how the pieces add up in a run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tests.hidden.realistic.catalogue import (
    BY_SENSORS,
    CHANCE,
    DIRT,
    MAIN_SIZES,
    NEUTRAL,
    SOMETIMES,
    VARIATION,
)
from tests.hidden.sizes import Size, draw_values

Values = dict[str, dict[str, float]]
SMALLEST, LARGEST = 0.1, 0.2
"""Strength of a small error: a tenth to a fifth of a usual size."""
FEWEST, MOST = 5, 10
"""How many small errors act at once."""


@dataclass(frozen=True)
class Piece:
    """One hidden thing.

    Attributes:
        name: as the budget and the truth call it.
        role: "main", "small", "dirt", "variation", "suspect" or "foreign".
        runs: parameters by effect in each run.
    """

    name: str
    role: str
    runs: tuple[Values, ...]

    @property
    def moves(self) -> bool:
        """Whether it changes the motion, not only the record."""
        names = {name for values in self.runs for name in values}
        return bool(names - BY_SENSORS) or bool(names & {"clock_scale"})


def piece(name: str, role: str, values: Mapping[str, float], runs: int) -> Piece:
    """A thing that is the same in all runs."""
    return Piece(name, role, ({name: dict(values)},) * runs)


def added(run: int, pieces: Iterable[Piece]) -> Values:
    """All parameters of a run: departures from neutral add up, scales multiply."""
    total: Values = {}
    for one in pieces:
        for name, values in one.runs[run].items():
            before = total.setdefault(name, dict(NEUTRAL[name]))
            for key, value in values.items():
                before[key] = together(before[key], value, NEUTRAL[name][key])
    return total


def together(one: float, other: float, neutral: float) -> float:
    """Two values of a parameter at once."""
    if one == neutral or not math.isfinite(neutral):
        return other
    return one * other / neutral if neutral == 1.0 else one + other - neutral


def draw(
    name: str, sizes: Mapping[str, Size], strength: float, rng: np.random.Generator
) -> dict[str, float]:
    """Parameters of one effect."""
    return draw_values(sizes[name], NEUTRAL[name], strength, rng)


def main_piece(name: str, strength: float, runs: int, rng: np.random.Generator) -> Piece:
    """The effect that acts most. A wave meets each run in another phase."""
    values = draw(name, MAIN_SIZES, strength, rng)
    return Piece(name, "main", tuple({name: phased(name, values, rng)} for _ in range(runs)))


def small_pieces(avoid: Sequence[str], runs: int, rng: np.random.Generator) -> list[Piece]:
    """Five to ten other effects of the catalogue, each small."""
    pool = [name for name in MAIN_SIZES if name not in avoid]
    names = rng.choice(pool, size=int(rng.integers(FEWEST, MOST + 1)), replace=False).tolist()
    pieces = []
    for name in names:
        values = draw(name, MAIN_SIZES, float(rng.uniform(SMALLEST, LARGEST)), rng)
        each = tuple({name: phased(name, values, rng)} for _ in range(runs))
        pieces.append(Piece(name, "small", each))
    return pieces


def phased(name: str, values: dict[str, float], rng: np.random.Generator) -> dict[str, float]:
    """The values, for a wave with a phase of the run's own."""
    if name != "wave":
        return values
    return values | {"phase": float(rng.uniform(-math.pi, math.pi))}


def dirt_pieces(avoid: Sequence[str], runs: int, rng: np.random.Generator) -> list[Piece]:
    """Sensors as they are: noise of every kind, and a part of what may be systematic."""
    pieces = [piece(name, "dirt", draw(name, DIRT, 1.0, rng), runs) for name in DIRT]
    for name in SOMETIMES:
        values, there = draw(name, SOMETIMES, 1.0, rng), rng.random() < CHANCE
        if there and name not in avoid:
            pieces.append(piece(name, "dirt", values, runs))
    return pieces


def variation_piece(runs: int, rng: np.random.Generator) -> Piece:
    """What differs from run to run, each parameter normal about neutral; batteries only sag."""
    each = []
    for _ in range(runs):
        values = {
            name: {
                key: float(NEUTRAL[name][key] + sd * rng.standard_normal())
                for key, sd in sds.items()
            }
            for name, sds in VARIATION.items()
        }
        values["battery_sag"]["rate"] = abs(values["battery_sag"]["rate"])
        each.append(values)
    return Piece("variation", "variation", tuple(each))
