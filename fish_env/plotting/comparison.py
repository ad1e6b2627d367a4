"""Pictures of simulated against measured motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.comparison import RunComparison, RunsComparison, SteadyComparison
from fish_env.comparison.words import shown_unit
from fish_env.data import COMMANDS, Dataset, Run, SteadyDataset
from fish_env.files import file_name
from fish_env.plotting.style import MEASURED, SIMULATED, colours, drawing, files_of, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

Comparison = RunsComparison | SteadyComparison
PATHS, AGREEMENT, OVER_COMMANDS = "paths", "agreement", "over_commands"
"""Names of pictures of all runs, or of a steady table."""
COMMAND_UNITS = {
    "tail_offset": ("deg", 180.0 / np.pi),
    "tail_amplitude": ("deg", 180.0 / np.pi),
    "tail_frequency": ("Hz", 1.0),
    "block_displacement": ("cm", 100.0),
    "block_angle": ("deg", 180.0 / np.pi),
}
"""Unit a command is shown in, and how many of them make one SI unit."""


def label(name: str) -> str:
    """Axis label of a channel or observation, with its unit."""
    return f"{name.replace('_', ' ')} ({shown_unit(name)[0]})"


def picture_files(compared: Dataset | SteadyDataset | Comparison, folder: Path) -> list[Path]:
    """The files that :func:`draw_runs` or :func:`draw_steady` write.

    Args:
        compared: The comparison, or the data before it is made.
        folder: Where they go.
    """
    if isinstance(compared, SteadyDataset | SteadyComparison):
        return files_of(folder, [AGREEMENT, OVER_COMMANDS])
    first = compared.runs[0]
    places = {"x", "y"} <= set(first.channels if isinstance(first, Run) else first.measured)
    of_runs = files_of(folder, [_run_name(run.id) for run in compared.runs], ["png"])
    return [*of_runs, *files_of(folder, [PATHS] if places else [])]


def _run_name(id: str) -> str:
    return f"run_{file_name(id)}"


def draw_runs(comparison: RunsComparison, folder: Path) -> list[Path]:
    """One picture for each run and, if positions were measured, one of all paths."""
    written = [draw_run(run, folder) for run in comparison.runs]
    if comparison.runs[0].path_error_m.size:
        written.insert(0, draw_paths(comparison, folder))
    return written


def draw_run(run: RunComparison, folder: Path) -> Path:
    """Channels over time, and the path where x and y were measured."""
    names = list(run.errors)
    with drawing(8.0, max(2.6, 1.5 * len(names))) as figure:
        with_path = bool(run.path_error_m.size)
        grid = figure.add_gridspec(
            len(names), 2 if with_path else 1, width_ratios=(3, 2)[: 2 if with_path else 1]
        )
        first: Axes | None = None
        for row, name in enumerate(names):
            ax = figure.add_subplot(grid[row, 0], sharex=first)
            first = first or ax
            _draw_channel(ax, run, name)
            ax.tick_params(labelbottom=row == len(names) - 1)
        ax.set_xlabel("time (s)")
        if with_path:
            path = figure.add_subplot(grid[:, 1])
            _draw_path(path, run)
            path.legend(loc="best")
        figure.suptitle(f"{run.id}: measured and simulated", fontsize=10)
        return save(figure, folder, _run_name(run.id), ("png",))


def _draw_channel(ax: Axes, run: RunComparison, name: str) -> None:
    factor = shown_unit(name)[1]
    ax.plot(run.time_s, factor * run.measured[name], ".", ms=2.5, color=MEASURED, label="measured")
    ax.plot(run.time_s, factor * run.simulated[name], color=SIMULATED, label="simulated")
    ax.set_ylabel(label(name))
    if name == "z":
        ax.invert_yaxis()  # depth downwards, as in reports
    fit = run.errors[name].fit_percent
    ax.set_title(f"fit {fit:.0f} %" if np.isfinite(fit) else "", loc="right", fontsize=8, pad=2)


def _draw_path(ax: Axes, run: RunComparison) -> None:
    ax.plot(run.measured["y"], run.measured["x"], ".", ms=2.5, color=MEASURED, label="measured")
    ax.plot(run.simulated["y"], run.simulated["x"], color=SIMULATED, label="simulated")
    ax.plot(run.measured["y"][:1], run.measured["x"][:1], "o", ms=5, mfc="white", color=MEASURED)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("y, east (m)")
    ax.set_ylabel("x, north (m)")


def draw_paths(comparison: RunsComparison, folder: Path) -> Path:
    """Paths of all runs, one panel for each condition."""
    groups = comparison.by_condition()
    columns = min(4, len(groups))
    rows = -(-len(groups) // columns)
    with drawing(2.3 * columns, 2.1 * rows) as figure:
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for ax, (name, runs) in zip(axes, groups.items(), strict=False):
            for run in runs:
                _draw_path(ax, run)
            ax.set(xlabel="", ylabel="")
            ax.set_title(name, loc="left")
            ax.tick_params(labelsize=7)
        for ax in axes[len(groups) :]:
            ax.set_axis_off()
        figure.supxlabel("y, east (m)", fontsize=9)
        figure.supylabel("x, north (m)", fontsize=9)
        handles = axes[0].get_legend_handles_labels()
        figure.legend(handles[0][:2], handles[1][:2], loc="outside upper center", ncols=2)
        return save(figure, folder, PATHS)


def draw_steady(comparison: SteadyComparison, folder: Path) -> list[Path]:
    """Agreement of each observation, and each against the commands that were varied."""
    return [draw_agreement(comparison, folder), draw_over_commands(comparison, folder)]


def draw_agreement(comparison: SteadyComparison, folder: Path) -> Path:
    """Simulated over measured values, one panel for each observation."""
    names = list(comparison.observations)
    with drawing(2.9 * len(names), 3.2) as figure:
        axes = figure.subplots(1, len(names), squeeze=False).ravel()
        for ax, name in zip(axes, names, strict=True):
            observation = comparison.observations[name]
            factor = shown_unit(name)[1]
            used = np.isfinite(observation.error)
            measured, simulated = factor * observation.measured, factor * observation.simulated
            ends = np.array(
                [
                    np.min([measured[used], simulated[used]]),
                    np.max([measured[used], simulated[used]]),
                ]
            )
            ax.plot(ends, ends, color="#888888", lw=1.0)
            ax.plot(
                measured[used], simulated[used], "o", ms=4, color=SIMULATED, alpha=0.7, mec="none"
            )
            ax.set_xlabel(f"measured {label(name)}")
            ax.set_ylabel(f"simulated {label(name)}")
            ax.set_title(
                f"R$^2$ {observation.r_squared:.2f}, gain {observation.gain:.2f}", loc="left"
            )
            ax.set_aspect("equal", adjustable="datalim")
        return save(figure, folder, AGREEMENT)


def draw_over_commands(comparison: SteadyComparison, folder: Path) -> Path:
    """Measured and simulated values over the command with the most values.

    Colours tell the values of the command with the next most.
    """
    order = _varied(comparison.commands)
    names = list(comparison.observations)
    with drawing(3.0 * len(names), 3.4) as figure:
        axes = figure.subplots(1, len(names), squeeze=False).ravel()
        for ax, name in zip(axes, names, strict=True):
            _draw_over_command(ax, comparison, name, order)
        handles = _legend_handles(comparison.commands[:, order[1]], list(COMMANDS)[order[1]])
        figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), 5))
        return save(figure, folder, OVER_COMMANDS)


def _legend_handles(values: FloatArray, command: str) -> list[Line2D]:
    from matplotlib.lines import Line2D

    unit, factor = COMMAND_UNITS[command]
    levels = np.unique(values)
    kinds = [
        Line2D([], [], ls="", marker="o", mfc="none", color=MEASURED, label="measured"),
        Line2D([], [], color=MEASURED, label="simulated"),
    ]
    name = command.replace("_", " ")
    return kinds + [
        Line2D([], [], lw=4, color=colour, label=f"{name} {factor * level:.3g} {unit}")
        for colour, level in zip(colours(len(levels)), levels, strict=True)
    ]


def _varied(commands: FloatArray) -> list[int]:
    """Columns of the commands, the one with the most different values first."""
    return sorted(range(commands.shape[1]), key=lambda i: -len(np.unique(commands[:, i])))


def _draw_over_command(ax: Axes, comparison: SteadyComparison, name: str, order: list[int]) -> None:
    command = list(COMMANDS)[order[0]]
    unit, factor = COMMAND_UNITS[command]
    scale = shown_unit(name)[1]
    observation, others = comparison.observations[name], comparison.commands[:, order[1]]
    across, levels = factor * comparison.commands[:, order[0]], np.unique(others)
    for colour, level in zip(colours(len(levels)), levels, strict=True):
        rows = np.flatnonzero(others == level)
        rows = rows[np.argsort(across[rows], kind="stable")]
        measured, simulated = (
            scale * series[rows] for series in (observation.measured, observation.simulated)
        )
        ax.plot(across[rows], measured, "o", ms=4.5, mfc="none", color=colour)
        ax.plot(across[rows], simulated, color=colour)
    ax.set_xlabel(f"{command.replace('_', ' ')} ({unit})")
    ax.set_ylabel(label(name))
