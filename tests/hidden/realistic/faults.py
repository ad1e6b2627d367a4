"""Wrong inputs: what the files say is not what was measured or commanded.

A fault changes the log after the run, so the motion is that of a fish with nothing wrong.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fish_env.data import COMMANDS
from fish_env.data.frames import switch_frame

Channels = dict[str, np.ndarray]
Log = tuple[Channels, np.ndarray]
"""Channels by name, and rows of time and five commands."""


@dataclass(frozen=True)
class Fault:
    """One wrong input.

    Attributes:
        apply: the log as it is written, from the log as it should be.
        tells: words of which a message about it has at least one.
    """

    apply: Callable[[Channels, np.ndarray], Log]
    tells: tuple[str, ...]


def column(name: str) -> int:
    """Column of a command in the rows."""
    return 1 + list(COMMANDS).index(name)


def scaled(names: tuple[str, ...], factor: float, *more: str) -> Fault:
    """Columns times a factor: a sign, a unit."""

    def apply(channels: Channels, rows: np.ndarray) -> Log:
        rows = rows.copy()
        for name in names:
            if name in COMMANDS:
                rows[:, column(name)] *= factor
            else:
                channels = channels | {name: factor * channels[name]}
        return channels, rows + 0.0

    return Fault(apply, (*names, *more))


def swapped(one: str, other: str) -> Fault:
    """Two columns under each other's name."""

    def apply(channels: Channels, rows: np.ndarray) -> Log:
        if one in COMMANDS:
            rows = rows.copy()
            pair = [column(one), column(other)]
            rows[:, pair] = rows[:, pair[::-1]]
            return channels, rows
        return channels | {one: channels[other], other: channels[one]}, rows

    return Fault(apply, (one, other))


def shifted(name: str, offset: float) -> Fault:
    """A command whose zero is not where the log has it."""

    def apply(channels: Channels, rows: np.ndarray) -> Log:
        rows = rows.copy()
        rows[:, column(name)] += offset
        return channels, rows

    return Fault(apply, (name,))


def undeclared_frame(channels: Channels, rows: np.ndarray) -> Log:
    """Data of frame enu that are declared as ned; the commands are right."""
    return switch_frame(channels), rows


LEFT_HANDED = ("y", "roll", "yaw", "p", "r")
FAULTS: dict[str, Fault] = {
    **{
        f"sign:{name}": scaled((name,), -1.0)
        for name in (
            "tail_offset", "block_displacement", "block_angle", "yaw", "pitch", "r", "q", "y",
        )
    },
    "unit:block_displacement": scaled(("block_displacement",), 10.0),
    "unit:tail_amplitude": scaled(("tail_amplitude",), 2.0),
    "unit:x,y": scaled(("x", "y"), 0.1),
    "unit:p,q,r": scaled(("p", "q", "r"), 180.0 / math.pi),
    "offset:block_displacement": shifted("block_displacement", 0.004),
    "swap:x,y": swapped("x", "y"),
    "swap:roll,pitch": swapped("roll", "pitch"),
    "swap:p,q": swapped("p", "q"),
    "swap:tail_offset,block_angle": swapped("tail_offset", "block_angle"),
    "mirror": scaled(LEFT_HANDED, -1.0, "frame", "mirror", "handed"),
    "frame": Fault(undeclared_frame, ("frame", "enu", "x", "y", "z", "pitch", "yaw")),
}  # fmt: skip
CLOCKS: dict[str, tuple[str, ...]] = {
    "clock_scale": ("clock_scale", "clock"),
    "clock_skew": ("clock_skew", "clock", "recorder"),
    "frequency_scale": ("tail_frequency", "beat", "frequency"),
    "frequency_scale:some runs": ("tail_frequency", "beat", "frequency"),
}
"""Clocks and beats that are off by a factor, and what a message about them says."""
TELLS = {"derived_channels": ("derived",)}
"""The same of what is no fault of a column."""
NEAREST, FARTHEST = 1.15, 5.0


def far_factor(rng: np.random.Generator) -> float:
    """A factor from 0.2 to 5 that is not near one, evenly over its logarithm and either way."""
    size = math.exp(rng.uniform(math.log(NEAREST), math.log(FARTHEST)))
    return float(size if rng.random() < 0.5 else 1.0 / size)
