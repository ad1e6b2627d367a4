"""What is measured against what is expected, window by window, whatever it was expected from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.rigidbody.gridded import GridRun
from fish_env.rigidbody.policy import RECORDINGS

WINDOW_S = 5.0
"""s. Windows this long are nearly independent of each other."""

Part = tuple[GridRun, FloatArray, FloatArray, int]
"""A run, what was measured (n, d), what was expected (n, d), and the stride in steps."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """A measured and an expected motion, in windows.

    Attributes:
        name: "yaw against r" and the like.
        channels: columns that take part.
        error: (W,) sum of squared differences of each window.
        measured: (W,) sum of the squares of what was measured.
        expected: (W,) sum of the squares of what was expected.
    """

    name: str
    channels: tuple[str, ...]
    error: FloatArray
    measured: FloatArray
    expected: FloatArray

    @property
    def windows(self) -> int:
        """Number of windows."""
        return len(self.error)

    @property
    def disagreement(self) -> float:
        """0 where both are the same, 1 where they are unrelated, 2 where they are opposite."""
        total = float(self.measured.sum() + self.expected.sum())
        return float(self.error.sum()) / total if total > 0.0 else 1.0

    @property
    def ratio(self) -> float:
        """Measured over expected size."""
        return float(np.sqrt(self.measured.sum() / max(float(self.expected.sum()), 1e-300)))

    @property
    def likeness(self) -> float:
        """Correlation about zero, whatever the sizes of both."""
        m, g = float(self.measured.sum()), float(self.expected.sum())
        return 0.5 * (m + g - float(self.error.sum())) / max(float(np.sqrt(m * g)), 1e-300)


def compared(
    name: str, channels: Sequence[str], parts: Iterable[Part], centred: bool = False
) -> Comparison | None:
    """Compares runs.

    Args:
        name: of the comparison.
        channels: columns that take part.
        parts: measured and expected motion of each run.
        centred: take the mean of each run off both.

    Returns:
        The comparison; None where nothing can be compared.
    """
    found = []
    for run, measured, expected, stride in parts:
        if not len(measured):
            continue
        m, g = (np.reshape(a, (len(a), -1)) for a in (measured, expected))
        known = np.isfinite(m).all(axis=1) & np.isfinite(g).all(axis=1)
        if known.sum() < RECORDINGS.fewest_compared_points:
            continue
        if centred:
            m, g = m - m[known].mean(axis=0), g - g[known].mean(axis=0)
        window = (run.step_s * (np.flatnonzero(known) + 0.5 * stride) / WINDOW_S).astype(int)
        m, g = m[known], g[known]
        squares = [np.sum(a**2, axis=1) for a in (m - g, m, g)]
        sums = np.array([np.bincount(window, weights=a) for a in squares])
        enough = np.bincount(window) >= RECORDINGS.fewest_compared_points
        found.append(sums[:, enough])
    error, size, other = np.hstack([np.zeros((3, 0)), *found])
    if not np.any(size + other):
        return None
    return Comparison(name, tuple(channels), error, size, other)
