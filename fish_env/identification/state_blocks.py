"""Blocks of the filter's error state: declared once, dimensions and columns follow."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StateBlock:
    """Part of the error state.

    Attributes:
        name: what it is.
        size: number of columns.
        unit: SI.
        moved: whether the equations of motion move it; the others follow by themselves.
    """

    name: str
    size: int
    unit: str
    moved: bool


BLOCKS = (
    StateBlock("position", 3, "m", True),
    StateBlock("rotation", 3, "rad", True),
    StateBlock("velocity", 3, "m/s", True),
    StateBlock("rate", 3, "rad/s", True),
    StateBlock("disturbance", 6, "N, N m", False),
    StateBlock("tail_phase", 1, "rad", False),
)
"""Position inertial, small rotation and velocities in body axes; those that move come first."""

N_ERROR = sum(block.size for block in BLOCKS)
"""Size of the error state."""
N_MOVING = sum(block.size for block in BLOCKS if block.moved)
"""Its first rows, which the equations of motion move."""


def first_column(name: str) -> int:
    """First column of a block.

    Raises:
        KeyError: no block has this name.
    """
    at = 0
    for block in BLOCKS:
        if block.name == name:
            return at
        at += block.size
    raise KeyError(name)


def columns(name: str) -> slice:
    """Columns of a block."""
    first = first_column(name)
    return slice(first, first + next(b.size for b in BLOCKS if b.name == name))


PHASE_COLUMN = first_column("tail_phase")
DISTURBANCE_COLUMN = first_column("disturbance")
