"""Figures that open the report: paths of whole runs, and the error budget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.diagnosis.report.figures import BASELINE, EXTENDED, HATCH, LOOKS, Album, saved, sheet
from fish_env.diagnosis.report.series import RunSeries
from fish_env.diagnosis.report.units import label, shown_unit
from fish_env.inference.hypotheses import short_name
from fish_env.replay import Motion

Plain = Mapping[str, Any]
PATHS: dict[str, dict[str, Any]] = {
    "measured": LOOKS["measured"],
    "simulated": LOOKS["baseline"],
    "refitted": LOOKS["extended"],
    "extended": LOOKS["extended"],
}
OVER_TIME = ("z", "yaw", "pitch", "roll", "r", "q", "p", "u", "v", "w", "x", "y")
"""Channels that are drawn over time beside the paths: the first that was measured."""
BUDGET_NAMES = {
    "coefficients": "re-estimated coefficients",
    "run_variation": "run-to-run variation",
}
RESIDUAL = "residual"
SHADES = (
    (EXTENDED, ""), (BASELINE, "//"), ("#009e73", ".."), ("#cc79a7", "xx"), ("#e69f00", "--"),
)  # fmt: skip
"""Colours and hatches of shares, told apart in black and white too."""


def draw_paths(runs: Sequence[RunSeries], album: Album) -> Path:
    """Whole runs: measured, simulated as the fish was given, and by the best explanation.

    From above where the position was measured, and one channel over time; else two channels.
    """
    flat = all({"x", "y"} <= set(run.measured) for run in runs)
    both = [n for n in OVER_TIME if all(n in run.measured for run in runs)]
    timed = both[: 1 if flat else 2]
    heights = (3,) * flat + (2,) * len(timed)
    with sheet(0.6 + 2.6 * max(len(runs), 2), 0.6 + 0.85 * sum(heights)) as figure:
        axes = figure.subplots(len(heights), len(runs), squeeze=False, height_ratios=heights)
        for column, run in zip(axes.T, runs, strict=True):
            for word, motion in _shown(run).items():
                if flat:
                    path = motion.frames.position
                    column[0].plot(path[:, 1], path[:, 0], label=word, **PATHS[word])
                for ax, name in zip(column[int(flat) :], timed, strict=True):
                    values = shown_unit(name)[1] * motion.channels[name]
                    ax.plot(motion.time_s, values, label=word, **PATHS[word])
            column[0].set_title(_title(run, flat), loc="left", fontsize=9)
            column[-1].set_xlabel("time (s)")
            if flat:
                column[0].set_aspect("equal", adjustable="datalim")
                column[0].set_xlabel("y, east (m)")
            if "z" in timed:
                column[int(flat)].invert_yaxis()
        names = ["x, north (m)"] * flat + [label(name) for name in timed]
        for ax, name in zip(axes[:, 0], names, strict=True):
            ax.set_ylabel(name)
        handles, words = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside upper left", ncols=3)
        return saved(figure, album, "paths")


def _shown(run: RunSeries) -> dict[str, Motion]:
    """Motions of the first picture by their word in the legend."""
    measured, *models = run.motions
    shown = {"measured": measured}
    if run.given is not None:
        shown["simulated"] = run.given
    if models:
        shown["extended" if models[-1].role == "extended" else "refitted"] = models[-1]
    return shown


def _title(run: RunSeries, flat: bool) -> str:
    name = f"{run.id} (held out)" if run.final else run.id
    if not flat:
        return name
    models = list(_shown(run).items())[1:]
    return "\n".join([name, *(f"{w}: up to {100 * _off(run, m):.1f} cm off" for w, m in models)])


def _off(run: RunSeries, motion: Motion) -> float:
    """Largest horizontal distance from the measured position, m."""
    count = len(motion.time_s)
    gaps = [motion.channels[n] - run.measured[n][-count:] for n in ("x", "y")]
    return float(np.nanmax(np.hypot(*gaps)))


def draw_budget(budget: Plain, album: Album) -> Path:
    """The error budget as one bar of shares, largest first, and the rest."""
    parts = {short_name(item["name"]): item["share"] for item in budget["shares"]}
    shares = {BUDGET_NAMES.get(n, n): max(v, 0.0) for n, v in parts.items()}
    shares = dict(sorted(shares.items(), key=lambda pair: -pair[1]))
    shares[RESIDUAL] = max(budget["left"], 0.0)
    total, begin = sum(shares.values()) or 1.0, 0.0
    with sheet(7.0, 1.1 + 0.2 * -(-len(shares) // 2)) as figure:
        ax = figure.subplots()
        for (name, share), (colour, hatch) in zip(shares.items(), cycle(SHADES)):
            if name == RESIDUAL:
                colour, hatch = "#dddddd", ""
            percent = 100.0 * share / total
            ax.barh(0, percent, left=begin, ec=HATCH, lw=0.8, height=0.8,
                    label=f"{name}: {percent:.0f} %", color=colour, hatch=hatch)  # fmt: skip
            begin += percent
        ax.set_xlim(0.0, 100.0)
        ax.set_yticks([])
        ax.spines["left"].set_visible(False)
        ax.grid(False)
        ax.set_xlabel("share of the error (%)")
        figure.legend(loc="outside upper left", ncols=2)
        return saved(figure, album, "budget")
