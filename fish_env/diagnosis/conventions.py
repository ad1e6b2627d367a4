"""Units, signs and axes that can only be mistaken: channels that contradict each other grossly.

What is slightly off is an effect of measurement (:mod:`fish_env.diagnosis.consistency`). Here a
rate is some 57 times the slope of its angle, a heading runs against the turn, or a fish swims
sideways for a whole dataset, unless one reads the column another way. No diagnosis survives that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fish_env.data.schema import Dataset, Run
from fish_env.diagnosis.kinematics import Relation, relations_of
from fish_env.errors import DatasetError

FloatArray = npt.NDArray[np.float64]
STRIDE_S = 0.3
"""s. Over such a time the increments of swimming are well above the noise."""
FEWEST = 30
CLOSE = 0.75
"""Correlation above which two series are the same motion, whatever their scale and sign."""
SLOWEST, SMOOTHING_S = 0.05, 1.0
"""m/s below which a path has no direction, and s over which a path and a heading are taken."""
ALIGNED, ASTRAY = 0.9, 0.5
"""Mean cosine between heading and path of a fish that swims head first, and of one that does not.

In the simulated datasets of the test suite it is above 0.9.
"""
CLIMBING = 0.003
"""m/s by which the climb must vary for its sign to be told."""
SINKING = -0.4
"""Mean correlation, within runs, of the climb with what pitch and speed make of it; where signs are
right it is between 0.2 and 0.8 in these datasets."""


def check_conventions(dataset: Dataset) -> None:
    """Refuse channels whose units, signs or axes contradict each other.

    Raises:
        DatasetError: Names the channels and what is likely wrong with them.
    """
    for relation in relations_of(dataset.channels):
        strides = [_strides(relation, run) for run in dataset.runs]
        together: FloatArray = np.concatenate(strides)
        likeness = [_likeness(together[:, :, row]) for row in range(len(relation.outputs))]
        for row in sorted(range(len(likeness)), key=lambda i: -likeness[i]):
            if likeness[row] > CLOSE:
                output = relation.outputs[row]
                source = relation.inputs[row] if relation.name == "attitude" else "u, v, w"
                place = f"{dataset.name}: {output} changes"
                _check_scale(place, together[:, :, row], output, source)
    if {"x", "y", "yaw"} <= {*dataset.channels}:
        _check_heading(dataset)
    if {"x", "y", "z", "pitch"} <= {*dataset.channels}:
        _check_climb(dataset)


def _likeness(strides: FloatArray) -> float:
    """Correlation of measured and integrated increments, whatever its sign; 0 if there is none."""
    if len(strides) < FEWEST or not strides.std(axis=0).all():
        return 0.0
    return float(abs(np.corrcoef(strides[:, 0], strides[:, 1])[0, 1]))


def _check_scale(place: str, strides: FloatArray, output: str, source: str) -> None:
    """Refuse an output that follows its source at another scale, or against it."""
    measured, integrated = strides.T
    # Symmetric in the two, as both are noisy.
    ratio = float(measured.std() / integrated.std())
    if not 0.5 < ratio < 2.0:
        raise DatasetError(
            f"{place} {ratio:.3g} times as fast as {source} says: {_likely(ratio, output, source)}"
        )
    if float(measured @ integrated) < 0.0:
        raise DatasetError(
            f"{place} against what {source} says; one of the two has the wrong sign. The frames "
            "are described in docs/data-format.md; convert the column, or declare `frame: enu` if "
            "all of it is that way round"
        )


def _strides(relation: Relation, run: Run) -> FloatArray:
    """Measured and integrated increments over `STRIDE_S`, (n, 2, rows), about their means."""
    nothing = np.zeros((0, 2, len(relation.outputs)))
    prepared = relation.prepared(run)
    if prepared is None:
        return nothing
    left = relation.increments(prepared, np.zeros(len(relation.settings)))
    measured = np.diff(prepared.outputs, axis=0)[prepared.keep]
    count = max(1, round(STRIDE_S / float(np.median(left.span_s))))
    if len(measured) < count + 1:
        return nothing
    both = np.stack([measured, measured - left.left], axis=1)
    window = np.lib.stride_tricks.sliding_window_view
    strides = window(both, count, axis=0).sum(axis=-1)
    strides = strides[window(left.joined[1:], count - 1).all(axis=1)] if count > 1 else strides
    result: FloatArray = strides - strides.mean(axis=0) if len(strides) else nothing
    return result


UNITS = {
    math.degrees(1.0): ("degrees", "radians"),
    1e3: ("millimetres", "metres"),
    1e2: ("centimetres", "metres"),
    10.0: ("millimetres", "centimetres"),
}


def _likely(ratio: float, output: str, source: str) -> str:
    """What a ratio far from one points to."""
    large, small = (output, source) if ratio > 1.0 else (source, output)
    for factor, (fine, coarse) in UNITS.items():
        if abs(abs(math.log(ratio)) - math.log(factor)) < 0.35:
            return (
                f"{large} is in {fine} but declared as {coarse}, or {small} is in {coarse} but "
                f"declared as {fine}; correct the units under channels"
            )
    return "correct the units under channels, or the time column"


@dataclass(frozen=True)
class _Travel:
    """Motion of a run over about a second: path direction (rad), yaw, speed, climb, pitch."""

    track: FloatArray
    yaw: FloatArray
    speed: FloatArray
    sinking: FloatArray | None
    pitch: FloatArray | None


def _travels(dataset: Dataset) -> Iterator[_Travel]:
    names = [name for name in ("x", "y", "yaw", "z", "pitch") if name in dataset.channels]
    for run in dataset.runs:
        columns = np.column_stack([run.channels[name] for name in names])
        measured = np.isfinite(columns).all(axis=1)
        t = run.time_s[measured]
        if len(t) < 10:
            continue
        c = dict(zip(names, columns[measured].T, strict=True))
        count = max(2, round(SMOOTHING_S / float(np.median(np.diff(t)))))
        if len(t) < 2 * count:
            continue
        span = t[count:] - t[:-count]
        u, v = ((c[name][count:] - c[name][:-count]) / span for name in ("x", "y"))
        yaw = _averaged(np.unwrap(c["yaw"]), count)
        sinking = (c["z"][count:] - c["z"][:-count]) / span if "z" in c else None
        pitch = _averaged(c["pitch"], count) if "pitch" in c else None
        good = span < 2.0 * SMOOTHING_S
        yield _Travel(
            np.arctan2(v, u)[good], yaw[good], np.hypot(u, v)[good],
            None if sinking is None else sinking[good], None if pitch is None else pitch[good],
        )  # fmt: skip


def _averaged(values: FloatArray, count: int) -> FloatArray:
    return np.convolve(values, np.full(count + 1, 1.0 / (count + 1)), "valid")


READINGS: dict[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "yaw or y has the wrong sign": lambda track, yaw: track + yaw,
    "x and y are exchanged, or yaw is measured from east towards north as in `frame: enu`": (
        lambda track, yaw: track + yaw - 0.5 * np.pi
    ),
    "yaw points to the tail": lambda track, yaw: track - yaw - np.pi,
    "yaw is zero at east": lambda track, yaw: track - yaw - 0.5 * np.pi,
    "yaw is zero at west": lambda track, yaw: track - yaw + 0.5 * np.pi,
    "x has the wrong sign": lambda track, yaw: track + yaw - np.pi,
    "yaw is in radians but declared as degrees": lambda track, yaw: track - np.degrees(yaw),
    "yaw is in degrees but declared as radians": lambda track, yaw: track - np.radians(yaw),
}
"""Mistakes, and by how much path and heading then differ (rad)."""


def _check_heading(dataset: Dataset) -> None:
    """Refuse a heading that does not point along the path, if another reading of it does."""
    travels = list(_travels(dataset))
    if not travels:
        return
    track, yaw, speed = (
        np.concatenate([getattr(t, name) for t in travels]) for name in ("track", "yaw", "speed")
    )
    moving = speed > SLOWEST
    if moving.sum() < 50:
        return
    declared = float(np.mean(np.cos(track - yaw)[moving]))
    if declared > ASTRAY:
        return
    cosines = {
        words: float(np.mean(np.cos(read(track, yaw))[moving])) for words, read in READINGS.items()
    }
    best = max(cosines, key=lambda words: cosines[words])
    if cosines[best] > ALIGNED:
        raise DatasetError(
            f"{dataset.name}: the path does not follow yaw (mean cosine {declared:.2f}), and would "
            f"({cosines[best]:.2f}) if {best}; correct the column or what is declared of it"
        )


def _check_climb(dataset: Dataset) -> None:
    """Refuse a depth that grows whenever the nose points up."""
    found = []
    for t in _travels(dataset):
        assert t.sinking is not None
        assert t.pitch is not None
        expected = -t.speed * np.tan(t.pitch)
        if len(expected) >= 50 and expected.std() > CLIMBING and t.sinking.std() > 0.0:
            found.append(float(np.corrcoef(expected, t.sinking)[0, 1]))
    if len(found) >= 2 and np.mean(found) < SINKING and np.mean(np.array(found) < 0.0) > 0.8:
        raise DatasetError(
            f"{dataset.name}: the fish goes down whenever pitch points up (correlation "
            f"{np.mean(found):.2f}); z grows downwards and pitch is positive nose up in frame ned. "
            "If z is a height, reverse it or declare the whole dataset as `frame: enu`"
        )
