"""Scenes of a replay, and their compact form inside a page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.data.vocabulary import CHANNELS, Quantity
from fish_env.params import FishParams
from fish_env.replay.motion import Motion
from fish_env.replay.shape import block_position, shape_of

FloatArray = npt.NDArray[np.float64]
Plain = dict[str, Any]
MOST_SAMPLES = 6000
"""A plot a thousand pixels wide shows no more."""
COLOURS: dict[str, tuple[str, str]] = {
    "measured": ("#222222", "#f0f0f0"),
    "baseline": ("#D55E00", "#F08A3C"),
    "extended": ("#0072B2", "#56B4E9"),
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
_ORDER = ("z", "speed", "yaw", "pitch", "roll", "x", "y", "u", "v", "w", "p", "q", "r")
_FIRST = ("z", "speed", "u", "yaw", "pitch", "roll")


@dataclass(frozen=True, eq=False)
class Scene:
    """Motions that are shown together.

    Attributes:
        name: Shown in the list of scenes.
        motions: They share one clock.
    """

    name: str
    motions: tuple[Motion, ...]


def page_data(scenes: Sequence[Scene], fish: FishParams) -> Plain:
    """Everything the page needs, ready for JSON; arrays as base64 of little-endian float32."""
    return {
        "format": "robofish-replay/1",
        "shape": shape_of(fish),
        "scenes": [
            {"name": scene.name, "tracks": _tracks(scene, fish), "plots": _plots(scene)}
            for scene in scenes
        ],
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


def _tracks(scene: Scene, fish: FishParams) -> list[Plain]:
    colours = colours_of(scene.motions)
    return [_track(m, c, fish) for m, c in zip(scene.motions, colours, strict=True)]


def _track(motion: Motion, colours: tuple[str, str], fish: FishParams) -> Plain:
    frames, chosen = motion.frames, _thinned(len(motion.time_s))
    block = np.column_stack([block_position(fish, frames.block), frames.block[:, 1]])
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


def _plots(scene: Scene) -> list[Plain]:
    """Channels to plot, those that say most first and shown from the start."""
    present = {name for motion in scene.motions for name in motion.channels}
    order = [name for name in (*_ORDER, "tail_angle") if name in present]
    first = [
        name for name in _FIRST if name in present and not (name == "u" and "speed" in present)
    ]
    return [
        {
            "channel": name,
            "label": f"{_LABELS.get(name, name.replace('_', ' '))} ({_unit(name)[0]})",
            "shown": name in first or len(order) <= len(_FIRST),
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
