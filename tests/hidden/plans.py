"""The tiers: how many runs, what is measured and how well, and what may be hidden."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from tests.hidden.measurement import ALL_CHANNELS, CAMERA_CHANNELS
from tests.hidden.sizes import FOREIGN_SIZES, SIZES

DEGREE = math.radians(1.0)
SENSORS = {
    **dict.fromkeys(("x", "y", "z"), 0.002),
    **dict.fromkeys(("roll", "pitch", "yaw"), 0.3 * DEGREE),
    **dict.fromkeys(("p", "q", "r"), 0.01),
}
CAMERA = {**dict.fromkeys(("x", "y", "z"), 0.002), "yaw": 0.5 * DEGREE}
SINGLE = tuple((name,) for name in SIZES)


@dataclass(frozen=True)
class Plan:
    """One tier.

    Attributes:
        choices: effects that act together, one entry a case; empty for none.
        strength: size of each, 1 is typical.
        moved: fewest and most baseline coefficients that are off (end excluded).
        runs: number of runs.
        duration: of each, s.
        rate: samples per second.
        noise: one-sigma value by channel.
        missing: share of samples that are lost.
        start: "rest" with known tail phase, or "unknown".
        schedule: "exciting", "controller" or one of the poor ones.
        colours: colours of the disturbance, one is drawn.
        force: range of its rms force, N.
        memory: range of its correlation time, s.
        visible: whether the runs can show the effects.
        steady: whether the data are a table of steady motion.
    """

    choices: tuple[tuple[str, ...], ...] = ()
    strength: float = 1.0
    moved: tuple[int, int] | None = None
    runs: int = 8
    duration: float = 30.0
    rate: float = 25.0
    noise: Mapping[str, float] = field(default_factory=lambda: SENSORS)
    missing: float = 0.0
    start: str = "rest"
    schedule: str = "exciting"
    colours: tuple[str, ...] = ("ou",)
    force: tuple[float, float] = (0.002, 0.004)
    memory: tuple[float, float] = (0.3, 1.5)
    visible: bool = True
    steady: bool = False


RICH = Plan(SINGLE)
PLANS: dict[str, Plan] = {
    "rich": RICH,
    "null": replace(RICH, choices=()),
}

assert set(SENSORS) == set(ALL_CHANNELS)
assert set(CAMERA) == set(CAMERA_CHANNELS)
assert not set(SIZES) & set(FOREIGN_SIZES)
