"""Channels that the filter takes as evidence: one table, from which everything else follows.

A further sensor of the state is one more entry. Kernels know a channel by three numbers: its kind,
where its value is, and the column of the error state that it shows.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from fish_env.arrays import IntArray
from fish_env.identification.state_blocks import first_column
from fish_env.model.state import BASE_STATES
from fish_env.sensing.devices import devices_of

VERTICAL = frozenset({"z", "roll", "pitch", "w", "p", "q"})
"""Channels that show more than motion in a horizontal plane, and how a fish floats."""


def from_above(channels: Iterable[str]) -> bool:
    """Whether some channels are those of a camera above the tank, and show no more."""
    return VERTICAL.isdisjoint(channels)


class Kind(IntEnum):
    """How a channel follows from the state."""

    STATE = 0
    """A row of the state."""
    EULER = 1
    """An Euler angle of the attitude: roll, pitch or yaw."""
    DRIVE = 2
    """The tail's angle, which follows from its phase, the commands and the servo's effects."""


@dataclass(frozen=True)
class Channel:
    """One channel of a record.

    Attributes:
        name: as in datasets.
        unit: SI.
        kind: how it follows from the state.
        index: row of the state, or which Euler angle.
        column: column of the error state that it shows, or the first of several.
        turns: whether it is an angle that goes round.
    """

    name: str
    unit: str
    kind: Kind
    index: int
    column: int
    turns: bool = False


def _rows(names: str, unit: str, block: str) -> tuple[Channel, ...]:
    first = first_column(block)
    return tuple(
        Channel(name, unit, Kind.STATE, BASE_STATES.index(name), first + i)
        for i, name in enumerate(names)
    )


_ROTATION = first_column("rotation")
TABLE = (
    *_rows("xy", "m", "position"),
    Channel("z", "m", Kind.STATE, 2, first_column("position") + 2),
    Channel("roll", "rad", Kind.EULER, 0, _ROTATION, turns=True),
    Channel("pitch", "rad", Kind.EULER, 1, _ROTATION),
    Channel("yaw", "rad", Kind.EULER, 2, _ROTATION, turns=True),
    *_rows("uvw", "m/s", "velocity"),
    *_rows("pqr", "rad/s", "rate"),
    Channel("tail_angle", "rad", Kind.DRIVE, 0, first_column("tail_phase")),
)
BY_NAME = {channel.name: channel for channel in TABLE}


def usable_channels(names: Iterable[str]) -> tuple[str, ...]:
    """Channels among those measured that the filter uses, in the table's order."""
    measured = set(names)
    return tuple(channel.name for channel in TABLE if channel.name in measured)


def body_channels(names: Iterable[str]) -> tuple[str, ...]:
    """Channels among those measured that show the body's motion."""
    return tuple(name for name in usable_channels(names) if BY_NAME[name].kind != Kind.DRIVE)


def codes_of(names: Sequence[str]) -> IntArray:
    """(C, 4) kind, index, column and device of each channel, for kernels."""
    channels = zip((BY_NAME[name] for name in names), devices_of(names), strict=True)
    codes = [(int(c.kind), c.index, c.column, int(device)) for c, device in channels]
    return np.array(codes, np.int64).reshape(-1, 4)
