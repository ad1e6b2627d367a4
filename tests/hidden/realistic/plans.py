"""The realistic tiers: what each hides, in what runs, and how many cases a suite has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tests.hidden.plans import SENSORS
from tests.hidden.realistic.catalogue import ALONE, MAIN_SIZES, PLANT_SIZES
from tests.hidden.realistic.faults import CLOCKS, FAULTS

SUSPECTS = (*ALONE, *FAULTS, *CLOCKS)
"""Everything that acts alone: sensors and physics, wrong columns, clocks and beats."""


@dataclass(frozen=True)
class Tier:
    """One tier.

    Attributes:
        about: what it holds, in words.
        choices: what acts most or alone; consecutive numbers go through them in order.
        cases: how many a full suite has.
        strength: size of the main effect, 1 is typical.
        small: whether small errors act.
        real: whether runs differ and sensors are dirty.
        budget: whether the shares of the misfit are worked out.
    """

    about: str
    choices: tuple[str, ...]
    cases: int
    strength: float = 1.0
    small: bool = False
    real: bool = False
    budget: bool = False


MAIN = tuple(MAIN_SIZES)
MANY = "five to ten others at a tenth to a fifth of theirs, dirty sensors, runs that differ."
TIERS: dict[str, Tier] = {
    "realistic": Tier(
        f"One effect of typical size, {MANY}", MAIN, len(MAIN), 1.0, True, True, True
    ),
    "realistic_60": Tier(
        f"One effect at 0.6 of its size, {MANY}", MAIN, len(MAIN), 0.6, True, True, True
    ),
    "realistic_30": Tier(
        f"One effect at 0.3 of its size, {MANY}", MAIN, len(MAIN), 0.3, True, True, True
    ),
    "small_only": Tier(
        "Five to ten effects at a tenth to a fifth of their size, dirty sensors, runs that differ.",
        (), 36, small=True, real=True,
    ),
    "suspects": Tier(
        "One thing that a team would suspect, alone: of the sensors, of the inputs, of the robot.",
        SUSPECTS, len(SUSPECTS),
    ),
    "foreign_plant": Tier(
        "A tail of three links, a hull of strips that stall, a wake with a frequency of its own, "
        "or a wake that leans to one side and remembers which, alone.",
        tuple(PLANT_SIZES), 4 * len(PLANT_SIZES),
    ),
    "noise_only": Tier(
        "White noise of 0.3 (m, rad, rad/s) on nine channels, real commands.", (), 100
    ),
}  # fmt: skip
RUNS, DURATION = 8, 30.0
"""Number of runs, and s."""
RATES = (25.0, 25.0, 25.0, 50.0)
"""Samples per second, by the number of the case modulo four."""
PURE_NOISE = 0.3
FORCE, MEMORY = (0.002, 0.004), (0.3, 1.5)
"""N and s: ranges of the push, as in the plain tiers."""
DEPTH, SHALLOW = (0.2, 1.2), (0.03, 0.2)
"""m. Ranges of the start depth: in general, and where the surface matters."""
NOISE: Mapping[str, float] = SENSORS
