"""Ratios that tell of clocks: of measured to commanded beats, and of angles to rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.diagnosis.inputs.orders import Stroke, Windows, bands, explained, windows_of
from fish_env.diagnosis.inputs.weighing import Weighed
from fish_env.diagnosis.policy import CHECKS

SIDE, REFINED = 0.12, 50
"""How far around a multiple it is refined, relative, and in how many steps."""
RATIOS = ("roll against p", "pitch against q", "yaw against r",
          "x against u, v, yaw", "y against u, v, yaw", "z against u, w, pitch")  # fmt: skip
"""Comparisons whose sizes grow with the clock."""


@dataclass(frozen=True)
class Ratio:
    """Measured over commanded tail frequency.

    Attributes:
        value: the ratio.
        sd: its standard error.
        clear: share of the sway at that ratio.
    """

    value: float
    sd: float
    clear: float


def beat_ratio(strokes: Sequence[Stroke]) -> Ratio | None:
    """The multiple of the commanded frequency at which some runs sway; None if none is clear."""
    best, share = 1.0, 0.0
    for multiples in bands():
        windows = windows_of(strokes, float(multiples[0]))
        if not windows:
            continue
        mean = explained(windows, multiples).mean(axis=0)
        if mean.max() > share:
            best, share = float(multiples[np.argmax(mean)]), float(mean.max())
    if share < CHECKS.clear_sway:
        return None
    return _refined(windows_of(strokes, best), best)


def ratio_near(strokes: Sequence[Stroke], near: float = 1.0) -> Ratio | None:
    """The same ratio, looked for close to where it is known to be."""
    windows = windows_of(strokes, near)
    found = _refined(windows, near) if windows else None
    return found if found is not None and found.clear >= CHECKS.clear_sway else None


def _refined(windows: Sequence[Windows], near: float) -> Ratio:
    """Mean over windows of where each explains most, weighted by how clearly it does."""
    shares, found = peaks_of(windows, near)
    total = shares.mean(axis=0)
    centre = int(np.argmax(total))
    known = np.isfinite(found[:, 0])
    if known.sum() < 2:
        return Ratio(float(_around(near)[centre]), SIDE * near, float(total[centre]))
    value, weight = found[known].T
    middle = float(np.median(value))
    kept = np.abs(value - middle) < CHECKS.far_peak * near
    value, weight = value[kept], weight[kept] / weight[kept].sum()
    mean = float(weight @ value)
    sd = float(np.sqrt(weight**2 @ (value - mean) ** 2 * len(value) / max(len(value) - 1, 1)))
    return Ratio(mean, max(sd, 1e-4), float(total[centre]))


def peaks_of(windows: Sequence[Windows], near: float) -> tuple[FloatArray, FloatArray]:
    """Where each window explains most, close to a multiple of the commanded frequency.

    Args:
        windows: N windows in all.
        near: the multiple.

    Returns:
        (N, m) share of the sway at each multiple tried, and (N, 2) the multiple with the largest
        share and its weight, NaN where no share is clear.
    """
    multiples = _around(near)
    shares = explained(windows, multiples)
    found = np.full((len(shares), 2), np.nan)
    for share, peak in zip(shares, found, strict=True):
        at = int(np.argmax(share))
        if 0 < at < len(multiples) - 1 and share[at] > CHECKS.clear_sway:
            peak[0] = _vertex(multiples[at - 1 : at + 2], share[at - 1 : at + 2])
            peak[1] = share[at] / (1.01 - share[at])
    return shares, found


def _around(near: float) -> FloatArray:
    return np.asarray(near * np.linspace(1.0 - SIDE, 1.0 + SIDE, 2 * REFINED + 1))


def _vertex(x: FloatArray, y: FloatArray) -> float:
    curve = y[0] - 2.0 * y[1] + y[2]
    shift = 0.5 * (y[0] - y[2]) / curve if curve < 0.0 else 0.0
    return float(x[1] + shift * (x[1] - x[0]))


def clock_ratio(weighed: Weighed) -> float | None:
    """How much faster angles and positions grow than rates and speeds say; None if unknown."""
    found = [c.ratio for name, c in weighed.comparisons.items()
             if name in RATIOS and c.likeness > CHECKS.clock_likeness]  # fmt: skip
    return float(np.median(found)) if found else None
