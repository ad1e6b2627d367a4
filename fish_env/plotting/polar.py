"""Polar diagrams: how fast a fish swims and turns, over the offset of its tail."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.plotting.style import drawing, save, shades

if TYPE_CHECKING:
    from matplotlib.projections.polar import PolarAxes

DEG = 180.0 / np.pi


@dataclass(frozen=True, eq=False)
class Polar:
    """Steady motion over the tail's offset, one line for each value of another command.

    Attributes:
        title: the command that is held.
        labels: of the lines, (n,).
        offsets: of the tail, increasing, (o,) rad.
        speed: horizontal, (n, o) m/s.
        yaw_rate: (n, o) rad/s.
    """

    title: str
    labels: tuple[str, ...]
    offsets: FloatArray
    speed: FloatArray
    yaw_rate: FloatArray


def draw_polar(polars: Sequence[Polar], title: str, folder: Path, formats: tuple[str, ...]) -> Path:
    """One column a :class:`Polar`: speed above, turning rate below; the angle is the offset.

    A positive offset, which turns the fish to port, is on the left.

    Args:
        polars: from left to right.
        title: of the picture.
        folder: where `polar.<format>` goes.
        formats: endings.
    """
    with drawing(3.6 * len(polars), 5.9) as figure:
        axes = figure.subplots(2, len(polars), squeeze=False, subplot_kw={"projection": "polar"})
        for polar, (above, below) in zip(polars, axes.T, strict=True):
            _draw(above, polar, 100.0 * polar.speed)
            _draw(below, polar, DEG * np.abs(polar.yaw_rate))
            above.set_title(polar.title, pad=8)
            above.legend(loc="lower left", bbox_to_anchor=(-0.15, -0.1))
        for row, label in zip(axes, ("speed (cm/s)", "turning rate (deg/s)"), strict=True):
            largest = max(ax.get_lines()[i].get_ydata().max() for ax in row for i in (0, -1))
            for ax in row:
                _furnish(ax, polars[0].offsets, largest, label)
        figure.suptitle(title, fontsize=9.5)
        return save(figure, folder, "polar", formats)


def _draw(ax: PolarAxes, polar: Polar, values: FloatArray) -> None:
    for colour, label, line in zip(shades(len(values)), polar.labels, values, strict=True):
        ax.plot(polar.offsets, line, color=colour, label=label)


def _furnish(ax: PolarAxes, offsets: FloatArray, largest: float, label: str) -> None:
    ax.set_theta_zero_location("N")
    ax.set_thetalim(offsets[0], offsets[-1])
    ax.set_thetagrids(np.arange(DEG * offsets[0], DEG * offsets[-1] + 1.0, 15.0))
    ax.set_rlim(0.0, 1.05 * largest)
    ax.tick_params(labelsize=7, pad=1)
    ax.set_xlabel("tail offset (deg)")
    ax.xaxis.set_label_coords(0.5, 1.0)  # above the arc
    ax.set_ylabel(label, rotation=45.0, ha="center", va="center")
    ax.yaxis.set_label_coords(0.88, 0.25)  # along the right edge, where its numbers are
