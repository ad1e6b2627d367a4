"""A small menu of manoeuvres to fly next, each showing something that the others do not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.vocabulary import COMMANDS

Rows = tuple[tuple[float, float, float, float, float, float], ...]
DURATION_S = 30.0
STROKE = 0.5
"""rad. Common tail amplitude; with 2 Hz its stroke is 6.3 rad/s, within a good servo's 8 to 10."""
SHIFT = 0.008
"""m. Block displacement that keeps a fish of this size within some twenty degrees of level."""
TURN = 0.5
"""rad. Block angle and tail offset."""


@dataclass(frozen=True)
class Manoeuvre:
    """A schedule from rest.

    Attributes:
        name: what it does.
        rows: (time, tail offset, amplitude, frequency, block displacement, block angle), SI; each
            holds until the next.
    """

    name: str
    rows: Rows

    @property
    def times_s(self) -> FloatArray:
        """Switch times, shape (m,)."""
        return np.array([row[0] for row in self.rows])

    @property
    def values(self) -> FloatArray:
        """Commands, shape (m, 5)."""
        return np.array([row[1:] for row in self.rows])

    @property
    def schedule(self) -> tuple[dict[str, float], ...]:
        """Rows by name, ``t`` in seconds."""
        return tuple(dict(zip(("t", *COMMANDS), row, strict=True)) for row in self.rows)


MENU = (
    Manoeuvre(
        "sweep the tail frequency",
        tuple(
            (5.0 * i, 0.0, 0.4, f, 0.0, 0.0) for i, f in enumerate((0.7, 1.1, 1.5, 1.9, 2.3, 0.7))
        ),
    ),
    Manoeuvre(
        "step the tail amplitude",
        tuple(
            (5.0 * i, 0.0, a, 1.5, 0.0, 0.0) for i, a in enumerate((0.1, 0.5, 0.2, 0.6, 0.15, 0.4))
        ),
    ),
    Manoeuvre(
        "turn left and right",
        tuple(
            (5.0 * i, d, STROKE, 1.5, 0.0, 0.0)
            for i, d in enumerate((TURN, -TURN, 0.25, -0.25, TURN, -TURN))
        ),
    ),
    Manoeuvre(
        "burst and coast",
        tuple((5.0 * i, 0.0, STROKE if i % 2 == 0 else 0.0, 2.0, 0.0, 0.0) for i in range(6)),
    ),
    Manoeuvre(
        "dive and climb",
        tuple(
            (3.0 * i, 0.0, 0.4, 1.5, s * SHIFT, 0.0)
            for i, s in enumerate((1, -1, 0.5, -0.5, 1, 0, -1, 0.5, 0, -0.5))
        ),
    ),
    Manoeuvre(
        "roll with the block",
        tuple(
            (3.0 * i, 0.0, 0.3, 1.2, 0.0, s * TURN)
            for i, s in enumerate((1, -1, 0, 0.5, -0.5, 1, 0, -1, 0.5, 0))
        ),
    ),
    Manoeuvre(
        "drift without the tail, moving the block",
        tuple(
            (5.0 * i, 0.0, 0.0, 1.0, s * SHIFT, a * TURN)
            for i, (s, a) in enumerate(((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (0, 0)))
        ),
    ),
)
