"""The compact form of a replay inside its page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.vocabulary import CHANNELS, Quantity
from fish_env.params import FishParams
from fish_env.rendering.shape import FishShape, hull_profile
from fish_env.replay.motion import Group, Motion

Plain = dict[str, Any]
MOST_SAMPLES = 6000
"""A plot a thousand pixels wide shows no more."""
OUTLINE = 61
"""Points along the hull."""
COLOURS: dict[str, tuple[str, str]] = {
    "measured": ("#222222", "#f0f0f0"),
    "baseline": ("#D55E00", "#F08A3C"),
    "extended": ("#0072B2", "#56B4E9"),
    "goal": ("#009E73", "#2CC8A0"),
}
"""On a light and on a dark ground; after Okabe and Ito, apart for every kind of colour vision."""
OTHERS = (
    ("#0072B2", "#56B4E9"),
    ("#D55E00", "#F08A3C"),
    ("#009E73", "#2CC8A0"),
    ("#CC79A7", "#E0A0C4"),
    ("#8A6100", "#E69F00"),
)
_UNITS = {
    "length": ("m", 1.0),
    "angle": ("deg", 180.0 / np.pi),
    "speed": ("m/s", 1.0),
    "rate": ("deg/s", 180.0 / np.pi),
}
_LABELS = {
    "z": "depth z",
    "x": "north x",
    "y": "east y",
    "yaw": "heading yaw",
    "tail_angle": "tail",
}
FEWEST_PLOTS = 4
"""With fewer at first, everything that all motions have is shown."""
_ORDER = ("z", "speed", "yaw", "pitch", "roll", "x", "y", "u", "v", "w", "p", "q", "r")
_FIRST = ("z", "speed", "u", "yaw", "pitch", "roll")


def page_data(groups: Sequence[Group], fish: FishParams) -> Plain:
    """Everything the page needs, ready for JSON; arrays as base64 of little-endian float32."""
    shape = FishShape.of(fish)
    return {
        "format": "robofish-replay/1",
        "shape": _sizes(shape),
        "groups": [
            {"name": group.name, "tracks": _tracks(group, shape), "plots": _plots(group)}
            for group in groups
        ],
    }


def _sizes(shape: FishShape) -> Plain:
    """Sizes that the page draws (m, body), and the hull's outline from nose to tail."""
    return {
        "nose": shape.nose,
        "length": shape.length,
        "width": shape.width,
        "height": shape.height,
        "profile": hull_profile(np.linspace(0.0, 1.0, OUTLINE)).round(4).tolist(),
        "tailRoot": list(shape.tail_root),
        "tailLength": shape.tail_length,
        "tailSpan": shape.tail_span,
        "block": list(shape.block),
    }


def colours_of(motions: Sequence[Motion]) -> list[tuple[str, str]]:
    """A colour on light and one on dark for each motion; no role's colour is given twice."""
    used: set[tuple[str, str]] = set()
    result: list[tuple[str, str]] = []
    for motion in motions:
        own = COLOURS.get(motion.role)
        if own is None or own in used:
            free = [c for c in (*OTHERS, COLOURS["measured"]) if c not in used]
            own = free[0] if free else OTHERS[len(result) % len(OTHERS)]
        used.add(own)
        result.append(own)
    return result


def _tracks(group: Group, shape: FishShape) -> list[Plain]:
    colours = colours_of(group.motions)
    return [_track(m, c, shape) for m, c in zip(group.motions, colours, strict=True)]


def _track(motion: Motion, colours: tuple[str, str], shape: FishShape) -> Plain:
    frames, chosen = motion.frames, _thinned(len(motion.time_s))
    centres = [shape.block_centre(moved, angle) for moved, angle in frames.block]
    block = np.column_stack([centres, frames.block[:, 1]])
    return {
        "name": motion.name,
        "role": motion.role,
        "colours": list(colours),
        "notes": list(motion.notes),
        "start": frames.start_s,
        "step": frames.step_s,
        "position": encoded(frames.position),
        "quaternion": encoded(frames.quaternion),
        "tail": encoded(frames.tail_angle),
        "block": encoded(block),
        "time": encoded(motion.time_s[chosen]),
        "channels": {
            name: encoded(_unit(name)[1] * values[chosen])
            for name, values in motion.channels.items()
        },
    }


def _thinned(count: int) -> slice:
    return slice(None, None, -(-count // MOST_SAMPLES))


def _plots(group: Group) -> list[Plain]:
    """Channels to plot: those that every motion has before the others, the telling ones shown."""
    fish = [m for m in group.motions if m.role != "goal"] or group.motions
    sets = [set(motion.channels) for motion in fish]
    common, present = set.intersection(*sets), set.union(*sets)
    order = [name for name in (*_ORDER, "tail_angle") if name in present]
    order.sort(key=lambda name: name not in common)
    shown = [name for name in _FIRST if name in common]
    if "speed" in shown:
        shown.remove("u")
    if len(shown) < FEWEST_PLOTS:
        shown = [name for name in order if name in common]
    return [
        {
            "channel": name,
            "label": f"{_LABELS.get(name, name.replace('_', ' '))} ({_unit(name)[0]})",
            "shown": name in shown,
            "down": name == "z",
        }
        for name in order
    ]


def _unit(name: str) -> tuple[str, float]:
    """Unit a channel is plotted in, and how many of them make one SI unit."""
    return _UNITS[CHANNELS.get(name, Quantity("speed")).dimension]


def encoded(values: FloatArray) -> str:
    """Base64 of float32, little-endian, row by row."""
    return base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode("ascii")
