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


class Kind(IntEnum):
    """How a channel follows from the state."""

    STATE = 0
    """A row of the state."""
    EULER = 1
    """An Euler angle of the attitude: roll, pitch or yaw."""
    DRIVE = 2
    """The tail's angle, which follows from its phase, the commands and the servo's effects."""


class Device(IntEnum):
    """What records a channel. All channels of a device are equally late."""

    CAMERA = 0
    INERTIAL = 1
    DEPTH = 2
    DRIVE = 3
    """The servo's own sensor, on the commands' clock."""


@dataclass(frozen=True)
class Channel:
    """One channel of a record.

    Attributes:
        name: as in datasets.
        unit: SI.
        kind: how it follows from the state.
        index: row of the state, or which Euler angle.
        column: column of the error state that it shows, or the first of several.
        device: what usually records it.
        turns: whether it is an angle that goes round.
    """

    name: str
    unit: str
    kind: Kind
    index: int
    column: int
    device: Device
    turns: bool = False


def _rows(names: str, unit: str, block: str, device: Device) -> tuple[Channel, ...]:
    first = first_column(block)
    return tuple(
        Channel(name, unit, Kind.STATE, BASE_STATES.index(name), first + i, device)
        for i, name in enumerate(names)
    )


_ROTATION = first_column("rotation")
TABLE = (
    *_rows("xy", "m", "position", Device.CAMERA),
    Channel("z", "m", Kind.STATE, 2, first_column("position") + 2, Device.DEPTH),
    Channel("roll", "rad", Kind.EULER, 0, _ROTATION, Device.INERTIAL, turns=True),
    Channel("pitch", "rad", Kind.EULER, 1, _ROTATION, Device.INERTIAL),
    Channel("yaw", "rad", Kind.EULER, 2, _ROTATION, Device.INERTIAL, turns=True),
    *_rows("uvw", "m/s", "velocity", Device.CAMERA),
    *_rows("pqr", "rad/s", "rate", Device.INERTIAL),
    Channel("tail_angle", "rad", Kind.DRIVE, 0, first_column("tail_phase"), Device.DRIVE),
)
BY_NAME = {channel.name: channel for channel in TABLE}


def usable_channels(names: Iterable[str]) -> tuple[str, ...]:
    """Channels among those measured that the filter uses, in the table's order."""
    measured = set(names)
    return tuple(channel.name for channel in TABLE if channel.name in measured)


def body_channels(names: Iterable[str]) -> tuple[str, ...]:
    """Channels among those measured that show the body's motion."""
    return tuple(name for name in usable_channels(names) if BY_NAME[name].kind != Kind.DRIVE)


_SAYS_INERTIAL = ("roll", "pitch", "p", "q", "r")
"""Channels of which one at least says that there is an inertial unit."""


def has_inertial_unit(names: Iterable[str]) -> bool:
    """Whether an inertial unit is among what recorded these channels."""
    return not set(_SAYS_INERTIAL).isdisjoint(names)


def devices_of(names: Sequence[str]) -> tuple[Device, ...]:
    """What recorded each of these channels. Without an inertial unit a camera reads the heading."""
    inertial = has_inertial_unit(names)
    found = (BY_NAME[name].device for name in names)
    return tuple(Device.CAMERA if d == Device.INERTIAL and not inertial else d for d in found)


def codes_of(names: Sequence[str]) -> IntArray:
    """(C, 4) kind, index, column and device of each channel, for kernels."""
    channels = zip((BY_NAME[name] for name in names), devices_of(names), strict=True)
    codes = [(int(c.kind), c.index, c.column, int(device)) for c, device in channels]
    return np.array(codes, np.int64).reshape(-1, 4)
