"""Kinematic links between channels, coarse enough to hold whatever the sensors are like.

Angles follow from rates, positions from speeds, and a vehicle that swims head first goes where it
points. What is slightly off is for :mod:`fish_env.rigidbody.consistency`; here a column is read the
wrong way altogether.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.rigidbody.comparisons import Comparison, Part, compared
from fish_env.rigidbody.gridded import GridRun, averaged, grown, integrated

STRIDE_S = 0.3
"""s. Over such a time the increments of swimming are well above the noise."""
TRAVEL_S = 1.0
"""s over which a path and a heading are taken."""

Link = Callable[[GridRun], tuple[FloatArray, FloatArray, int]]


def links(runs: Sequence[GridRun]) -> list[Comparison]:
    """Every link that the channels of some runs allow."""
    measured = frozenset(runs[0].channels)
    found = []
    for output, needed, helpful, link in _LINKS:
        if {output, *needed} <= measured:
            others = (*needed, *(name for name in helpful if name in measured))
            name = f"{output} against {', '.join(needed)}"
            found.append(compared(name, (output, *others), _parts(runs, link)))
    if {"x", "y", "yaw"} <= measured:
        found.append(compared("path against yaw", ("x", "y", "yaw"), _parts(runs, _heading)))
    if {"z", "pitch"} <= measured and ({"x", "y"} <= measured or "u" in measured):
        channels = tuple(name for name in ("x", "y", "u") if name in measured)
        parts = _parts(runs, _climb)
        found.append(compared("z against pitch", ("z", "pitch", *channels), parts, centred=True))
    return [comparison for comparison in found if comparison is not None]


def _parts(runs: Sequence[GridRun], link: Link) -> list[Part]:
    return [(run, *link(run)) for run in runs]


def _get(run: GridRun, name: str) -> FloatArray:
    """A channel; zero where it is not measured at all."""
    return run.channels.get(name, np.zeros(run.size))


def _roll(run: GridRun) -> tuple[FloatArray, FloatArray, int]:
    roll, pitch, p, q, r = (_get(run, name) for name in ("roll", "pitch", "p", "q", "r"))
    rate = p + np.tan(_within(pitch)) * (q * np.sin(roll) + r * np.cos(roll))
    return _increments(run, roll, rate)


def _pitch(run: GridRun) -> tuple[FloatArray, FloatArray, int]:
    roll, pitch, q, r = (_get(run, name) for name in ("roll", "pitch", "q", "r"))
    return _increments(run, pitch, q * np.cos(roll) - r * np.sin(roll))


def _yaw(run: GridRun) -> tuple[FloatArray, FloatArray, int]:
    roll, pitch, yaw, q, r = (_get(run, name) for name in ("roll", "pitch", "yaw", "q", "r"))
    rate = (q * np.sin(roll) + r * np.cos(roll)) / np.cos(_within(pitch))
    return _increments(run, yaw, rate)


def _within(pitch: FloatArray) -> FloatArray:
    """Pitch away from the poles, so that a wrong unit makes no infinite rate."""
    return np.clip(pitch, -1.2, 1.2)


def _increments(
    run: GridRun, values: FloatArray, rate: FloatArray
) -> tuple[FloatArray, FloatArray, int]:
    stride = run.steps(STRIDE_S)
    return grown(values, stride), integrated(run, rate, stride), stride


def _over_ground(run: GridRun) -> FloatArray:
    """Velocity over ground, (n, 3), from body velocities and attitude."""
    roll, pitch, yaw, u, v, w = (
        _get(run, name) for name in ("roll", "pitch", "yaw", "u", "v", "w")
    )
    (sr, sp, sy), (cr, cp, cy) = (f(np.array([roll, pitch, yaw])) for f in (np.sin, np.cos))
    level = v * sr + w * cr
    side = v * cr - w * sr
    ahead = u * cp + sp * level
    return np.column_stack([cy * ahead - sy * side, sy * ahead + cy * side, -sp * u + cp * level])


def _place(axis: int) -> Link:
    def link(run: GridRun) -> tuple[FloatArray, FloatArray, int]:
        return _increments(run, _get(run, "xyz"[axis]), _over_ground(run)[:, axis])

    return link


def _heading(run: GridRun) -> tuple[FloatArray, FloatArray, int]:
    """Way made good, and the same way along the heading."""
    stride = run.steps(TRAVEL_S)
    way = np.column_stack([grown(run.channels[name], stride) for name in "xy"])
    yaw = averaged(run.channels["yaw"], stride)
    ahead = np.column_stack([np.cos(yaw), np.sin(yaw)])
    return way, np.linalg.norm(way, axis=1)[:, None] * ahead, stride


def _climb(run: GridRun) -> tuple[FloatArray, FloatArray, int]:
    """Increase of depth, and what speed and pitch make of it."""
    stride = run.steps(TRAVEL_S)
    if {"x", "y"} <= set(run.channels):
        way = np.hypot(*(grown(run.channels[name], stride) for name in "xy"))
    else:
        way = averaged(run.channels["u"], stride) * stride * run.step_s
    sinking = grown(run.channels["z"], stride)
    return sinking, -way * np.sin(averaged(run.channels["pitch"], stride)), stride


_LINKS: tuple[tuple[str, tuple[str, ...], tuple[str, ...], Link], ...] = (
    ("roll", ("p",), ("pitch", "q", "r"), _roll),
    ("pitch", ("q",), ("roll", "r"), _pitch),
    ("yaw", ("r",), ("roll", "pitch", "q"), _yaw),
    ("x", ("u", "v", "yaw"), ("w", "roll", "pitch"), _place(0)),
    ("y", ("u", "v", "yaw"), ("w", "roll", "pitch"), _place(1)),
    ("z", ("u", "w", "pitch"), ("v", "roll"), _place(2)),
)
"""Output, what it follows from, what makes that more exact, and how."""
