"""Figures of the report: each an SVG and a PNG, in the project's style."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.headline import many_fitted
from fish_env.diagnosis.policy import CHECKS
from fish_env.diagnosis.regimes import Localisation
from fish_env.diagnosis.report.series import RunSeries, SteadySeries
from fish_env.diagnosis.report.units import label, shown_unit
from fish_env.files import file_name, replacing
from fish_env.inference.hypotheses import short_name
from fish_env.plotting.comparison import COMMAND_UNITS
from fish_env.plotting.style import BLUE, DOTS_PER_INCH, MEASURED, VERMILION, drawing, keep_literal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

BASELINE, EXTENDED = VERMILION, BLUE
HATCH = "#fefefe"
"""Colour of hatches. The page gives them the colour of its ground; it makes white transparent."""
Plain = Mapping[str, Any]
MAPS, PITCH = 4, 1.15
"""Maps of regimes beside each other, and from one to the next in widths of a map."""
LEADING = "paths"
"""The figure that is always a PNG too."""
WIDE = 30.0
"""Largest ratio of bars on a linear axis."""
LOOKS: dict[str, dict[str, Any]] = {
    "measured": {"color": MEASURED, "lw": 3.5, "alpha": 0.3},
    "baseline": {"color": BASELINE, "ls": "--"},
    "extended": {"color": EXTENDED},
}
LEFT_OUT_GAIN = "log score on {} left out, above the refitted baseline's"


@dataclass(frozen=True)
class Album:
    """Where figures go.

    Attributes:
        folder: Their folder.
        bitmaps: Whether each is a PNG too, not only an SVG.
        written: The files written so far.
    """

    folder: Path
    bitmaps: bool = True
    written: list[Path] = field(default_factory=list)


@contextmanager
def sheet(width: float, height: float) -> Iterator[Figure]:
    """A figure whose SVG keeps its words as text and gets the same names every time."""
    import matplotlib

    with (
        matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "robofish"}),
        drawing(width, height) as figure,
    ):
        yield figure


def saved(figure: Figure, album: Album, name: str) -> Path:
    """Writes the figure and returns the path of the SVG."""
    keep_literal(figure)
    vector = album.folder / f"{name}.svg"
    engine = figure.get_layout_engine()
    if engine is not None:
        # What was laid out stays. With an engine, even one that does nothing, it is drawn twice.
        engine.execute(figure)
        figure.set_layout_engine(None)
    with replacing(vector) as part:
        figure.savefig(part)
    album.written.append(vector)
    if album.bitmaps or name == LEADING:
        bitmap = album.folder / f"{name}.png"
        with replacing(bitmap) as part:
            figure.savefig(part, dpi=DOTS_PER_INCH)
        album.written.append(bitmap)
    return vector


def draw_run(run: RunSeries, window_s: float, album: Album) -> Path:
    """Channels of a run over time: measured, and predicted over windows."""
    names = list(run.measured)
    columns = 2 if len(names) > 4 else 1
    rows = -(-len(names) // columns)
    with sheet(8.6 if columns == 2 else 7.0, 0.6 + 1.3 * rows) as figure:
        axes = figure.subplots(rows, columns, squeeze=False, sharex=True)
        for ax, name in zip(axes.T.ravel(), names, strict=False):
            _draw_channel(ax, run, name, window_s)
        for ax in axes.T.ravel()[len(names) :]:
            ax.set_axis_off()
        for last in (rows - 1, *([len(names) - 1] if columns == 2 else [])):
            bottom = axes.T.ravel()[last]
            bottom.set_xlabel("time (s)")
            bottom.tick_params(labelbottom=True)
        handles, words = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside upper left", ncols=3)
        return saved(figure, album, f"run_{file_name(run.id)}")


def _draw_channel(ax: Axes, run: RunSeries, name: str, window_s: float) -> None:
    factor = shown_unit(name)[1]
    # A gap where a window begins, so that no line joins two predictions.
    begins = np.diff(np.floor(run.time_s / window_s + 1e-9), prepend=-1.0) > 0.0
    look = LOOKS["measured"]
    ax.plot(run.time_s, factor * run.measured[name], label="measured", **look)
    before = np.where(begins, np.nan, factor * run.baseline[name])
    ax.plot(run.time_s, before, "--", color=BASELINE, label="baseline")
    if name in run.extended:
        after = np.where(begins, np.nan, factor * run.extended[name])
        ax.plot(run.time_s, after, color=EXTENDED, label="extended")
    ax.set_ylabel(label(name))
    if name == "z":
        ax.invert_yaxis()


def draw_regimes(found: Localisation, album: Album) -> Path:
    """Residual energy by channel, one map for each regime; cells that stand out are framed."""
    from matplotlib.colors import LogNorm

    lines = [found.regimes[i : i + MAPS] for i in range(0, len(found.regimes), MAPS)]
    energies = np.concatenate([table.ravel() for table in found.energy.values()])
    top = float(np.sqrt(np.max(energies, initial=1.0, where=np.isfinite(energies))))
    norm = LogNorm(0.7, max(top, 1.5))
    with sheet(9.4, (0.9 + 0.2 * len(found.channels)) * len(lines) + 0.8) as figure:
        # One axes for a line of maps: many axes take long to lay out.
        axes = figure.subplots(len(lines), 1, squeeze=False).ravel()
        for ax, line in zip(axes, lines, strict=True):
            ticks: dict[float, str] = {}
            for i, regime in enumerate(line):
                image, edges = _draw_map(ax, found, regime.name, norm, PITCH * i)
                words = (f"{regime.factor * edge:.3g}" for edge in regime.edges)
                ticks.update(zip(edges.tolist(), words, strict=True))
                title = f"{regime.name.replace('_', ' ')} ({regime.unit})"
                ax.text(edges[0], -0.2, title, fontsize=8.5)
            ax.set_xlim(-0.01, PITCH * (MAPS - 1) + 1.01)
            ax.set_ylim(len(found.channels), 0)
            ax.set_xticks(list(ticks), list(ticks.values()), fontsize=7, rotation=45)
            ax.set_yticks(np.arange(len(found.channels)) + 0.5, found.channels, fontsize=8)
            ax.tick_params(axis="y", length=0)
            ax.spines[["left", "bottom"]].set_visible(False)
            ax.grid(False)
        bar = figure.colorbar(image, ax=axes, shrink=0.8, pad=0.01)
        bar.set_label("error of the refitted baseline\n(1: noise alone)")
        marks = [mark for mark in (1, 2, 3, 5, 10, 20, 30, 50, 100) if mark <= top]
        bar.set_ticks(marks or [1], labels=[str(mark) for mark in marks or [1]])
        bar.minorticks_off()
        return saved(figure, album, "regimes")


def _draw_map(
    ax: Axes, found: Localisation, name: str, norm: LogNorm, left: float
) -> tuple[QuadMesh, FloatArray]:
    """A map of unit width, and the edges of its columns."""
    from matplotlib.patches import Rectangle

    size = np.sqrt(found.energy[name])
    edges = left + np.linspace(0.0, 1.0, size.shape[1] + 1)
    wide = edges[1] - edges[0]
    image = ax.pcolormesh(edges, np.arange(len(size) + 1), size, cmap="cividis", norm=norm)
    for c, b in np.argwhere(np.isnan(size)):
        ax.add_patch(Rectangle((edges[b], c), wide, 1, fc="none", ec="#999999", hatch="////", lw=0))
    for c, b in np.argwhere(found.p_values[name] < CHECKS.regime_level):
        corner = (edges[b] + 0.04 * wide, c + 0.06)
        ax.add_patch(Rectangle(corner, 0.92 * wide, 0.88, fill=False, ec=VERMILION, lw=1.8))
    return image, edges


def draw_ranking(answer: Plain, album: Album) -> Path:
    """How much better each cause predicts held-out runs, with intervals if known."""
    rows = list(answer["ranking"])[::-1]
    accepted = {cause["name"] for cause in answer["causes"]}
    meaning = LEFT_OUT_GAIN.format("conditions" if answer.get("kind") == "steady" else "runs")
    gains = [row["score"] for row in rows]
    over_runs = many_fitted(answer)
    with sheet(7.0, 0.9 + 0.32 * len(rows)) as figure:
        ax = figure.subplots()
        for i, (row, gain) in enumerate(zip(rows, gains, strict=True)):
            found = row["name"] in accepted
            colour, hatch = (EXTENDED, "") if found else ("#8a8a8a", "//")
            ax.barh(i, gain, height=0.66, ec=HATCH, lw=0, color=colour, hatch=hatch)
            if row.get("ci95") and over_runs:
                ax.plot(row["ci95"], [i, i], color=MEASURED, lw=1.4, marker="|")
        names = [short_name(row["name"]) for row in rows]
        ax.set_yticks(range(len(rows)), names)
        ax.set_ylim(-0.7, len(rows) - 0.3)
        if min(gains) > 0 and max(gains) / min(gains) > WIDE:
            ax.set_xscale("log")
        ax.axvline(0.0, color=MEASURED, lw=0.8)
        ax.set_xlabel(meaning)
        ax.grid(axis="y", visible=False)
        return saved(figure, album, "ranking")


def draw_confusability(names: Sequence[str], cosines: FloatArray, album: Album) -> Path:
    """Cosine between the signals of every two causes, after a refit of the baseline."""
    side = 1.6 + 0.2 * len(names)
    with sheet(side + 1.2, side) as figure:
        ax = figure.subplots()
        image = ax.imshow(np.abs(cosines), cmap="cividis", vmin=0.0, vmax=1.0)
        ax.grid(False)
        ax.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
        ax.set_yticks(range(len(names)), names, fontsize=7)
        figure.colorbar(image, ax=ax, shrink=0.7).set_label("similarity (1: the same signal)")
        return saved(figure, album, "confusability")


def draw_misfit(answer: Plain, album: Album) -> Path:
    """Errors by channel in units of the noise, of the baseline and the best explanation."""
    names = list(answer["misfit"])
    pairs = [answer["misfit"][name] for name in names]
    extended = any(pair["baseline"] != pair["extended"] for pair in pairs)
    word = "extended" if answer["causes"] else "best explanation tried"
    with sheet(7.0, 2.6) as figure:
        ax = figure.subplots()
        place = np.arange(len(names))
        width = 0.38 if extended else 0.6
        shift = width / 2 if extended else 0.0
        before = [pair["baseline"] for pair in pairs]
        ax.bar(place - shift, before, width, color=BASELINE, hatch="//", ec=HATCH, lw=0,
               label="refitted baseline")  # fmt: skip
        if extended:
            after = [pair["extended"] for pair in pairs]
            ax.bar(place + shift, after, width, color=EXTENDED, label=word)
        ax.axhline(1.0, color=MEASURED, lw=1.0, ls=":", label="noise alone")
        ax.set_xticks(place, [name.replace("_", " ") for name in names])
        ax.set_ylabel("error (noise sd)")
        ax.grid(axis="x", visible=False)
        figure.legend(loc="outside upper left", ncols=3)
        ax.set_ylim(0.0, 1.05 * max([*before, 1.0]))
        return saved(figure, album, "misfit")


def draw_gain(runs: Mapping[str, tuple[float, float]], album: Album) -> Path:
    """Fit percent of each final run: from the refitted baseline to the extended model."""
    with sheet(7.0, 1.0 + 0.34 * len(runs)) as figure:
        ax = figure.subplots()
        for i, (before, after) in enumerate(runs.values()):
            ax.annotate(
                "", (after, i), (before, i),
                arrowprops={"arrowstyle": "-|>", "color": "#8a8a8a", "lw": 1.2, "shrinkB": 5},
            )  # fmt: skip
            ax.plot(before, i, "s", ms=7, color=BASELINE, label="" if i else "refitted baseline")
            ax.plot(after, i, "o", ms=8, color=EXTENDED, label="" if i else "extended")
        ax.set_yticks(range(len(runs)), list(runs))
        ax.set_ylim(len(runs) - 0.5, -0.5)
        ax.axvline(100.0, color=MEASURED, lw=1.0, ls=":")
        ax.set_xlabel("fit of predictions over windows (%, 100: perfect)")
        figure.legend(loc="outside upper left", ncols=2)
        return saved(figure, album, "gain")


def draw_schedule(schedule: Sequence[Mapping[str, float]], album: Album) -> Path:
    """Commands of the next experiment over time."""
    varied = [n for n in COMMANDS if len({row.get(n, 0.0) for row in schedule}) > 1]
    shown = varied or ["tail_amplitude", "tail_frequency"]
    times = np.array([row["t"] for row in schedule])
    hold = float(np.median(np.diff(times))) if len(times) > 1 else 5.0
    with sheet(7.0, 0.5 + 1.15 * len(shown)) as figure:
        axes = figure.subplots(len(shown), 1, squeeze=False, sharex=True).ravel()
        for ax, name in zip(axes, shown, strict=True):
            unit, factor = COMMAND_UNITS[name]
            values = factor * np.array([row.get(name, 0.0) for row in schedule])
            ax.step(np.r_[times, times[-1] + hold], np.r_[values, values[-1:]], where="post",
                    color=EXTENDED, lw=1.8)  # fmt: skip
            ax.set_ylabel(f"{name.replace('_', ' ')}\n({unit})", fontsize=8)
            ax.margins(y=0.15)
        axes[-1].set_xlabel("time (s)")
        figure.align_ylabels()
        return saved(figure, album, "next_experiment")


def draw_steady(series: SteadySeries, album: Album) -> Path:
    """Predicted over measured values; held-out rows are filled."""
    names = list(series.measured)
    models = {"baseline": (series.baseline, BASELINE, "s")}
    if series.extended:
        models["extended"] = (series.extended, EXTENDED, "o")
    kept = series.left_out if series.left_out.size else np.zeros(len(series.conditions), bool)
    with sheet(3.1 * len(names) + 0.4, 3.6) as figure:
        axes = figure.subplots(1, len(names), squeeze=False).ravel()
        for ax, name in zip(axes, names, strict=True):
            factor = shown_unit(name)[1]
            measured = factor * series.measured[name]
            for word, (values, colour, mark) in models.items():
                for rows, filled in ((~kept, False), (kept, True)):
                    if rows.any():
                        ax.plot(
                            measured[rows], factor * values[name][rows], mark, ms=5, color=colour,
                            mfc=colour if filled else "none",
                            label=f"{word}, {'left out' if filled else 'fitted'}",
                        )  # fmt: skip
            ends = [float(np.nanmin(measured)), float(np.nanmax(measured))]
            ax.plot(ends, ends, color=MEASURED, lw=1.0)
            ax.set_xlabel(f"measured {label(name)}")
            ax.set_ylabel(f"predicted {label(name)}")
        handles, words = axes[0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside upper left", ncols=2)
        return saved(figure, album, "steady")
