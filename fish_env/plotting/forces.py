"""Forces and moments over one beat of the tail, term by term."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.plotting.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    colours,
    drawing,
    save,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GREY = "#777777"
GROUPS = {
    "tail lift": (("tail_lift",), BLUE),
    "tail drag": (("tail_drag",), SKY),
    "body lift": (("xz_lift", "xy_lift"), VERMILION),
    "body drag": (("xz_drag", "xy_drag"), ORANGE),
    "impact moment": (("impact",), PURPLE),
    "damping": (("damping",), GREEN),
    "weight and buoyancy": (("gravity", "buoyancy"), GREY),
    "inertia": (("inertial",), BLACK),
}
"""Lines of the picture: terms of the model that are drawn as one, and their colour."""
PANELS = (
    "surge force (N)",
    "sway force (N)",
    "heave force (N)",
    "roll moment (mN m)",
    "pitch moment (mN m)",
    "yaw moment (mN m)",
)


@dataclass(frozen=True, eq=False)
class Breakdown:
    """One beat.

    Attributes:
        phase: (T,) of the tail, from 0 to 2 pi (rad).
        terms: name of each term -> (T, 6): force (N) and moment about O_b (N m), body frame.
        title: fish and commands.
    """

    phase: FloatArray
    terms: Mapping[str, FloatArray]
    title: str


def draw_forces(breakdown: Breakdown, folder: Path, formats: tuple[str, ...]) -> Path:
    """One panel a force or moment, one line a term, and their sum.

    Args:
        breakdown: what to draw.
        folder: where `forces.<format>` goes.
        formats: endings.
    """
    lines = grouped(breakdown.terms)
    own = [name for name in lines if name not in GROUPS]
    paint = {name: colour for name, (_, colour) in GROUPS.items()}
    paint |= dict(zip(own, colours(len(own)), strict=True))
    with drawing(7.2, 4.6) as figure:
        axes = figure.subplots(2, 3, sharex=True).ravel()
        for i, (ax, label) in enumerate(zip(axes, PANELS, strict=True)):
            factor = 1.0 if i < 3 else 1000.0
            for name, values in lines.items():
                style = "--" if name in own else ":" if name == "inertia" else "-"
                ax.plot(
                    np.degrees(breakdown.phase), factor * values[:, i], style,
                    color=paint[name], label=name,
                )  # fmt: skip
            total = factor * sum(values[:, i] for values in lines.values())
            ax.plot(np.degrees(breakdown.phase), total, color=BLACK, lw=2.0, label="sum")
            _furnish(ax, label)
        for ax in axes[3:]:
            ax.set_xlabel("tail phase (deg)")
        figure.suptitle(breakdown.title, fontsize=9.5)
        handles = axes[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=5)
        return save(figure, folder, "forces", formats)


def _furnish(ax: Axes, label: str) -> None:
    ax.set(xlim=(0.0, 360.0), xticks=range(0, 361, 90))
    ax.set_ylabel(label)


def grouped(terms: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Terms summed as `GROUPS` says; those of effects stay alone, under their own name."""
    known = {term for members, _ in GROUPS.values() for term in members}
    lines = {
        name: np.sum([terms[term] for term in members], axis=0)
        for name, (members, _) in GROUPS.items()
    }
    return lines | {name.replace("_", " "): terms[name] for name in terms if name not in known}
