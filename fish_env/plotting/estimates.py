"""Estimates of a fit and their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fish_env.plotting.style import BLUE, PALE, VERMILION, drawing, files_of, save

NAME = "estimates"
Row = tuple[str, float, float, float, float]
"""Name, value before, estimate, and ends of its 95 % interval."""


def picture_files(folder: Path) -> list[Path]:
    """The files that :func:`draw_estimates` writes into a folder."""
    return files_of(folder, [NAME])


def draw_estimates(rows: Sequence[Row], title: str, folder: Path) -> Path:
    """Estimates and intervals in units of the value before, or of the estimate where that was 0.

    Args:
        rows: One for each parameter, SI.
        title: Heading.
        folder: Where the picture goes.
    """
    with drawing(7.2, 0.8 + 0.22 * max(4, len(rows))) as figure:
        ax = figure.subplots()
        for place, (_, before, value, low, high) in enumerate(rows):
            unit = abs(before) or abs(value) or 1.0
            ax.plot(np.array([low, high]) / unit, [place, place], color=BLUE, alpha=PALE, lw=4)
            ax.plot(value / unit, place, "o", color=BLUE, ms=4)
            ax.plot(before / unit, place, "|", color=VERMILION, ms=10)
        ax.set_yticks(range(len(rows)), [row[0] for row in rows])
        ax.set_ylim(len(rows) - 0.5, -0.5)
        ax.set_xlabel("relative to the value before (|); bars: 95 % intervals")
        ax.set_title(title, loc="left")
        return save(figure, folder, NAME)
