"""A picture of each imported run: every channel and command as the simulator will read it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fish_env.comparison.words import shown_unit
from fish_env.data import COMMANDS, Dataset, Run
from fish_env.plotting.comparison import COMMAND_UNITS, label
from fish_env.plotting.style import BLUE, MEASURED, drawing, files_of, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW, _ABOVE, _BELOW = 0.95, 0.65, 0.5
"""Inches for each channel or command, above all and below."""


def picture_files(dataset: Dataset, folder: Path) -> list[Path]:
    """The files that :func:`draw_imported` writes into a folder."""
    return files_of(folder, map(_name, dataset.runs), ["png"])


def _name(run: Run) -> str:
    return f"import-{run.id}"


def draw_imported(dataset: Dataset, folder: Path) -> list[Path]:
    """Draws each run as `import-<run>.png`.

    Args:
        dataset: The runs.
        folder: Where to write; made if it is not there.

    Returns:
        The pictures.
    """
    return [draw_imported_run(run, folder) for run in dataset.runs]


def draw_imported_run(run: Run, folder: Path) -> Path:
    """Draws all channels, then all commands of a run over time."""
    names = [*run.channels, *COMMANDS]
    height = _ABOVE + _BELOW + _ROW * len(names)
    with drawing(8.0, height) as figure:
        # So many axes take seconds to be laid out by their contents.
        figure.set_layout_engine("none")
        edges = {"top": 1.0 - _ABOVE / height, "bottom": _BELOW / height}
        grid = {"left": 0.29, "right": 0.98, "hspace": 0.35, **edges}
        axes = figure.subplots(len(names), 1, sharex=True, squeeze=False, gridspec_kw=grid)[:, 0]
        for ax, name in zip(axes, names, strict=True):
            if name in run.channels:
                _draw_channel(ax, run, name)
            else:
                _draw_command(ax, run, name)
            ax.set_ylabel(ax.get_ylabel().replace(" (", "\n("), rotation=0, ha="right", va="center")
            ax.yaxis.set_label_coords(-0.14, 0.5)
        axes[-1].set_xlabel("time (s)")
        figure.suptitle(
            f"{run.id}\nchannels (points) and commands (lines) as the simulator reads them: north, "
            "east, down; forward, starboard, down",
            fontsize=9,
            y=1.0 - 0.1 / height,
        )
        return save(figure, folder, _name(run), ("png",))


def _draw_channel(ax: Axes, run: Run, name: str) -> None:
    values = shown_unit(name)[1] * run.channels[name]
    present = np.isfinite(values)
    ax.plot(run.time_s[present], values[present], ".", ms=2.0, color=MEASURED)
    ax.set_ylabel(label(name))
    ax.set_title(f"{present.sum()} samples", loc="right", fontsize=7, pad=1)


def _draw_command(ax: Axes, run: Run, name: str) -> None:
    unit, factor = COMMAND_UNITS[name]
    values = factor * run.commands.at(run.time_s)[:, list(COMMANDS).index(name)]
    ax.step(run.time_s, values, where="post", color=BLUE)
    ax.set_ylabel(f"{name.replace('_', ' ')} ({unit})")
    if np.ptp(values) == 0.0:
        ax.set_title(f"constant, {values[0]:g} {unit}", loc="right", fontsize=7, pad=1)
