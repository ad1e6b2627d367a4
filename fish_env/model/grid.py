"""When a rollout steps, which command holds meanwhile, and when it stores a sample."""

from __future__ import annotations

from typing import NamedTuple

from fish_env.arrays import FloatArray, IntArray


class Grid(NamedTuple):
    """Segments of a rollout: piecewise constant commands and step sizes.

    Attributes:
        slots: (segments,) which row of the commands holds.
        starts: (segments,) time since the start at which each segment begins (s).
        steps: (segments,) physics steps in each.
        sizes: (segments,) step size (s).
        every: (segments,) a sample is stored after every this many steps.
    """

    slots: IntArray
    starts: FloatArray
    steps: IntArray
    sizes: FloatArray
    every: IntArray
