"""Swims side by side, each from rest: path, depth, speed, attitude and turning over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.plotting.style import BLUE, GREEN, PALE, VERMILION, drawing, save
from fish_env.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DEG = 180.0 / np.pi
PATH, DEPTH, SPEED, ATTITUDE, TURNING = range(5)


@dataclass(frozen=True, eq=False)
class Swim:
    """One column of the picture.

    Attributes:
        title: what the fish does.
        trajectory: from rest, sampled evenly.
        beat_samples: samples in one beat of the tail.
    """

    title: str
    trajectory: Trajectory
    beat_samples: int


def draw_motions(swims: Sequence[Swim], folder: Path, formats: tuple[str, ...]) -> Path:
    """One column a swim; pale lines are as it is, full ones means over a beat.

    Args:
        swims: from left to right.
        folder: where `motions.<format>` goes.
        formats: endings.
    """
    with drawing(1.85 * len(swims) + 0.3, 7.6) as figure:
        room = {"height_ratios": (1.25, 1, 1, 1, 1), "wspace": 0.12}
        axes = figure.subplots(5, len(swims), squeeze=False, gridspec_kw=room)
        for row in (DEPTH, SPEED, ATTITUDE, TURNING):
            for ax in axes[row, 1:]:
                ax.sharey(axes[row, 0])
        for column, swim in enumerate(swims):
            _draw_swim(axes[:, column], swim)
            axes[PATH, column].set_title(swim.title)
        _name(axes)
        figure.align_ylabels(axes[:, 0])
        return save(figure, folder, "motions", formats)


def _draw_swim(axes: npt.NDArray[np.object_], swim: Swim) -> None:
    t, time_s = swim.trajectory, swim.trajectory.time_s
    axes[PATH].plot(t["y"], t["x"], color=BLUE)
    axes[PATH].plot(t["y"][:1], t["x"][:1], "o", ms=4, mfc="white", color=BLUE)
    axes[PATH].set_aspect("equal", adjustable="datalim")
    axes[DEPTH].plot(time_s, t["z"] - t["z"][0], color=BLUE)
    _with_mean(axes[SPEED], swim, t["u"], BLUE)
    _with_mean(axes[ATTITUDE], swim, DEG * t["roll"], VERMILION, "roll")
    _with_mean(axes[ATTITUDE], swim, DEG * t["pitch"], GREEN, "pitch")
    _with_mean(axes[TURNING], swim, DEG * t["r"], BLUE)


def _with_mean(ax: Axes, swim: Swim, values: FloatArray, colour: str, label: str = "") -> None:
    time_s, beat = swim.trajectory.time_s, swim.beat_samples
    ax.plot(time_s, values, color=colour, lw=0.5, alpha=PALE)
    middle = 0.5 * (time_s[beat - 1 :] + time_s[: len(time_s) - beat + 1])
    ax.plot(middle, over_a_beat(values, beat), color=colour, label=label)


def over_a_beat(values: FloatArray, samples: int) -> FloatArray:
    """Running mean over the samples of one beat, shape (T - samples + 1,)."""
    return np.convolve(values, np.full(samples, 1.0 / samples), "valid")


def _name(axes: npt.NDArray[np.object_]) -> None:
    labels = ("x, north (m)", "depth change (m)", "surge (m/s)", "angle (deg)", "yaw rate (deg/s)")
    for ax, label in zip(axes[:, 0], labels, strict=True):
        ax.set_ylabel(label)
    for ax in axes[PATH]:
        ax.set_xlabel("y, east (m)")
    for ax in axes[DEPTH:, 1:].ravel():
        ax.tick_params(labelleft=False)
    for ax in axes[DEPTH:TURNING].ravel():
        ax.tick_params(labelbottom=False)
    for ax in axes[TURNING]:
        ax.set_xlabel("time (s)")
    axes[DEPTH, 0].invert_yaxis()
    axes[ATTITUDE, 0].legend(loc="best", ncols=2)
