"""Channels that were computed from one another, so that they are no evidence of their own.

A rate that was differentiated from an angle holds nothing but the angle: a few samples of the one
around each time give the other exactly. Of two sensors each has noise of its own, which no filter
of the other's samples gives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.rigidbody.noise_floor import Floor
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import RecordedRun, Recording

REACH = 6
"""Samples on each side that a differentiation may use."""
RIDGE = 1e-13
"""Share of the trace that keeps the normal equations regular."""
HALVES = 2
"""The filter is fitted to one half of the samples and judged on the other."""
_EULER = {"p": "roll", "q": "pitch", "r": "yaw"}
_ATTITUDE = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class Derived:
    """A channel that follows from others.

    Attributes:
        channel: the one that was computed.
        sources: what it was computed from.
        left: what a filter of the sources leaves of it, over its own noise.
    """

    channel: str
    sources: tuple[str, ...]
    left: float


def derived_channels(recording: Recording, floors: Sequence[Floor]) -> tuple[Derived, ...]:
    """Rates and speeds that were differentiated from angles and positions.

    Args:
        recording: measured runs.
        floors: noise floors of its channels.
    """
    noise = {f.channel: f.white.sd for f in floors if f.white is not None}
    measured = recording.channels
    found = []
    for channel in ("u", "v", "w", "p", "q", "r"):
        if channel not in measured or not noise.get(channel):
            continue
        sources = _sources(channel, measured)
        left = _left(recording, channel, sources) if sources else None
        if left is not None and left < RECORDINGS.own_noise * noise[channel]:
            found.append(Derived(channel, sources, left / noise[channel]))
    return tuple(found)


def _sources(channel: str, measured: Sequence[str]) -> tuple[str, ...]:
    """What a channel may have been computed from."""
    if channel in _EULER:
        own = _EULER[channel]
        others = [name for name in _ATTITUDE if name in measured and name != own]
        return (own, *others) if own in measured else ()
    places = [name for name in "xyz" if name in measured]
    angles = [name for name in _ATTITUDE if name in measured]
    needed = {"u": {"x", "y", "yaw"}, "v": {"x", "y", "yaw"}, "w": {"z"}}[channel]
    return (*places, *angles) if needed <= set(measured) else ()


def _left(recording: Recording, channel: str, sources: tuple[str, ...]) -> float | None:
    """Root mean square of what a filter of the sources leaves of a channel; None if unknown."""
    pairs = [_rows(run, channel, sources) for run in recording.runs]
    design, values = (np.concatenate(side) for side in zip(*pairs, strict=True))
    if len(values) < RECORDINGS.fewest_derived_samples:
        return None
    half = np.arange(len(values)) * HALVES // len(values)
    errors = []
    for own in range(HALVES):
        fitted, judged = half != own, half == own
        normal = design[fitted].T @ design[fitted]
        normal += RIDGE * np.trace(normal) * np.eye(len(normal))
        weights = np.linalg.solve(normal, design[fitted].T @ values[fitted])
        errors.append(values[judged] - design[judged] @ weights)
    # Edges of runs and gaps are differentiated otherwise.
    return float(1.4826 * np.median(np.abs(np.concatenate(errors))))


def _rows(
    run: RecordedRun, channel: str, sources: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """Samples of the sources around each sample of a channel, as body axes see them."""
    every = np.column_stack([run.channels[name] for name in (channel, *sources)])
    known = every[np.isfinite(every).all(axis=1)]
    time = run.time_s[np.isfinite(every).all(axis=1)]
    centre = _evenly_surrounded(time)
    if not centre.size:
        return np.zeros((0, _width(channel, sources))), np.zeros(0)
    beside = centre[:, None] + np.delete(np.arange(-REACH, REACH + 1), REACH)
    columns = dict(zip(sources, known.T[1:], strict=True))
    columns |= {name: np.unwrap(columns[name]) for name in ("roll", "yaw") if name in columns}
    changes = {name: a[beside] - a[centre][:, None] for name, a in columns.items()}
    return _as_body_sees(channel, columns, changes, centre), known[centre, 0]


def _evenly_surrounded(time: FloatArray) -> IntArray:
    """Samples whose neighbours on both sides are at the usual distances."""
    if len(time) < 2 * REACH + 2:
        return np.zeros(0, np.int64)
    steps = np.diff(time)
    even = np.abs(steps - np.median(steps)) < 0.2 * np.median(steps)
    count = np.concatenate([[0], np.cumsum(even)])
    whole = count[2 * REACH :] - count[: -2 * REACH] == 2 * REACH
    return np.flatnonzero(whole) + REACH


def _width(channel: str, sources: tuple[str, ...]) -> int:
    """Number of columns of a design."""
    angles = len([name for name in sources if name in _ATTITUDE])
    return 2 * REACH * (angles if channel in _EULER else 1)


def _as_body_sees(
    channel: str,
    columns: dict[str, FloatArray],
    changes: dict[str, FloatArray],
    centre: IntArray,
) -> FloatArray:
    """Changes of place along a body axis; or of angles, each times its part in a body rate."""
    zero = np.zeros(len(centre))
    roll, pitch, yaw = (columns[n][centre] if n in columns else zero for n in _ATTITUDE)
    (sr, sp, sy), (cr, cp, cy) = (f(np.array([roll, pitch, yaw])) for f in (np.sin, np.cos))
    if channel in _EULER:
        parts = {
            "p": {"roll": np.ones_like(zero), "yaw": -sp},
            "q": {"pitch": cr, "yaw": sr * cp},
            "r": {"pitch": -sr, "yaw": cr * cp},
        }[channel]
        blocks = [parts.get(n, zero)[:, None] * changes[n] for n in _ATTITUDE if n in changes]
        return np.hstack(blocks)
    axis = {
        "u": (cy * cp, sy * cp, -sp),
        "v": (cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr),
        "w": (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr),
    }[channel]
    none = np.zeros((len(centre), 2 * REACH))
    along: FloatArray = np.sum(
        [a[:, None] * changes.get(n, none) for n, a in zip("xyz", axis, strict=True)], axis=0
    )
    return along
