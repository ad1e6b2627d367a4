"""The paper's figures, drawn from the model's simulations; measured panels are not available."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.plotting.style import (
    BLACK,
    BLUE,
    COLOUR_MAP,
    GREEN,
    VERMILION,
    colours,
    drawing,
    files_of,
    save,
)
from fish_env.studies.paper import ranges
from fish_env.studies.paper.motions import SERIES_HZ, Map, Study
from fish_env.studies.paper.series import beat_means, velocity_inertial
from fish_env.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DEG = 180.0 / np.pi
F1, OFFSET, DISPLACEMENT = "$f_1$ (Hz)", "tail offset (deg)", "$\\Delta d$ (cm)"
TIME = "time (s)"
NAMES = (
    "rectilinear_speed", "rectilinear_attitude", "rectilinear_paths", "turning_rate",
    "turning_radius", "turning_rates", "turning_servo_lag", "gliding_speed", "spiral_attitude",
    "spiral_velocity", "spiral_rate_and_speed", "spiral_path",
)  # fmt: skip
"""Names of all figures."""


def picture_files(folder: Path) -> list[Path]:
    """The files that :func:`draw_study` writes into a folder."""
    return files_of(folder, NAMES)


def draw_study(study: Study, folder: Path) -> list[Path]:
    """Draws every figure as PNG and PDF; returns the paths of the PNG files."""
    straight, turning = study.straight.motion, study.turning.motion
    return [
        _surface(
            study.straight,
            straight["horizontal_speed"],
            "$A_1$ (deg)",
            "$U_r$ (m/s)",
            folder,
            "rectilinear_speed",
        ),
        _attitudes(study, folder),
        _straight_paths(study, folder),
        _surface(
            study.turning,
            np.abs(turning["yaw_rate"]),
            OFFSET,
            "$\\omega_t$ (rad/s)",
            folder,
            "turning_rate",
        ),
        _surface(
            study.turning, turning["turn_radius"], OFFSET, "$R_t$ (m)", folder, "turning_radius"
        ),
        _rates(study, folder),
        _rate_amplitudes(study, folder),
        _gliding(study, folder),
        _spiral_attitude(study, folder),
        _spiral_velocity(study, folder),
        _spiral_sweep(study, folder),
        _spiral_path(study, folder),
    ]


def _surface(
    data: Map, values: FloatArray, rows: str, quantity: str, folder: Path, name: str
) -> Path:
    """A surface and a map of one quantity over two commands."""
    with drawing(7.6, 3.3) as figure:
        grid = figure.add_gridspec(1, 2, width_ratios=(1.0, 1.15))
        solid = figure.add_subplot(grid[0], projection="3d")
        x, y = np.meshgrid(data.frequencies, data.rows)
        solid.plot_surface(x, y, values, cmap=COLOUR_MAP, edgecolor="#444444", linewidth=0.4)
        solid.set(xlabel=F1, ylabel=rows, zlabel=quantity)
        solid.view_init(elev=25, azim=-130)
        solid.set_xticks(data.frequencies[::2])
        solid.set_yticks(data.rows[:: 2 if len(data.rows) > 4 else 1])
        solid.tick_params(labelsize=7, pad=0)
        solid.set_box_aspect(None, zoom=0.78)
        flat = figure.add_subplot(grid[1])
        image = flat.pcolormesh(
            data.frequencies, data.rows, values, cmap=COLOUR_MAP, shading="nearest"
        )
        flat.grid(False)
        flat.set(xlabel=F1, ylabel=rows, xticks=data.frequencies, yticks=data.rows)
        _write_values(flat, data, values)
        figure.colorbar(image, ax=flat, label=quantity)
        return save(figure, folder, name)


def _write_values(ax: Axes, data: Map, values: FloatArray) -> None:
    middle = (values.max() + values.min()) / 2
    for (i, j), value in np.ndenumerate(values):
        colour = "white" if value < middle else "black"
        place = (data.frequencies[j], data.rows[i])
        ax.annotate(f"{value:.3f}", place, color=colour, ha="center", va="center", fontsize=7)


def _attitudes(study: Study, folder: Path) -> Path:
    """Roll, pitch and yaw over five seconds of steady swimming, one column for each combination."""
    rows = {"roll": "roll (deg)", "pitch": "pitch (deg)", "yaw": "yaw (deg)"}
    titles = [f"{a:g} deg, {f:g} Hz" for a, f in study.straight_series]
    return _panels(
        list(study.straight_series.values()), titles, rows, 5.0, folder, "rectilinear_attitude"
    )


def _rates(study: Study, folder: Path) -> Path:
    """Angular rates over three seconds of steady turning, one column for each combination."""
    rows = {"p": "roll rate (deg/s)", "q": "pitch rate (deg/s)", "r": "yaw rate (deg/s)"}
    titles = [f"{offset:+g} deg, {f:g} Hz" for offset, f in study.turning_series]
    return _panels(list(study.turning_series.values()), titles, rows, 3.0, folder, "turning_rates")


def _panels(
    runs: list[Trajectory],
    titles: list[str],
    rows: dict[str, str],
    span_s: float,
    folder: Path,
    name: str,
) -> Path:
    with drawing(1.55 * len(runs) + 0.6, 4.4) as figure:
        axes = figure.subplots(len(rows), len(runs), sharex=True, sharey="row")
        last = int(span_s * SERIES_HZ) + 1
        for column, (run, title) in enumerate(zip(runs, titles, strict=True)):
            for row, (channel, label) in enumerate(rows.items()):
                ax = axes[row, column]
                ax.plot(run.time_s[-last:], DEG * run[channel][-last:], color=BLUE)
                if column == 0:
                    ax.set_ylabel(label)
            axes[0, column].set_title(title)
        figure.align_ylabels()
        figure.supxlabel(TIME, fontsize=9)
        return save(figure, folder, name)


def _straight_paths(study: Study, folder: Path) -> Path:
    with drawing(7.2, 3.0) as figure:
        ax = figure.subplots()
        for (amplitude, frequency), run in study.straight_series.items():
            ax.plot(run["x"], 100 * run["y"], label=f"{amplitude:g} deg, {frequency:g} Hz")
        ax.set(xlabel="x (m)", ylabel="y (cm, stretched)")
        ax.set_title("one minute from rest", loc="left")
        figure.legend(loc="outside right upper", title="$A_1$, $f_1$")
        return save(figure, folder, "rectilinear_paths")


def _rate_amplitudes(study: Study, folder: Path) -> Path:
    """Rate amplitudes over frequency at the middle offset, with and without servo lag."""
    middle = len(ranges.OFFSETS_DEG) // 2
    variants = {0.0: study.turning, **study.lagged}
    panels = ("yaw_rate_amplitude", "roll_rate_amplitude", "pitch_rate_amplitude", "yaw_rate")
    with drawing(8.6, 2.8) as figure:
        axes = figure.subplots(1, len(panels))
        shades = [BLACK, *colours(len(study.lagged) + 3)[: len(study.lagged)]]
        for ax, quantity in zip(axes, panels, strict=True):
            for (lag, data), colour in zip(variants.items(), shades, strict=True):
                values = DEG * np.abs(data.motion[quantity][middle])
                label = f"{lag:g} s" if lag else "none"
                ax.plot(data.frequencies, values, "o-", ms=3, color=colour, label=label)
            ax.set_title(quantity.replace("_", " "), loc="left")
            ax.set(xlabel=F1, ylim=(0, None))
        axes[0].set_ylabel("deg/s")
        handles = axes[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside right center", title="servo lag")
        figure.suptitle(f"turning, offset {ranges.OFFSETS_DEG[middle]:g} deg", fontsize=9.5)
        return save(figure, folder, "turning_servo_lag")


def _gliding(study: Study, folder: Path) -> Path:
    fast = study.accelerating
    with drawing(5.2, 3.2) as figure:
        ax = figure.subplots()
        ax.plot(
            study.gliding.displacements_cm,
            study.gliding.motion["speed"],
            "o-",
            color=BLUE,
            label="uniform motion",
        )
        ax.plot(
            fast.displacements_cm,
            fast.mean_speed,
            "s--",
            color=VERMILION,
            label="mean from rest to the tank's depth",
        )
        ax.plot(
            fast.displacements_cm,
            fast.uniform_speed,
            "o",
            mfc="none",
            color=BLUE,
            label="uniform motion, if deep enough",
        )
        ax.set(
            xlabel=DISPLACEMENT,
            ylabel="$U_g$ (m/s)",
            ylim=(0, 1.1 * study.gliding.motion["speed"].max()),
        )
        ax.legend(loc="lower right")
        return save(figure, folder, "gliding_speed")


def _spiral_attitude(study: Study, folder: Path) -> Path:
    run = study.spiral_series
    with drawing(7.2, 4.0) as figure:
        axes = figure.subplots(3, 1, sharex=True)
        for ax, angle in zip(axes, ("roll", "pitch", "yaw"), strict=True):
            ax.plot(run.time_s, DEG * run[angle], color=BLUE, lw=0.8)
            ax.set_ylabel(f"{angle} (deg)")
        axes[-1].set_xlabel(TIME)
        figure.align_ylabels()
        return save(figure, folder, "spiral_attitude")


def _spiral_velocity(study: Study, folder: Path) -> Path:
    """Inertial velocity: as it is, and its means over tail beats."""
    run, frequency = study.spiral_series, ranges.SPIRAL_HZ
    with drawing(7.2, 4.0) as figure:
        axes = figure.subplots(3, 1, sharex=True)
        names = ("$V_{Ix}$ (m/s)", "$V_{Iy}$ (m/s)", "$V_{Iz}$ (m/s)")
        for ax, name, values in zip(axes, names, velocity_inertial(run), strict=True):
            means = beat_means(values, frequency)
            middles = (np.arange(len(means)) + 0.5) / frequency
            ax.plot(run.time_s, values, color="#9ecae1", lw=0.6, label="as it is")
            ax.plot(middles, means, color=BLUE, label="mean per beat")
            ax.set_ylabel(name)
        axes[-1].set_xlabel(TIME)
        figure.align_ylabels()
        handles = axes[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside upper right", ncols=2)
        return save(figure, folder, "spiral_velocity")


def _spiral_sweep(study: Study, folder: Path) -> Path:
    with drawing(7.2, 2.8) as figure:
        axes = figure.subplots(1, 2)
        labels = {"yaw_rate": "$\\omega_s$ (rad/s)", "speed": "$U_s$ (m/s)"}
        for ax, (name, label) in zip(axes, labels.items(), strict=True):
            values = np.abs(study.spiral.motion[name])
            ax.plot(study.spiral.displacements_cm, values, "o-", color=BLUE)
            ax.set(xlabel=DISPLACEMENT, ylabel=label, ylim=(0, 1.2 * values.max()))
        return save(figure, folder, "spiral_rate_and_speed")


def _spiral_path(study: Study, folder: Path) -> Path:
    run = study.spiral_series
    with drawing(4.6, 4.2) as figure:
        ax = figure.add_subplot(projection="3d")
        ax.plot(run["x"], run["y"], run["z"], color=BLUE)
        ax.plot(run["x"][:1], run["y"][:1], run["z"][:1], "o", color=GREEN, label="start")
        ax.set(xlabel="x (m)", ylabel="y (m)", zlabel="depth z (m)")
        ax.locator_params(nbins=5)
        ax.invert_zaxis()
        ax.invert_yaxis()
        ax.set_box_aspect(None, zoom=0.85)
        ax.legend(loc="upper left", bbox_to_anchor=(0.1, 0.9))
        return save(figure, folder, "spiral_path")
