"""Trim curves: attitude and depth rate over the place of the weight block."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from fish_env.plotting.style import BLACK, drawing, save, shades

DEG = 180.0 / np.pi


@dataclass(frozen=True, eq=False)
class TrimCurve:
    """Steady motion over one coordinate of the block, the other in the middle.

    Attributes:
        block: (n,) displacement (m) or angle (rad).
        rest_pitch: (n,) at which the fish hangs with its tail still (rad).
        rest_roll: (n,) the same.
        frequencies: (f,) of the tail (Hz).
        motion: pitch, roll (rad) and vertical_speed (m/s, down), each (f, n).
    """

    block: FloatArray
    rest_pitch: FloatArray
    rest_roll: FloatArray
    frequencies: FloatArray
    motion: Mapping[str, FloatArray]


def draw_trim(
    displacement: TrimCurve, angle: TrimCurve, title: str, folder: Path, formats: tuple[str, ...]
) -> Path:
    """Pitch, roll and depth rate over displacement (left) and angle (right).

    Args:
        displacement: over the block's displacement.
        angle: over its angle.
        title: fish and amplitude.
        folder: where `trim.<format>` goes.
        formats: endings.
    """
    with drawing(6.4, 6.2) as figure:
        axes = figure.subplots(3, 2, sharex="col", sharey="row")
        _draw(axes[:, 0], displacement, 100.0)
        _draw(axes[:, 1], angle, DEG)
        for ax, label in zip(
            axes[:, 0], ("pitch (deg)", "roll (deg)", "depth rate (cm/s, down)"), strict=True
        ):
            ax.set_ylabel(label)
        axes[-1, 0].set_xlabel("block displacement, aft (cm)")
        axes[-1, 1].set_xlabel("block angle (deg)")
        figure.align_ylabels(axes[:, 0])
        figure.suptitle(title, fontsize=9.5)
        handles = axes[0, 0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=len(handles[0]))
        return save(figure, folder, "trim", formats)


def _draw(axes: npt.NDArray[np.object_], curve: TrimCurve, factor: float) -> None:
    pitch, roll, depth = axes
    across = factor * curve.block
    for i, colour in enumerate(shades(len(curve.frequencies))):
        # Lines often lie upon each other: later markers are smaller, so that none is hidden.
        look = {"marker": "o", "ms": 6.0 - 1.5 * i, "color": colour}
        label = f"{curve.frequencies[i]:g} Hz"
        pitch.plot(across, DEG * curve.motion["pitch"][i], **look, label=label)
        roll.plot(across, DEG * curve.motion["roll"][i], **look, label=label)
        depth.plot(across, 100.0 * curve.motion["vertical_speed"][i], **look, label=label)
    still = {"ls": (0, (4, 4)), "lw": 0.9, "color": BLACK, "label": "tail still"}
    pitch.plot(across, DEG * curve.rest_pitch, **still)
    roll.plot(across, DEG * curve.rest_roll, **still)
