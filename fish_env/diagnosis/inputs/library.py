"""The mistakes that are looked for: signs, units, swapped columns, frames and zeros of headings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

from fish_env.data.schema import Dataset
from fish_env.data.vocabulary import CHANNELS, COMMANDS
from fish_env.diagnosis.inputs.changes import Change, Column
from fish_env.diagnosis.inputs.lines import Lines

GROUPS = (("x", "y", "z"), ("roll", "pitch", "yaw"), ("u", "v", "w"), ("p", "q", "r"))
"""Channels of one sensor, which are mistaken together as a rule."""
DEGREE = math.radians(1.0)
FACTORS: dict[str, dict[float, tuple[str, str]]] = {
    "length": {
        1e3: ("metres", "millimetres"), 1e2: ("metres", "centimetres"),
        10.0: ("centimetres", "millimetres"),
    },
    "speed": {
        1e3: ("m/s", "mm/s"), 1e2: ("m/s", "cm/s"), 10.0: ("cm/s", "mm/s"),
    },
    "angle": {1.0 / DEGREE: ("radians", "degrees")},
    "rate": {1.0 / DEGREE: ("rad/s", "deg/s")},
}  # fmt: skip
"""By how much the finer unit's numbers are larger, and the coarser and the finer unit in words."""
SHORT = {"metres": "m", "centimetres": "cm", "millimetres": "mm", "radians": "rad",
         "degrees": "deg"}  # fmt: skip
SIGNED = ("tail_offset", "block_displacement", "block_angle")
"""Commands that have a sign."""
LEFT_HANDED = ("y", "v", "roll", "yaw", "p", "r")
"""Channels whose sign a mirror reverses that exchanges left and right."""
HEADINGS = (
    ("yaw points to the tail", 1.0, math.pi),
    ("yaw is zero at east", 1.0, 0.5 * math.pi),
    ("yaw is zero at west", 1.0, -0.5 * math.pi),
)
"""Words, and sign and offset (rad) that put the column right."""


def readings(dataset: Dataset) -> list[Change]:
    """Every other reading of the columns of a dataset."""
    channels, lines = dataset.channels, Lines(dataset)
    return [
        _other_frame(dataset.frame),
        *_signs(channels, lines),
        *_mirrored(channels, lines),
        *_units(channels, lines),
        *_swaps(channels, lines),
        *_headings(channels, lines),
    ]


def _other_frame(frame: str) -> Change:
    other = "ned" if frame == "enu" else "enu"
    words = {
        "enu": "the data are in frame enu (z up, y and yaw to port), but are declared as ned",
        "ned": "the data are in frame ned (z down, y and yaw to starboard), but declared as enu",
    }[other]
    reversed_ = ("y", "z", "pitch", "yaw", "v", "w", "q", "r")
    return Change(
        "frame", "frame", None, "", f"frame: {other}", words, turned=True,
        channels={name: Column(name) for name in reversed_},
        commands={"tail_offset": Column("tail_offset", -1.0)},
    )  # fmt: skip


def sets_of(channels: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Every channel alone, and those of each group together."""
    for name in channels:
        if name in CHANNELS and name != "tail_angle":
            yield (name,)
    for group in GROUPS:
        own = tuple(name for name in group if name in channels)
        if len(own) > 1:
            yield own
        if group[0] == "x" and len(own) == 3:
            yield own[:2]


def _signs(channels: Sequence[str], lines: Lines) -> Iterator[Change]:
    for own in sets_of(channels):
        yield Change(
            "sign", ", ".join(own), -1.0, "", lines.signs(own),
            f"{_and(own)} {_have(own)} the wrong sign",
            channels={name: Column(name, -1.0) for name in own},
        )  # fmt: skip
    for name in SIGNED:
        yield Change(
            "sign", name, -1.0, "", lines.signs((name,)),
            f"the command {name} has the wrong sign", commands={name: Column(name, -1.0)},
        )  # fmt: skip


def _mirrored(channels: Sequence[str], lines: Lines) -> Iterator[Change]:
    own = tuple(name for name in LEFT_HANDED if name in channels)
    if len(own) > 1:
        yield Change(
            "mirror", ", ".join(own), -1.0, "", lines.signs(own),
            f"the motion is that of a mirrored fish, in a left-handed frame: {_and(own)} have the "
            "wrong sign",
            channels={name: Column(name, -1.0) for name in own},
        )  # fmt: skip


def _units(channels: Sequence[str], lines: Lines) -> Iterator[Change]:
    for own in sets_of(channels):
        for factor, (coarse, fine) in FACTORS[CHANNELS[own[0]].dimension].items():
            for scale, real, declared in ((1.0 / factor, fine, coarse), (factor, coarse, fine)):
                unit = SHORT.get(real, real)
                yield Change(
                    "unit", ", ".join(own), scale, unit, lines.units(own, unit),
                    f"{_and(own)} {'are' if len(own) > 1 else 'is'} in {real} but declared as "
                    f"{declared}",
                    channels={name: Column(name, scale) for name in own},
                )  # fmt: skip
    for name, quantity in COMMANDS.items():
        for factor, (coarse, fine) in FACTORS.get(quantity.dimension, {}).items():
            unit = SHORT.get(coarse, coarse)
            yield Change(
                "unit", name, factor, unit, lines.units((name,), unit),
                f"the command {name} is in {coarse} but declared as {fine}",
                commands={name: Column(name, factor)},
            )  # fmt: skip


def _swaps(channels: Sequence[str], lines: Lines) -> Iterator[Change]:
    for group in GROUPS:
        for one, other in combinations([name for name in group if name in channels], 2):
            yield _swap(one, other, lines)
    for one, other in combinations(COMMANDS, 2):
        if COMMANDS[one].dimension == COMMANDS[other].dimension:
            yield _swap(one, other, lines)


def _swap(one: str, other: str, lines: Lines) -> Change:
    """Two channels, or two commands, in each other's columns."""
    crossed = {one: Column(other), other: Column(one)}
    commanded = one in COMMANDS
    return Change(
        "swap", f"{one}, {other}", None, "",
        lines.swap(one, other),
        f"{'the commands ' if commanded else ''}{one} and {other} are swapped",
        channels={} if commanded else crossed, commands=crossed if commanded else {},
    )  # fmt: skip


def _headings(channels: Sequence[str], lines: Lines) -> Iterator[Change]:
    if "yaw" not in channels:
        return
    for words, sign, offset in HEADINGS:
        yield Change(
            "offset", "yaw", offset, "rad",
            lines.offset("yaw", offset),
            words, channels={"yaw": Column("yaw", sign, offset)},
        )  # fmt: skip
    yield Change(
        "frame", "yaw", None, "", lines.own_frame("yaw"),
        "yaw is measured from east towards north, as in frame enu",
        channels={"yaw": Column("yaw", -1.0, 0.5 * math.pi)},
    )  # fmt: skip


def _and(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _have(names: Sequence[str]) -> str:
    return "has" if len(names) == 1 else "have"
