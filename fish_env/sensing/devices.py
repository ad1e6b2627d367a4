"""What records each channel. All channels of a device are equally late."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import IntEnum
from math import inf, pi, sqrt
from typing import Any


class Device(IntEnum):
    """What records a channel."""

    CAMERA = 0
    INERTIAL = 1
    DEPTH = 2
    DRIVE = 3
    """The servo's own sensor, on the commands' clock."""


_RECORDED_BY = {
    Device.CAMERA: ("x", "y", "u", "v", "w"),
    Device.DEPTH: ("z",),
    Device.INERTIAL: ("roll", "pitch", "yaw", "p", "q", "r"),
    Device.DRIVE: ("tail_angle",),
}
USUAL_DEVICE = {name: device for device, names in _RECORDED_BY.items() for name in names}
"""Channel -> what usually records it."""
_SAYS_INERTIAL = ("roll", "pitch", "p", "q", "r")
"""Channels of which one at least says that there is an inertial unit."""


def has_inertial_unit(names: Iterable[str]) -> bool:
    """Whether an inertial unit is among what recorded these channels."""
    return not set(_SAYS_INERTIAL).isdisjoint(names)


def devices_of(names: Sequence[str]) -> tuple[Device, ...]:
    """What recorded each of these channels. Without an inertial unit a camera reads the heading."""
    inertial = has_inertial_unit(names)
    found = (USUAL_DEVICE[name] for name in names)
    return tuple(Device.CAMERA if d == Device.INERTIAL and not inertial else d for d in found)


def late_s(cutoff_hz: Any) -> Any:
    """By how much a low-pass inside an inertial unit makes slow signals late (s).

    Args:
        cutoff_hz: frequency of half power of a Butterworth filter of second order, a number or an
            array; infinite for none.
    """
    return sqrt(2.0) / (2.0 * pi * cutoff_hz)


HIGHEST_HZ = 60.0
"""Cutoff of a low-pass from which it takes nothing off a tail's beat."""


def seen_cutoff(cutoff_hz: float) -> float:
    """The cutoff of a low-pass (Hz); infinite where it does nothing but make samples late."""
    return cutoff_hz if cutoff_hz < HIGHEST_HZ else inf
